//! What can be typed about archives on the network.

use crate::examples;
use clap::{ArgGroup, Args};
use std::net::IpAddr;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::time::Duration;
use supine_dicom_network::{Call, Error, Node, Title, Tls, TlsFiles};

#[derive(Args, Debug)]
#[command(after_long_help = examples::SEND)]
pub(crate) struct Send {
    /// Folders or files; of folders everything below
    #[arg(value_name = "DIR|FILE", required = true)]
    pub(crate) paths: Vec<PathBuf>,
    /// The archive
    #[arg(long, value_name = "AET@HOST:PORT")]
    pub(crate) to: Node,
    /// Our own application entity title
    #[arg(long, value_name = "AET", default_value = "SUPINE")]
    pub(crate) from: Title,
    /// Objects of every kind, not only CT, registrations, doses, structure sets, segmentations and
    /// PDFs
    #[arg(long)]
    pub(crate) all: bool,
    /// Also what the archive has acknowledged in an earlier call
    #[arg(long)]
    pub(crate) again: bool,
    /// Send the files of a run that is unfinished or must not be used (verdict red); its log notes
    /// it
    #[arg(long)]
    pub(crate) although_not_usable: bool,
    #[command(flatten)]
    pub(crate) link: Link,
}

#[derive(Args, Debug)]
#[command(after_long_help = examples::FETCH)]
#[command(group(ArgGroup::new("wanted").required(true).multiple(true)))]
pub(crate) struct Fetch {
    /// The archive
    #[arg(long, value_name = "AET@HOST:PORT")]
    pub(crate) from: Node,
    /// Study Instance UID
    #[arg(long, value_name = "UID", group = "wanted")]
    pub(crate) study: Option<String>,
    /// Series Instance UID
    #[arg(long, value_name = "UID", group = "wanted")]
    pub(crate) series: Option<String>,
    /// Patient ID, as the archive has it
    #[arg(long, value_name = "ID", group = "wanted")]
    pub(crate) patient_id: Option<String>,
    /// Study Date, or a range of them
    #[arg(long, value_name = "YYYYMMDD[-YYYYMMDD]")]
    pub(crate) date: Option<String>,
    /// Where the objects go, each as UID.dcm; what is there already is not fetched again
    #[arg(long, value_name = "DIR", required_unless_present = "list")]
    pub(crate) out: Option<PathBuf>,
    /// Only say what is there
    #[arg(long, conflicts_with = "out")]
    pub(crate) list: bool,
    /// Our own application entity title
    #[arg(long = "as", value_name = "AET", default_value = "SUPINE")]
    pub(crate) own: Title,
    /// By C-MOVE to this title, which the archive knows with our address and port, instead of C-GET
    #[arg(long, value_name = "AET", requires = "port")]
    pub(crate) move_to: Option<Title>,
    /// The port to listen on for C-MOVE
    #[arg(long, value_name = "N", requires = "move_to")]
    pub(crate) port: Option<u16>,
    /// The address to listen on for C-MOVE [default: the one by which the archive is reached]
    #[arg(long, value_name = "ADDRESS", requires = "move_to")]
    pub(crate) bind: Option<IpAddr>,
    #[command(flatten)]
    pub(crate) link: Link,
}

/// How an archive is spoken to.
#[derive(Args, Debug)]
pub(crate) struct Link {
    /// Encrypt, and have the archive prove who it is: TLS 1.2 or 1.3
    #[arg(long)]
    tls: bool,
    /// Who may answer for the archive: certificates of issuers, or its own, PEM [default: the
    /// system's]
    #[arg(long, value_name = "FILE", requires = "tls")]
    tls_ca: Option<PathBuf>,
    /// Our own certificate for archives that ask for one, PEM
    #[arg(long, value_name = "FILE", requires = "tls", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// Its private key, PEM without a password
    #[arg(long, value_name = "FILE", requires = "tls", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Longest silence of the archive, seconds
    #[arg(long, value_name = "S", default_value = "30")]
    timeout: NonZeroU32,
    /// How often to try again when nothing more gets through
    #[arg(long, value_name = "N", default_value_t = 3)]
    retries: u32,
}

impl Link {
    /// A call of the archive under our own title.
    pub(crate) fn call(&self, peer: &Node, own: &Title) -> Result<Call, Error> {
        let files = TlsFiles {
            trusted: self.tls_ca.clone(),
            own: self.tls_cert.clone().zip(self.tls_key.clone()),
        };
        Ok(Call {
            peer: peer.clone(),
            own: own.clone(),
            tls: self.tls.then(|| Tls::new(&files)).transpose()?,
            timeout: Duration::from_secs(self.timeout.get().into()),
            retries: self.retries,
        })
    }
}

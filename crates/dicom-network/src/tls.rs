//! TLS below the protocol data units (PS3.15 B.12, the BCP 195 profile): versions 1.2 and 1.3 with
//! the cipher suites of RFC 9325, forward secret and authenticated throughout.

use crate::error::Error;
use rustls::client::{ResolvesClientCert, Resumption, WebPkiServerVerifier};
use rustls::crypto::CryptoProvider;
use rustls::pki_types::pem::{self, PemObject as _};
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::server::WebPkiClientVerifier;
use rustls::sign::{CertifiedKey, SingleCertAndKey};
use rustls::version::{TLS12, TLS13};
use rustls::{
    ClientConfig, ClientConnection, Connection, RootCertStore, ServerConfig, ServerConnection,
    SignatureScheme, SupportedProtocolVersion,
};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::pinned::Pinned;

const VERSIONS: [&SupportedProtocolVersion; 2] = [&TLS13, &TLS12];

/// The files TLS is set up from, in PEM.
#[derive(Clone, Debug, Default)]
pub struct TlsFiles {
    /// Certificates that are trusted: of issuers, or the archive's own. Those of the system where
    /// none is given.
    pub trusted: Option<PathBuf>,
    /// Our own certificate, with those of its issuers after it, and its private key.
    pub own: Option<(PathBuf, PathBuf)>,
}

/// How TLS is spoken: whom we trust, and who we are.
#[derive(Clone)]
pub struct Tls {
    client: Arc<ClientConfig>,
    own: Option<Arc<CertifiedKey>>,
    server: Option<Arc<ServerConfig>>,
}

impl fmt::Debug for Tls {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Never the key.
        f.debug_struct("Tls").field("own", &self.own.is_some()).finish_non_exhaustive()
    }
}

impl Tls {
    /// Reads the files.
    ///
    /// # Errors
    /// When one cannot be read or holds nothing of use, when the key is not that of the
    /// certificate, or when no file is given and the system trusts nobody.
    pub fn new(files: &TlsFiles) -> Result<Self, Error> {
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let own = match &files.own {
            Some((certificate, key)) => Some(Arc::new(certified(certificate, key, &provider)?)),
            None => None,
        };
        let given = match &files.trusted {
            Some(path) => certificates(path)?,
            None => Vec::new(),
        };
        let roots = Arc::new(match &files.trusted {
            Some(path) => roots(&given).map_err(|what| unusable(path, what))?,
            None => system_roots()?,
        });
        let wrong = |e: &dyn fmt::Display| Error::TlsSetUp(format!("TLS cannot be set up: {e}"));
        let archive = WebPkiServerVerifier::builder_with_provider(roots.clone(), provider.clone())
            .build()
            .map_err(|e| wrong(&e))?;
        let mut client = ClientConfig::builder_with_provider(provider.clone())
            .with_protocol_versions(&VERSIONS)
            .map_err(|e| wrong(&e))?
            .dangerous()
            .with_custom_certificate_verifier(Arc::new(Pinned::new(archive, &given)))
            .with_no_client_auth();
        // Some archives end the connection when a session is resumed that has a certificate of
        // ours.
        client.resumption = Resumption::disabled();
        let mut server = None;
        // A caller that proves itself by an issuer whom every machine trusts proves nothing.
        if let (Some(own), Some(_)) = (&own, &files.trusted) {
            let caller = WebPkiClientVerifier::builder_with_provider(roots, provider.clone())
                .build()
                .map_err(|e| wrong(&e))?;
            let config = ServerConfig::builder_with_provider(provider)
                .with_protocol_versions(&VERSIONS)
                .map_err(|e| wrong(&e))?
                .with_client_cert_verifier(Arc::new(Pinned::new(caller, &given)))
                .with_cert_resolver(Arc::new(SingleCertAndKey::from(own.clone())));
            server = Some(Arc::new(config));
        }
        Ok(Self { client: Arc::new(client), own, server })
    }

    /// Whether an archive can call us: we have a certificate, and know whose it may have.
    pub fn can_listen(&self) -> bool {
        self.server.is_some()
    }

    /// Our side of a connection that we open to `host`, a name or an address.
    pub(crate) fn call(&self, host: &str) -> Result<(Connection, Asked), String> {
        let name = ServerName::try_from(host.to_owned())
            .map_err(|_| "its host is neither a name nor an address".to_owned())?;
        let asked = Asked::default();
        let mut config = (*self.client).clone();
        let own = self.own.clone();
        config.client_auth_cert_resolver = Arc::new(Own { own, asked: asked.clone() });
        let connection =
            ClientConnection::new(Arc::new(config), name).map_err(|e| e.to_string())?;
        Ok((connection.into(), asked))
    }

    /// Our side of a connection that was opened to us.
    pub(crate) fn answer(&self) -> Result<Connection, String> {
        let Some(config) = self.server.clone() else {
            return Err("we have no certificate to answer with".into());
        };
        ServerConnection::new(config).map(Connection::from).map_err(|e| e.to_string())
    }
}

/// Whether the archive asked for a certificate that we do not have.
#[derive(Clone, Debug, Default)]
pub(crate) struct Asked(Arc<AtomicBool>);

impl Asked {
    pub(crate) fn in_vain(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Our own certificate, given when it is asked for.
#[derive(Debug)]
struct Own {
    own: Option<Arc<CertifiedKey>>,
    asked: Asked,
}

impl ResolvesClientCert for Own {
    fn resolve(&self, _: &[&[u8]], _: &[SignatureScheme]) -> Option<Arc<CertifiedKey>> {
        self.asked.0.store(self.own.is_none(), Ordering::Relaxed);
        self.own.clone()
    }

    fn has_certs(&self) -> bool {
        // Asked even where there is none, so that it can be told.
        true
    }
}

fn unusable(path: &Path, what: impl Into<String>) -> Error {
    Error::TlsFile { path: path.to_owned(), what: what.into() }
}

/// What PEM says is wrong, without its text, which may be a key's.
fn pem_error(path: &Path, wanted: &str, error: pem::Error) -> Error {
    match error {
        pem::Error::Io(source) => Error::Read { path: path.to_owned(), source },
        pem::Error::NoItemsFound => unusable(path, format!("there is no {wanted} in PEM in it")),
        _ => unusable(path, "it is no sound PEM"),
    }
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, Error> {
    let fail = |e| pem_error(path, "certificate", e);
    let certs: Result<Vec<_>, _> = CertificateDer::pem_file_iter(path).map_err(fail)?.collect();
    match certs.map_err(fail)? {
        certs if certs.is_empty() => Err(fail(pem::Error::NoItemsFound)),
        certs => Ok(certs),
    }
}

fn certified(
    certificate: &Path,
    key: &Path,
    provider: &CryptoProvider,
) -> Result<CertifiedKey, Error> {
    let chain = certificates(certificate)?;
    let wanted = "private key without a password";
    let private = PrivateKeyDer::from_pem_file(key).map_err(|e| pem_error(key, wanted, e))?;
    CertifiedKey::from_der(chain, private, provider).map_err(|error| match error {
        rustls::Error::InconsistentKeys(_) => {
            unusable(key, format!("it is not the key of {}", certificate.display()))
        }
        rustls::Error::InvalidCertificate(_) => {
            unusable(certificate, "its certificate cannot be read: X.509 version 3 is wanted")
        }
        _ => unusable(
            key,
            "not a key for RSA of 2048 to 8192 bits, ECDSA on P-256 or P-384, Ed25519",
        ),
    })
}

fn roots(certificates: &[CertificateDer<'static>]) -> Result<RootCertStore, String> {
    let mut roots = RootCertStore::empty();
    for (n, certificate) in certificates.iter().enumerate() {
        let added = roots.add(certificate.clone());
        added.map_err(|_| format!("its certificate number {} cannot be read", n + 1))?;
    }
    Ok(roots)
}

fn system_roots() -> Result<RootCertStore, Error> {
    let mut roots = RootCertStore::empty();
    roots.add_parsable_certificates(rustls_native_certs::load_native_certs().certs);
    if roots.is_empty() {
        let what = "this system trusts no issuer of certificates: give that of the archive's";
        return Err(Error::TlsSetUp(format!("{what} with --tls-ca")));
    }
    Ok(roots)
}

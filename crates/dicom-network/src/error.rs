//! What can go wrong, in words that name the peer and never the patient.

use crate::node::{Node, Title};
use std::path::PathBuf;
use supine_space::{Failure, Stopped};

/// Why objects did not get through.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No connection.
    #[error("no connection to {node}: {source}")]
    Connect {
        /// The peer.
        node: Node,
        /// What the system said.
        source: std::io::Error,
    },
    /// The connection is there, but no TLS over it.
    #[error("no TLS with {node}: {what}")]
    Tls {
        /// The peer, or who called us.
        node: String,
        /// Why, and what to do.
        what: String,
    },
    /// A file for TLS is not what it should be.
    #[error("cannot use {} for TLS: {what}", path.display())]
    TlsFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// TLS cannot be set up.
    #[error("{0}")]
    TlsSetUp(String),
    /// The association ended before its work.
    #[error("the association with {node} broke: {what}")]
    Broken {
        /// The peer, or who called us.
        node: String,
        /// How.
        what: String,
    },
    /// The peer ended the association by A-ABORT, without a reason.
    #[error("the association with {node} broke: the peer aborted it")]
    Aborted {
        /// The peer, or who called us.
        node: String,
        /// The address from which it was called.
        from: std::net::IpAddr,
    },
    /// The peer ends every association as soon as it is asked for something.
    #[error(
        "{node} ends the association whenever it is asked to {what}: {own}, calling from {from}, may not be \
         permitted to there; have that AE title and address entered, or give the title that it knows"
    )]
    NotPermitted {
        /// The peer.
        node: Node,
        /// What it is asked to do.
        what: &'static str,
        /// Our title.
        own: Title,
        /// The address from which it was called.
        from: std::net::IpAddr,
    },
    /// The peer does not want the association.
    #[error("{node} rejects the association: {reason}")]
    Rejected {
        /// The peer.
        node: Node,
        /// Its reason (PS3.8 9.3.4).
        reason: String,
        /// Whether it may accept it later.
        transient: bool,
    },
    /// The peer does not offer what is asked.
    #[error("{node} does not offer {what}")]
    NotOffered {
        /// The peer.
        node: Node,
        /// The service, and what to do instead.
        what: String,
    },
    /// The peer does not keep to the standard.
    #[error("{node} does not keep to the DICOM protocol: {what}")]
    Protocol {
        /// The peer, or who called us.
        node: String,
        /// What it did.
        what: String,
    },
    /// The peer failed to do what was asked.
    #[error("{node} fails to {what}: {status}")]
    Failed {
        /// The peer.
        node: Node,
        /// What was asked.
        what: &'static str,
        /// Its status, in words.
        status: String,
        /// Whether it may succeed later.
        transient: bool,
    },
    /// Nothing there is meant by the query, or too much.
    #[error("{0}")]
    Query(String),
    /// No objects to send.
    #[error("nothing to send in {}: {found}", path.display())]
    NothingToSend {
        /// The folder or file.
        path: PathBuf,
        /// What is there instead.
        found: String,
    },
    /// Objects that are to be sent contradict each other.
    #[error(
        "{first} and {second} have {what}: nothing was sent; send each from a folder of its own, or leave out the one that is wrong"
    )]
    Mixed {
        /// Path of a file below the folder that was given.
        first: String,
        /// Path of another.
        second: String,
        /// What contradicts.
        what: String,
    },
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// We cannot listen for what a C-MOVE sends.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// Address and port.
        address: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file or folder of DICOM cannot be used.
    #[error(transparent)]
    Dicom(#[from] supine_dicom::Error),
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Error {
    /// What kind of failure it is; that the peer or the network was not there is worth a retry.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Connect { .. } | Self::Broken { .. } | Self::Aborted { .. } => Failure::Retry,
            Self::Rejected { transient, .. } | Self::Failed { transient, .. } if *transient => {
                Failure::Retry
            }
            Self::Write { source, .. } => Failure::of_output(source),
            Self::Listen { .. } => Failure::Output,
            Self::Stopped(_) => Failure::Stopped,
            Self::Dicom(error) => error.kind(),
            _ => Failure::Input,
        }
    }

    /// What a failure means that came again and again, with nothing ever got through: archives
    /// abort what they do not permit, and a further try would end the same.
    pub(crate) fn in_vain(self, call: &crate::Call, what: &'static str) -> Self {
        let (node, own) = (call.peer.clone(), call.own.clone());
        match self {
            Self::Aborted { from, .. } => Self::NotPermitted { node, what, own, from },
            error => error,
        }
    }

    /// Whether another association may get on; a full disk is worth a retry too, but not by the
    /// peer.
    pub(crate) fn of_the_peer(&self) -> bool {
        self.kind() == Failure::Retry && !matches!(self, Self::Write { .. } | Self::Dicom(_))
    }
}

//! Certificates that are trusted by themselves: the archive's own, given as a file.
//!
//! A certificate that signed itself is an issuer's by its form, and is not taken as a machine's by the
//! rules for chains (RFC 5280 4.2.1.9). Many archives have such a one, often with no name but the
//! retired Common Name. Where the very certificate was given there is nothing left for chain and name
//! to prove (RFC 9525 section 6.6, pinning); that its key is held and its time has not run out is
//! proved as always.

use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::{CertificateError, DigitallySignedStruct, DistinguishedName, Error, SignatureScheme};
use std::sync::Arc;

/// The rules `by_chain`, and certificates that are trusted without them.
#[derive(Debug)]
pub(crate) struct Pinned<V: ?Sized> {
    given: Vec<CertificateDer<'static>>,
    by_chain: Arc<V>,
}

impl<V: ?Sized> Pinned<V> {
    pub(crate) fn new(by_chain: Arc<V>, given: &[CertificateDer<'static>]) -> Self {
        Self { given: given.to_vec(), by_chain }
    }

    /// Whether a certificate that was refused is one that was given. Its time is looked at before its
    /// form and its issuer, so these errors say that it has not run out.
    fn is_given(&self, certificate: &CertificateDer<'_>, error: &Error) -> bool {
        use CertificateError::{NotValidForName, NotValidForNameContext, Other, UnknownIssuer};
        let not_by_chain = matches!(
            error,
            Error::InvalidCertificate(
                UnknownIssuer | NotValidForName | NotValidForNameContext { .. } | Other(_)
            )
        );
        not_by_chain && self.given.iter().any(|given| given == certificate)
    }
}

impl<V: ServerCertVerifier + ?Sized> ServerCertVerifier for Pinned<V> {
    fn verify_server_cert(
        &self,
        certificate: &CertificateDer<'_>,
        issuers: &[CertificateDer<'_>],
        name: &ServerName<'_>,
        ocsp: &[u8],
        now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        match self.by_chain.verify_server_cert(certificate, issuers, name, ocsp, now) {
            Err(e) if self.is_given(certificate, &e) => Ok(ServerCertVerified::assertion()),
            verified => verified,
        }
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        self.by_chain.verify_tls12_signature(message, certificate, signed)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        self.by_chain.verify_tls13_signature(message, certificate, signed)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.by_chain.supported_verify_schemes()
    }
}

impl<V: ClientCertVerifier + ?Sized> ClientCertVerifier for Pinned<V> {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        self.by_chain.root_hint_subjects()
    }

    fn verify_client_cert(
        &self,
        certificate: &CertificateDer<'_>,
        issuers: &[CertificateDer<'_>],
        now: UnixTime,
    ) -> Result<ClientCertVerified, Error> {
        match self.by_chain.verify_client_cert(certificate, issuers, now) {
            Err(e) if self.is_given(certificate, &e) => Ok(ClientCertVerified::assertion()),
            verified => verified,
        }
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        self.by_chain.verify_tls12_signature(message, certificate, signed)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        self.by_chain.verify_tls13_signature(message, certificate, signed)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.by_chain.supported_verify_schemes()
    }
}

//! Certificates that are trusted by themselves: the archive's own, given as a file.
//!
//! A certificate that signed itself is an issuer's by its form, and is not taken as a machine's by
//! the rules for chains (RFC 5280 4.2.1.9). Many archives have such a one, often with no name but
//! the retired Common Name. Where the very certificate was given there is nothing left for chain
//! and name to prove (RFC 9525 section 6.6, pinning); that its key is held and its time has not run
//! out is proved as always.

use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::{
    CertificateError, DigitallySignedStruct, DistinguishedName, Error, OtherError, RootCertStore,
    SignatureScheme,
};
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

    /// Whether a certificate that was refused is one that was given. Its time is looked at before
    /// its form and its issuer, so these errors say that it has not run out.
    fn is_given(&self, certificate: &CertificateDer<'_>, error: &Error) -> bool {
        use CertificateError::{NotValidForName, NotValidForNameContext};
        let not_by_chain = is_unknown(error)
            || matches!(
                error,
                Error::InvalidCertificate(NotValidForName | NotValidForNameContext { .. })
            );
        not_by_chain && self.given.iter().any(|given| given == certificate)
    }

    /// Whether a certificate that was refused, or its issuer's, is known by its name and is
    /// another.
    fn is_renewed(&self, certificate: &CertificateDer<'_>, error: &Error) -> bool {
        let alike = || {
            let name = subject(certificate);
            name.is_some() && self.given.iter().any(|given| subject(given) == name)
        };
        has_other_key(error) || (is_unknown(error) && alike())
    }

    /// Whether a certificate is taken, after what the rules for chains said of it.
    fn judged<T>(
        &self,
        by_chain: Result<T, Error>,
        certificate: &CertificateDer<'_>,
        taken: T,
    ) -> Result<T, Error> {
        match by_chain {
            Err(error) if self.is_given(certificate, &error) => Ok(taken),
            Err(error) if self.is_renewed(certificate, &error) => {
                let renewed = CertificateError::Other(OtherError(Arc::new(Renewed)));
                Err(Error::InvalidCertificate(renewed))
            }
            judged => judged,
        }
    }
}

/// A certificate, or its issuer's, has the name of one that is known and is another.
#[derive(Debug)]
pub(crate) struct Renewed;

impl std::fmt::Display for Renewed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("another certificate than the known one of this name")
    }
}

impl std::error::Error for Renewed {}

/// Whether the rules for chains found an issuer by its name whose key did not sign the certificate.
fn has_other_key(error: &Error) -> bool {
    use CertificateError::{BadSignature, UnsupportedSignatureAlgorithmForPublicKeyContext};
    matches!(
        error,
        Error::InvalidCertificate(
            BadSignature | UnsupportedSignatureAlgorithmForPublicKeyContext { .. }
        )
    )
}

/// Whether the rules for chains know nobody who answers for a certificate.
fn is_unknown(error: &Error) -> bool {
    use CertificateError::{Other, UnknownIssuer};
    has_other_key(error) || matches!(error, Error::InvalidCertificate(UnknownIssuer | Other(_)))
}

/// The name of a certificate (RFC 5280 4.1.2.6), as it is encoded.
fn subject(certificate: &CertificateDer<'_>) -> Option<Vec<u8>> {
    let mut store = RootCertStore::empty();
    store.add(certificate.clone().into_owned()).ok()?;
    store.roots.first().map(|anchor| anchor.subject.to_vec())
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
        let by_chain = self.by_chain.verify_server_cert(certificate, issuers, name, ocsp, now);
        self.judged(by_chain, certificate, ServerCertVerified::assertion())
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
        let by_chain = self.by_chain.verify_client_cert(certificate, issuers, now);
        self.judged(by_chain, certificate, ClientCertVerified::assertion())
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

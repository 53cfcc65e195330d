//! Whether certificate, key and authority belong together, and serve the end of the network that has them.
//!
//! What the other end would refuse is refused here, before anybody waits for a connection. No clock is asked: that of a robot may be years off,
//! so the chain is judged at the moment from which on all of it is valid.

use super::settings::Credentials;
use rustls::client::verify_server_cert_signed_by_trust_anchor;
use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};
use rustls::server::{ParsedCertificate, WebPkiClientVerifier};
use rustls::sign::CertifiedKey;
use rustls::{CertificateError, Error, InconsistentKeys, RootCertStore};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use x509_parser::prelude::{FromDer, X509Certificate};

/// An end of the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// `wormd bridge`, which listens.
    Robot,
    /// `wormd fleet`, which connects.
    Laptop,
}

impl Side {
    const fn needs(self) -> &'static str {
        match self {
            Self::Robot => {
                "it does not serve for listening: `wormd bridge` needs a robot's, as `make-keys FOLDER robot NAME ADDRESS` makes it; a laptop's \
                 serves for connecting alone"
            }
            Self::Laptop => {
                "it does not serve for connecting: `wormd fleet` needs a laptop's, as `make-keys FOLDER laptop NAME` makes it; a robot's serves \
                 for listening alone"
            }
        }
    }
}

/// Checks what an end proves itself by, as the other end will.
///
/// # Errors
/// In words, with the files and what to do.
pub(super) fn check(credentials: &Credentials, side: Side) -> Result<(), String> {
    let Credentials {
        certificate,
        key,
        authority,
        ..
    } = credentials;
    let provider = ring::default_provider();
    let chain = certificates("certificate", certificate)?;
    check_key(&chain, certificate, key, &provider)?;
    let mut roots = RootCertStore::empty();
    for root in certificates("authority", authority)? {
        roots.add(root).map_err(|error| {
            let place = authority.display();
            format!("authority {place}: {error}: name the certificate of the authority (ca.pem)")
        })?;
    }
    let verified = valid_from(&chain).and_then(|moment| verify(&chain, roots, moment, provider, side));
    verified.map_err(|error| {
        let (certificate, authority) = (certificate.display(), authority.display());
        match error {
            Error::InvalidCertificate(
                CertificateError::InvalidPurpose | CertificateError::InvalidPurposeContext { .. },
            ) => format!("certificate {certificate}: {}", side.needs()),
            Error::InvalidCertificate(CertificateError::UnknownIssuer | CertificateError::BadSignature) => format!(
                "certificate {certificate} is not signed by authority {authority}, so nobody who trusts that would take it: name the authority \
                 that signed it, or have a certificate made by this one (`make-keys`)"
            ),
            error => format!("certificate {certificate} cannot be used with authority {authority}: {error}: make another one with `make-keys`"),
        }
    })
}

fn check_key(
    chain: &[CertificateDer<'static>],
    certificate: &Path,
    file: &Path,
    provider: &CryptoProvider,
) -> Result<(), String> {
    let (place, certificate) = (file.display(), certificate.display());
    let key = PrivateKeyDer::from_pem_file(file).map_err(|error| {
        format!("key {place}: it has no private key that can be read ({error}): give one in PEM without a password, as `make-keys` makes it")
    })?;
    match CertifiedKey::from_der(chain.to_vec(), key, provider) {
        Ok(_) => Ok(()),
        Err(Error::InconsistentKeys(InconsistentKeys::KeyMismatch)) => Err(format!(
            "key {place} does not belong to certificate {certificate}: name the two that were made together"
        )),
        Err(error) => Err(format!(
            "key {place} cannot be used with certificate {certificate}: {error}: make both with `make-keys`"
        )),
    }
}

fn certificates(what: &str, file: &Path) -> Result<Vec<CertificateDer<'static>>, String> {
    let all = CertificateDer::pem_file_iter(file).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let place = file.display();
    match all {
        Ok(all) if !all.is_empty() => Ok(all),
        Ok(_) => Err(format!("{what} {place}: it has no certificate in PEM")),
        Err(error) => Err(format!("{what} {place}: {error}: give certificates in PEM alone")),
    }
}

/// The moment from which on all of a chain is valid.
fn valid_from(chain: &[CertificateDer<'_>]) -> Result<UnixTime, Error> {
    let mut latest = 0;
    for link in chain {
        let (_, read) =
            X509Certificate::from_der(link).map_err(|_| Error::InvalidCertificate(CertificateError::BadEncoding))?;
        latest = latest.max(read.validity().not_before.timestamp());
    }
    Ok(UnixTime::since_unix_epoch(Duration::from_secs(
        u64::try_from(latest).unwrap_or(0),
    )))
}

fn verify(
    chain: &[CertificateDer<'_>],
    roots: RootCertStore,
    moment: UnixTime,
    provider: CryptoProvider,
    side: Side,
) -> Result<(), Error> {
    let (own, between) = chain.split_first().ok_or(Error::NoCertificatesPresented)?;
    match side {
        Side::Robot => {
            let algorithms = provider.signature_verification_algorithms.all;
            let own = ParsedCertificate::try_from(own)?;
            verify_server_cert_signed_by_trust_anchor(&own, &roots, between, moment, algorithms)
        }
        Side::Laptop => WebPkiClientVerifier::builder_with_provider(Arc::new(roots), Arc::new(provider))
            .build()
            .map_err(|error| Error::General(error.to_string()))?
            .verify_client_cert(own, between, moment)
            .map(drop),
    }
}

//! What an end of the network proves itself by: certificate, key and authority, which must belong together and serve that end.
//!
//! What the other end would refuse is refused here, before anybody waits for a connection. No clock is asked: that of a robot may be years off,
//! so the chain is judged at the moment from which on all of it is valid.

use crate::failure::Failure;
use rustls::client::verify_server_cert_signed_by_trust_anchor;
use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};
use rustls::server::{ParsedCertificate, WebPkiClientVerifier};
use rustls::sign::CertifiedKey;
use rustls::{CertificateError, Error, InconsistentKeys, RootCertStore};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use x509_parser::prelude::{FromDer, X509Certificate};

/// What an end of the network proves itself by.
#[derive(Debug, Clone)]
pub(crate) struct Credentials {
    /// Its certificate, PEM.
    pub(crate) certificate: PathBuf,
    /// The key of it, PEM.
    pub(crate) key: PathBuf,
    /// The authority that signs for both ends, PEM.
    pub(crate) authority: PathBuf,
    /// Common name of the certificate.
    pub(crate) name: String,
}

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

impl Credentials {
    /// Reads and checks what a file of settings names; paths count from its folder.
    ///
    /// # Errors
    /// What is missing, cannot be read, or would be refused by the other end.
    pub(super) fn load(
        file: &Path,
        certificate: Option<PathBuf>,
        key: Option<PathBuf>,
        authority: Option<PathBuf>,
        side: Side,
    ) -> Result<Self, Failure> {
        let wrong = |text: String| Failure::unusable(format!("{}: {text}", file.display()));
        let given = |what: &str, path: Option<PathBuf>| {
            let path = path.ok_or_else(|| {
                wrong(format!(
                    "{what} is missing: both ends prove who they are, so certificate, key and authority are needed; docs/bridge.md says how \
                     to make them"
                ))
            })?;
            Ok::<_, Failure>(beside(file, path))
        };
        let certificate = given("certificate", certificate)?;
        let key = given("key", key)?;
        let authority = given("authority", authority)?;
        let name =
            common_name(&certificate).map_err(|why| wrong(format!("certificate {}: {why}", certificate.display())))?;
        check_name("the certificate's common name", &name).map_err(wrong)?;
        common_name(&authority).map_err(|why| wrong(format!("authority {}: {why}", authority.display())))?;
        check_key(&key).map_err(|why| wrong(format!("key {}: {why}", key.display())))?;
        let credentials = Self {
            certificate,
            key,
            authority,
            name,
        };
        check(&credentials, side).map_err(wrong)?;
        Ok(credentials)
    }
}

/// Checks what an end proves itself by, as the other end will.
///
/// # Errors
/// In words, with the files and what to do.
fn check(credentials: &Credentials, side: Side) -> Result<(), String> {
    let Credentials {
        certificate,
        key,
        authority,
        ..
    } = credentials;
    let provider = ring::default_provider();
    let chain = certificates("certificate", certificate)?;
    check_pair(&chain, certificate, key, &provider)?;
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

fn check_pair(
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

/// Why a file cannot be read, and what to do.
fn unreadable(error: &std::io::Error) -> String {
    format!(
        "{error}: give its path, which counts from this file's folder, and let this user read it; docs/bridge.md says how to make it"
    )
}

/// The common name of the first certificate in a file.
fn common_name(file: &Path) -> Result<String, String> {
    let bytes = std::fs::read(file).map_err(|error| unreadable(&error))?;
    let (_, pem) = x509_parser::pem::parse_x509_pem(&bytes)
        .map_err(|_| "it has no certificate in PEM: name a .pem that `make-keys` made".to_owned())?;
    let (_, certificate) =
        X509Certificate::from_der(&pem.contents).map_err(|_| "it has no certificate that can be read".to_owned())?;
    let mut names = certificate.subject().iter_common_name();
    let name = names.next().and_then(|name| name.as_str().ok());
    name.map(str::to_owned)
        .ok_or_else(|| "it has no common name".to_owned())
}

/// A key that others can read proves nothing.
fn check_key(file: &Path) -> Result<(), String> {
    let bytes = std::fs::read(file).map_err(|error| unreadable(&error))?;
    let mode = file
        .metadata()
        .map_err(|error| unreadable(&error))?
        .permissions()
        .mode();
    if !bytes.windows(11).any(|it| it == b"PRIVATE KEY") {
        return Err("it has no private key in PEM: name the .key that `make-keys` made".to_owned());
    }
    if mode & 0o007 != 0 {
        return Err(format!(
            "everybody on this computer may use it (mode {:o}): chmod 600 {}",
            mode & 0o777,
            file.display()
        ));
    }
    Ok(())
}

/// Names of certificates stand in keys, and no public authority signs for a name without a dot.
pub(super) fn check_name(place: &str, name: &str) -> Result<(), String> {
    let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let is_usable = (1..=32).contains(&name.len()) && name.chars().all(is_plain) && !name.starts_with('-');
    match is_usable {
        true => Ok(()),
        false => Err(format!(
            "{place}: \"{name}\" is no usable name of a certificate: 1 to 32 of a-z, 0-9 and -, no dots"
        )),
    }
}

/// A path in a file means one beside that file.
pub(super) fn beside(file: &Path, path: PathBuf) -> PathBuf {
    match file.parent() {
        Some(folder) => folder.join(path),
        None => path,
    }
}

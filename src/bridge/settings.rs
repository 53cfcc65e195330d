//! `bridge.toml` and `fleet.toml`: read, checked, and refused with a reason when they leave anything open.

use super::proof::{self, Side};
use crate::failure::Failure;
use serde::Deserialize;
use std::collections::BTreeSet;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use worm_estimator::config::{Config, ConfigError};
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

/// A checked `bridge.toml`.
#[derive(Debug)]
pub(crate) struct BridgeSettings {
    pub(crate) credentials: Credentials,
    pub(crate) listen: Vec<String>,
    /// Certificates that may drive.
    pub(crate) drive: BTreeSet<String>,
    /// All certificates that may connect.
    pub(crate) all: Vec<String>,
    /// The worms, with the arguments that select each.
    pub(crate) worms: Vec<(Config, Vec<std::ffi::OsString>)>,
}

/// A checked `fleet.toml`.
#[derive(Debug)]
pub(crate) struct FleetSettings {
    /// The file.
    pub(crate) file: PathBuf,
    pub(crate) credentials: Credentials,
    pub(crate) robots: Vec<Robot>,
    /// `topics.root` of the worms as this computer offers them.
    pub(crate) root: Option<String>,
}

/// A robot as a laptop knows it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Robot {
    /// Common name of its certificate.
    pub(crate) name: String,
    /// Where its bridge listens.
    pub(crate) connect: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BridgeFile {
    certificate: Option<PathBuf>,
    key: Option<PathBuf>,
    authority: Option<PathBuf>,
    #[serde(default)]
    listen: Vec<String>,
    access: Option<Access>,
    #[serde(default)]
    worms: Vec<WormEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Access {
    #[serde(default)]
    drive: Vec<String>,
    #[serde(default)]
    watch: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WormEntry {
    config: Option<PathBuf>,
    name: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FleetFile {
    certificate: Option<PathBuf>,
    key: Option<PathBuf>,
    authority: Option<PathBuf>,
    root: Option<String>,
    #[serde(default)]
    robots: Vec<Robot>,
}

impl BridgeSettings {
    /// Reads and checks the file.
    ///
    /// # Errors
    /// [`Failure::Unusable`] when it cannot be read, or leaves anything open.
    pub(crate) fn load(file: &Path) -> Result<Self, Failure> {
        let read: BridgeFile = read(file)?;
        let wrong = |text: String| Failure::unusable(format!("{}: {text}", file.display()));
        let credentials = Credentials::load(file, read.certificate, read.key, read.authority, Side::Robot)?;
        if read.listen.is_empty() {
            return Err(wrong(
                "listen is missing: name the addresses to listen at, as in listen = [\"tls/0.0.0.0:7447\"]".to_owned(),
            ));
        }
        read.listen
            .iter()
            .try_for_each(|it| check_endpoint(it))
            .map_err(wrong)?;
        let access = read
            .access
            .filter(|access| !(access.drive.is_empty() && access.watch.is_empty()));
        let Some(access) = access else {
            return Err(wrong(
                "[access] is missing or empty: nobody could connect. Name the certificates that may drive and those that may only watch, \
                 as in drive = [\"anna\"] and watch = [\"hall\"]"
                    .to_owned(),
            ));
        };
        let mut all = BTreeSet::new();
        for name in access.drive.iter().chain(&access.watch) {
            check_name("[access]", name).map_err(wrong)?;
            if !all.insert(name.clone()) {
                return Err(wrong(format!(
                    "[access]: {name} stands there twice: who may drive may watch, too"
                )));
            }
            if *name == credentials.name {
                return Err(wrong(format!(
                    "[access]: {name} is this bridge's own certificate: give each computer one of its own"
                )));
            }
        }
        if read.worms.is_empty() {
            return Err(wrong(
                "no [[worms]]: name at least one worm, by its config or its name".to_owned(),
            ));
        }
        let mut worms = Vec::new();
        let mut names = BTreeSet::new();
        for entry in read.worms {
            let (config, arguments) = entry.load(file)?;
            if !names.insert(config.worm.name.clone()) {
                return Err(wrong(format!("two [[worms]] are called {}", config.worm.name)));
            }
            worms.push((config, arguments));
        }
        Ok(Self {
            credentials,
            listen: read.listen,
            drive: access.drive.into_iter().collect(),
            all: all.into_iter().collect(),
            worms,
        })
    }
}

impl WormEntry {
    fn load(self, file: &Path) -> Result<(Config, Vec<std::ffi::OsString>), Failure> {
        let mut arguments: Vec<std::ffi::OsString> = Vec::new();
        let mut config = Config::default();
        if let Some(path) = self.config {
            let path = beside(file, path);
            config = Config::load(&path).map_err(|error| match error {
                ConfigError::Read { source, .. } => Failure::unusable(format!(
                    "{}: [[worms]]: config {}: {source}: name the file that the worm runs with, or its name alone (name = \"worm1\")",
                    file.display(),
                    path.display()
                )),
                error => error.into(),
            })?;
            arguments.extend(["--config".into(), path.into()]);
        }
        if let Some(name) = self.name {
            arguments.extend(["--name".into(), name.clone().into()]);
            config.worm.name = name;
        }
        match config.problems().first() {
            None => Ok((config, arguments)),
            Some(problem) => Err(Failure::unusable(format!("{}: [[worms]]: {problem}", file.display()))),
        }
    }
}

impl FleetSettings {
    /// Reads and checks the file.
    ///
    /// # Errors
    /// [`Failure::Unusable`] when it cannot be read, or leaves anything open.
    pub(crate) fn load(file: &Path) -> Result<Self, Failure> {
        let read: FleetFile = read(file)?;
        let wrong = |text: String| Failure::unusable(format!("{}: {text}", file.display()));
        let credentials = Credentials::load(file, read.certificate, read.key, read.authority, Side::Laptop)?;
        if read.robots.is_empty() {
            return Err(wrong(
                "no [[robots]]: name at least one, with name (that of its certificate) and connect (as in \"tls/robot1.local:7447\")"
                    .to_owned(),
            ));
        }
        let mut names = BTreeSet::new();
        for robot in &read.robots {
            check_name("[[robots]]", &robot.name).map_err(wrong)?;
            check_endpoint(&robot.connect).map_err(wrong)?;
            if !names.insert(&robot.name) {
                return Err(wrong(format!("two [[robots]] are called {}", robot.name)));
            }
        }
        Ok(Self {
            file: file.to_path_buf(),
            credentials,
            robots: read.robots,
            root: read.root,
        })
    }
}

impl Credentials {
    fn load(
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
        proof::check(&credentials, side).map_err(wrong)?;
        Ok(credentials)
    }
}

fn read<T: for<'de> Deserialize<'de>>(file: &Path) -> Result<T, Failure> {
    let text = std::fs::read_to_string(file)
        .map_err(|error| Failure::unusable(format!("{}: {error}: docs/bridge.md has an example", file.display())))?;
    toml::from_str(&text).map_err(|error| Failure::unusable(format!("{}: {error}", file.display())))
}

/// A path in a file means one beside that file.
fn beside(file: &Path, path: PathBuf) -> PathBuf {
    match file.parent() {
        Some(folder) => folder.join(path),
        None => path,
    }
}

fn check_endpoint(endpoint: &str) -> Result<(), String> {
    let address = endpoint
        .strip_prefix("tls/")
        .filter(|address| !address.contains(['#', '?', '/']));
    let port = address
        .and_then(|address| address.rsplit_once(':'))
        .map(|(host, port)| (host, port.parse::<u16>()));
    match port {
        Some((host, Ok(_))) if !host.is_empty() => Ok(()),
        _ => Err(format!(
            "\"{endpoint}\" is no address of TLS: give tls/HOST:PORT, as in \"tls/robot1.local:7447\"; nothing else is spoken"
        )),
    }
}

/// Names of certificates stand in keys, and no public authority signs for a name without a dot.
fn check_name(place: &str, name: &str) -> Result<(), String> {
    let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let is_usable = (1..=32).contains(&name.len()) && name.chars().all(is_plain) && !name.starts_with('-');
    match is_usable {
        true => Ok(()),
        false => Err(format!(
            "{place}: \"{name}\" is no usable name of a certificate: 1 to 32 of a-z, 0-9 and -, no dots"
        )),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endpoints_and_names_are_plain_or_refused() {
        for (endpoint, is_usable) in [
            ("tls/robot1.local:7447", true),
            ("tls/[::]:7447", true),
            ("tls/0.0.0.0:0", true),
            ("tcp/robot1.local:7447", false),
            ("quic/robot1:7447", false),
            ("tls/robot1", false),
            ("tls/:7447", false),
            ("tls/robot1:99999", false),
            ("tls/robot1:7447#enable_mtls=false", false),
            ("tls/robot1:7447?rel=0", false),
            ("", false),
        ] {
            assert_eq!(check_endpoint(endpoint).is_ok(), is_usable, "{endpoint}");
        }
        for (name, is_usable) in [
            ("anna", true),
            ("robot-1", true),
            ("", false),
            ("*", false),
            ("a/b", false),
            ("robot1.example.com", false),
            ("Anna", false),
            ("-x", false),
        ] {
            assert_eq!(check_name("here", name).is_ok(), is_usable, "{name}");
        }
    }
}

//! `bridge.toml` and `fleet.toml`: read, checked, and refused with a reason when they leave anything open.

use super::credentials::{Credentials, Side, beside, check_name};
use crate::failure::Failure;
use serde::Deserialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use worm_estimator::config::{Config, ConfigError};

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

fn read<T: for<'de> Deserialize<'de>>(file: &Path) -> Result<T, Failure> {
    let text = std::fs::read_to_string(file)
        .map_err(|error| Failure::unusable(format!("{}: {error}: docs/bridge.md has an example", file.display())))?;
    toml::from_str(&text).map_err(|error| Failure::unusable(format!("{}: {error}", file.display())))
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

//! The licences of everything that is built in, against the list in `deny.toml`.

use serde::Deserialize;
use spdx::{Expression, ParseMode};
use std::process::Command;

#[derive(Deserialize)]
struct Deny {
    licenses: Licences,
}

#[derive(Deserialize)]
struct Licences {
    allow: Vec<String>,
    exceptions: Vec<Exception>,
}

#[derive(Deserialize)]
struct Exception {
    #[serde(rename = "crate")]
    package: String,
    allow: Vec<String>,
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    license: Option<String>,
}

fn packages() -> Vec<Package> {
    let platform = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--locked",
            "--all-features",
            "--filter-platform",
            &platform,
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Metadata = serde_json::from_slice(&output.stdout).expect("metadata of version 1");
    metadata.packages
}

impl Licences {
    fn allow(&self, package: &Package) -> bool {
        let text = package.license.as_deref().unwrap_or_default();
        let Ok(licence) = Expression::parse_mode(text, ParseMode::LAX) else {
            return false;
        };
        let exceptions = self
            .exceptions
            .iter()
            .filter(|exception| exception.package == package.name);
        let names: Vec<&String> = self
            .allow
            .iter()
            .chain(exceptions.flat_map(|exception| &exception.allow))
            .collect();
        licence.evaluate(|required| {
            // With its exception, where it has one.
            let required = required.to_string();
            names.iter().any(|name| **name == required)
        })
    }
}

#[test]
fn every_dependency_has_a_licence_that_is_allowed() {
    let deny: Deny = toml::from_str(include_str!("../../deny.toml")).expect("deny.toml");
    let packages = packages();
    assert!(packages.len() > 50, "only {} packages", packages.len());
    let refused: Vec<String> = packages
        .iter()
        .filter(|package| !deny.licenses.allow(package))
        .map(|package| format!("{}: {}", package.name, package.license.as_deref().unwrap_or("none")))
        .collect();
    assert!(
        refused.is_empty(),
        "licences that deny.toml does not allow: {refused:#?}"
    );
}

#[test]
fn licences_are_judged_by_their_operators() {
    let deny: Deny = toml::from_str(include_str!("../../deny.toml")).expect("deny.toml");
    for (name, licence, is_allowed) in [
        ("any", Some("MIT/Apache-2.0"), true),
        ("any", Some("GPL-3.0-only OR MIT"), true),
        ("any", Some("GPL-3.0-only AND MIT"), false),
        ("any", Some("MPL-2.0"), false),
        ("serialport", Some("MPL-2.0"), true),
        ("any", Some("Apache-2.0 WITH LLVM-exception"), false),
        ("any", Some("no licence"), false),
        ("any", None, false),
    ] {
        let package = Package {
            name: name.to_owned(),
            license: licence.map(str::to_owned),
        };
        assert_eq!(deny.licenses.allow(&package), is_allowed, "{name}: {licence:?}");
    }
}

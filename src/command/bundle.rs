//! `wormd bundle`: everything that support needs of a worm, in one archive.

use super::black_box::PlaceArgs;
use super::status;
use super::{Failure, log_line, print};
use crate::bundle::{Archive, Subject, add_all};
use clap::Args;
use std::path::PathBuf;
use worm_estimator::config::Config;

/// Arguments of `wormd bundle`.
#[derive(Debug, Args)]
pub struct BundleArgs {
    /// The archive, a tar compressed with zstd
    #[arg(long, value_name = "FILE", default_value = "worm-support.tar.zst")]
    out: PathBuf,
    /// Overwrite an existing one
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    place: PlaceArgs,
}

/// Runs `wormd bundle`. The worm may run or not. Prints what could not be had.
///
/// # Errors
/// [`Failure::Unusable`] for a file that exists or cannot be begun; [`Failure::Failed`] when it cannot be completed.
pub fn run(args: &BundleArgs) -> Result<(), Failure> {
    let out = args.out.display();
    if args.out.exists() && !args.force {
        return Err(Failure::unusable(format!(
            "{out} exists already: choose another name with --out, or overwrite it with --force"
        )));
    }
    // One that is there but wrong is part of what the bundle shows; one that is not was meant otherwise.
    if let Some(config) = &args.place.worm.config {
        let readable = std::fs::File::open(config);
        readable.map_err(|error| {
            Failure::unusable(format!(
                "{}: cannot be read: {error}: check the path given with --config",
                config.display()
            ))
        })?;
    }
    let subject = subject(&args.place);
    let mut archive = Archive::begin(&args.out, &subject.worm)
        .map_err(|error| Failure::unusable(format!("{out}: cannot be written: {error}: choose another place")))?;
    let tell = |what: &str| tracing::info!("{what}");
    let written = add_all(&mut archive, &subject, status::as_json(), tell);
    let (missing, bytes) = written.and_then(|()| archive.finish()).map_err(|error| {
        Archive::abandon(&args.out);
        Failure::failed(format!(
            "{out}: cannot be written: {error}: make room or choose another place"
        ))
    })?;
    for part in &missing {
        log_line(format_args!("without {}: {}", part.name, part.reason));
    }
    print::line(format_args!(
        "{out}: {:.1} MB; tokens and passwords are left out; look into it before you pass it on",
        bytes as f64 * 1e-6
    ))
}

/// The worm that is meant. A configuration that cannot be used is a finding, not an error.
fn subject(place: &PlaceArgs) -> Subject {
    let loaded = place.worm.load();
    let worm = match (&place.worm.name, &loaded) {
        (Some(name), _) => name.clone(),
        (None, Ok(config)) => config.worm.name.clone(),
        (None, Err(_)) => Config::default().worm.name,
    };
    let default_folder = PathBuf::from(format!("/var/lib/wormd/{worm}/black-box"));
    Subject {
        black_box: place.folder().map_or(default_folder, |folder| folder.path().to_owned()),
        config: loaded.map_err(|failure| failure.to_string()),
        config_file: place.worm.config.clone(),
        worm,
    }
}

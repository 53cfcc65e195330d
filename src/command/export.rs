//! `wormd export`: a log as tables, or as a whole log of one that was cut off, is damaged, or is old.

use super::{Failure, print};
use clap::Args;
use std::path::PathBuf;
use worm_log::export::{ExportError, OutputError, copy};

/// Arguments of `wormd export`.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("form").required(true).multiple(true))]
pub struct ExportArgs {
    /// The log, as `wormd record` or `wormd up --record` wrote it, of this version or an older one; it need not be complete
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// A complete log with an index, of all that can be read of this one
    #[arg(long, value_name = "FILE", group = "form")]
    mcap: Option<PathBuf>,
    /// A folder with a Parquet file for each topic
    #[cfg(feature = "tables")]
    #[arg(long, value_name = "DIR", group = "form")]
    parquet: Option<PathBuf>,
    /// A folder with a CSV file for each topic
    #[cfg(feature = "tables")]
    #[arg(long, value_name = "DIR", group = "form")]
    csv: Option<PathBuf>,
    /// Tables of only these topics
    #[cfg(feature = "tables")]
    #[arg(long, value_name = "TOPIC,…", value_delimiter = ',', value_parser = super::record::channel, default_value = super::record::ALL_TOPICS, conflicts_with = "mcap")]
    topics: Vec<worm_log::Channel>,
    /// Overwrite existing files
    #[arg(long)]
    force: bool,
}

/// Runs `wormd export`. Prints each file that it wrote.
///
/// # Errors
/// [`Failure::Unusable`] for a log that cannot be read, a file that exists already, and a place where there can be none; [`Failure::Failed`] when
/// one cannot be written.
pub fn run(args: &ExportArgs) -> Result<(), Failure> {
    // Those of each form are the same.
    let mut warnings = Vec::new();
    if let Some(to) = &args.mcap {
        if let (Ok(log), Ok(to)) = (args.log.canonicalize(), to.canonicalize())
            && log == to
        {
            return Err(Failure::unusable(format!(
                "--mcap {} is the log itself: choose another name",
                to.display()
            )));
        }
        let (count, remarks) = copy(&args.log, to, args.force).map_err(failure)?;
        print::line(format_args!("{}: {count} messages", to.display()))?;
        warnings = remarks;
    }
    #[cfg(feature = "tables")]
    {
        use worm_log::export::{TableFormat, tables};
        let folders = [(&args.parquet, TableFormat::Parquet), (&args.csv, TableFormat::Csv)];
        for (folder, format) in folders {
            let Some(folder) = folder else { continue };
            let (tables, remarks) = tables(&args.log, folder, format, &args.topics, args.force).map_err(failure)?;
            for table in tables {
                print::line(format_args!("{}: {} rows", table.file.display(), table.rows))?;
            }
            warnings = remarks;
        }
    }
    for warning in warnings {
        print::log_line(format_args!("note: {warning}"));
    }
    Ok(())
}

fn failure(error: ExportError) -> Failure {
    match error {
        ExportError::Read(_) | ExportError::Output(OutputError::Exists(_) | OutputError::Place { .. }) => {
            Failure::unusable(error)
        }
        ExportError::Output(_) => Failure::failed(error),
    }
}

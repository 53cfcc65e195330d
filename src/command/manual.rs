//! `wormd manual`: man pages and shell completions from the command line's own description, for a package.

use super::Failure;
use clap::Args;
use clap_complete::Shell;
use std::io;
use std::path::{Path, PathBuf};

/// Shells whose completions are written.
const SHELLS: [Shell; 3] = [Shell::Bash, Shell::Fish, Shell::Zsh];

/// Arguments of `wormd manual`.
#[derive(Debug, Args)]
pub struct ManualArgs {
    /// The folder for the folders `man` and `completions`
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

/// Runs `wormd manual` for this command line.
///
/// # Errors
/// [`Failure::Failed`] when a file cannot be written.
pub fn run(args: &ManualArgs, command: clap::Command) -> Result<(), Failure> {
    write_all(&args.out, command).map_err(|error| {
        Failure::failed(format!(
            "{}: man pages and completions cannot be written: {error}",
            args.out.display()
        ))
    })
}

fn write_all(out: &Path, mut command: clap::Command) -> io::Result<()> {
    let (man, completions) = (out.join("man"), out.join("completions"));
    for folder in [&man, &completions] {
        std::fs::create_dir_all(folder)?;
    }
    // Before the completions, which add pages of the command `help`.
    clap_mangen::generate_to(command.clone(), &man)?;
    for shell in SHELLS {
        clap_complete::generate_to(shell, &mut command, "wormd", &completions)?;
    }
    Ok(())
}

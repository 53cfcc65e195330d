//! The report: one page with every figure and table of an experiment, and its series as CSV.
//!
//! [`write()`] takes what the analysis found on one recording, or on several of one worm, and writes a directory with
//! `report.html`, a file that fetches nothing and can be passed on as it is, and beside it `series.csv` and `cycles.csv`; with
//! several runs these are in `run-1`, `run-2`, … in the order given.
//!
//! # Modules, in reading order
//! - [`plot`]: pictures as inline SVG; what is not finite is never drawn.
//! - [`page`]: the page, its figures, tables and tiles. Neither knows anything of worms.
//! - `runs`, `summary`, `figure`, `tables`: the contents of this report.
//! - `sheets` and [`mod@file`]: the CSV, and how files are replaced.
//! - [`by_current`]: the same on recordings in which nobody saw the worm.
//! - [`plan`]: a page on a trip and the design for it.
//! - [`explain`]: another page, on the search for the effect that the model misses; [`servo`]: the same of a servo on a bench.

pub mod by_current;
pub mod explain;
mod figure;
pub mod file;
mod law;

pub mod page;
pub mod plan;
pub mod plot;
mod runs;
pub mod servo;
mod sheets;
mod summary;
mod tables;

pub use file::replace as replace_file;

use crate::experiment::Analysis;
use page::Page;
use plot::DrawError;
use runs::Runs;
use std::io;
use std::path::{Path, PathBuf};
use worm_estimator::number::in_words;

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// There is no run to report on.
    #[error("a report needs at least one analysed recording: give one")]
    NoRuns,
    /// The runs are not of one worm.
    #[error(
        "{recording}: {cells} cells, but {expected} in the first recording: a report is on one worm, so report on them separately"
    )]
    OtherWorm {
        /// The recording that does not fit.
        recording: String,
        /// Its cells.
        cells: usize,
        /// Cells of the first recording.
        expected: usize,
    },
    /// A directory or file cannot be written.
    #[error("{}: {problem}: {source}: {remedy}", path.display())]
    File {
        /// Its path.
        path: PathBuf,
        /// What went wrong.
        problem: &'static str,
        /// The operating system's error.
        source: io::Error,
        /// What to do.
        remedy: &'static str,
    },
    /// A figure could not be drawn.
    #[error(transparent)]
    Drawing(#[from] DrawError),
    /// A table could not be written as CSV.
    #[error("a table could not be written as CSV: {0}")]
    Csv(#[from] csv::Error),
    /// What a page shows could not be written as JSON.
    #[error("what was found could not be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// The files of a report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The page.
    pub page: PathBuf,
    /// The CSV files, run by run.
    pub sheets: Vec<PathBuf>,
}

/// Writes the report on the runs of one worm into a directory, which is made if necessary. Files of an earlier report are
/// replaced, each at once; other files are left alone.
///
/// # Errors
/// [`ReportError`]; the directory may then hold a part of the new files, each of them whole. The page is written last.
pub fn write(dir: &Path, title: &str, runs: &[Analysis]) -> Result<Written, ReportError> {
    let first = runs.first().ok_or(ReportError::NoRuns)?;
    if let Some(other) = runs.iter().find(|run| run.cells != first.cells) {
        return Err(ReportError::OtherWorm {
            recording: other.recording.clone(),
            cells: other.cells,
            expected: first.cells,
        });
    }
    let folders = folders(runs.len());
    let page = compose(title, Runs(runs), &folders)?;
    let mut sheets = Vec::new();
    for (run, folder) in runs.iter().zip(&folders) {
        let folder = if folder.is_empty() {
            dir.to_owned()
        } else {
            dir.join(folder)
        };
        file::make_directory(&folder)?;
        sheets.push(file::replace(folder.join("series.csv"), &sheets::series(run)?)?);
        sheets.push(file::replace(folder.join("cycles.csv"), &sheets::cycles(run)?)?);
    }
    Ok(Written {
        page: file::replace(dir.join("report.html"), page.as_bytes())?,
        sheets,
    })
}

/// What the report says, for the terminal: its lead and its tables, without figures and single cycles.
pub fn text(runs: &[Analysis]) -> String {
    let runs = Runs(runs);
    let tables = tables::main(runs).map(|table| table.to_string());
    [&[summary::lead(runs)], &tables[..]].concat().join("\n\n")
}

/// Makes the directory of a report and checks that it can be written, before a long analysis.
///
/// # Errors
/// [`ReportError::File`].
pub fn prepare(dir: &Path) -> Result<(), ReportError> {
    file::make_directory(dir)?;
    file::try_directory(dir)
}

/// Where the CSV of each run goes, within the directory.
fn folders(runs: usize) -> Vec<String> {
    if runs == 1 {
        return vec![String::new()];
    }
    (1..=runs).map(|number| format!("run-{number}")).collect()
}

fn compose(title: &str, runs: Runs<'_>, folders: &[String]) -> Result<String, DrawError> {
    let mut page = Page::new(title, &summary::lead(runs));
    summary::add(&mut page, runs)?;
    page.heading("Figures");
    for figure in figure::all(runs)? {
        page.figure(&figure);
    }
    page.heading("Tables");
    let [identification, mean_deformation, against_theory, recordings] = tables::main(runs);
    page.add(&identification);
    page.add(&mean_deformation);
    page.add(&against_theory);
    for (name, run) in runs.named() {
        page.add(tables::cycles(&name, run));
    }
    page.add(&recordings);
    page.heading("The series behind the figures");
    let places: Vec<String> = folders
        .iter()
        .map(|folder| {
            if folder.is_empty() {
                "beside this page".to_owned()
            } else {
                format!("in {folder}")
            }
        })
        .collect();
    page.paragraph(&format!(
        "As CSV, {}: series.csv with every sample of positions, contact points, deformations, forces and energies, and cycles.csv \
         with every cycle. SI units stand in the names of the columns; an empty field is not known.",
        in_words(&places)
    ));
    page.paragraph(
        "Equation, section, figure and table numbers are those of D. Zarrouk, I. Sharf, M. Shoham, Energetic analysis and \
         experiments of earthworm-like locomotion with compliant surfaces, Bioinspiration & Biomimetics 11 (2016) 014001.",
    );
    Ok(page.finish())
}

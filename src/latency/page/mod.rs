//! The page of `wormd latency`: how late the loop is, how near that is to what the machine can do, and what made it late.
//!
//! What was not measured is marked so, never shown as zero.
//!
//! # Modules, in reading order
//! - `words`: durations and ratios as people read them.
//! - `tiles`: the most important values, large, against their aims.
//! - `histograms`: every duration over the floor of this machine.
//! - `ticks`: the worst ticks, part by part, with the evidence.
//! - `tables`: all numbers, culprits, rates and settings.

mod histograms;
mod tables;
mod ticks;
mod tiles;
mod words;

use crate::latency::Outcome;
use std::path::{Path, PathBuf};
use worm_analysis::report::page::Page;
use worm_analysis::report::plot::DrawError;
use worm_analysis::report::{ReportError, file};

/// Writes the page as `latency.html`, and the whole outcome as `latency.json`, into a directory, which is made if necessary.
/// Files of an earlier run are replaced, each at once; other files are left alone. Returns where the page is.
///
/// # Errors
/// [`ReportError::Drawing`] and [`ReportError::Json`] before anything is written; [`ReportError::File`]. The page is written
/// last.
pub fn write(dir: &Path, outcome: &Outcome) -> Result<PathBuf, ReportError> {
    let page = page(outcome)?;
    let json = serde_json::to_string_pretty(outcome)? + "\n";
    file::make_directory(dir)?;
    file::replace(dir.join("latency.json"), json.as_bytes())?;
    file::replace(dir.join("latency.html"), page.as_bytes())
}

fn page(outcome: &Outcome) -> Result<String, DrawError> {
    let title = format!("Latency of {}", outcome.worm);
    let mut page = Page::new(&title, &tiles::lead(outcome)).with_style(include_str!("style.css"));
    page.paragraph_of("finding", &outcome.headline);
    page.tiles(&tiles::rows(outcome));
    page.warnings(&outcome.warnings);
    page.heading("How late, and how late a bare sleeper is");
    page.figure(&histograms::wake(outcome)?);
    page.figure(&histograms::parts(outcome)?);
    page.add(tables::measures(outcome));
    page.heading("What made ticks late");
    tables::add_culprits(&mut page, outcome);
    page.heading("The worst ticks");
    ticks::add(&mut page, outcome)?;
    page.heading("How fast it can run");
    tables::add_rates(&mut page, outcome);
    page.heading("Settings");
    tables::add_settings(&mut page, outcome);
    page.heading("How this was measured");
    for paragraph in METHOD {
        page.paragraph(paragraph);
    }
    Ok(page.finish())
}

const METHOD: [&str; 3] = [
    "The floor is a bare sleeper like cyclictest: a process that only sleeps until an absolute deadline and publishes one value, in \
     the same run, at the same rate, with the same priority and on the same CPU as the loop, half a period apart from it so that \
     the two do not meet. Its lateness is that of the machine; what the loop has beyond that, wormd adds. The bare notifier and \
     the bare iceoryx2 pairs are the floors of waking and of delivery in the same way. Subscribers that never sleep are measured \
     afterwards, on a CPU that loop and floor then leave alone.",
    "Lateness is counted without coordinated omission: where a stop lasts several periods, each deadline in it counts with its \
     own lateness, not the first one alone. Otherwise one stop of a second would be a single late tick among \
     thousands of good ones.",
    "Period and execution are measured separately: the period is from the beginning of a tick to the beginning of the next one, and \
     shows how steady the loop is; the execution is from the beginning of a tick to its end, and shows how much of the period it \
     needs. Histograms resolve durations to 1\u{a0}%.",
];

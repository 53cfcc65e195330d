//! The page of `wormd latency`: how late the loop is, how near that comes to what the machine can do, and who made it late.
//!
//! What was not measured is said to be not measured; nothing stands there as zero that nobody looked at.
//!
//! # The map, in reading order
//! - `words`: durations and ratios as people read them.
//! - `tiles`: the answer, large, against what it aims at.
//! - `histograms`: every duration over the least that this machine can do.
//! - `ticks`: the worst ticks, part by part on the clock, with the evidence.
//! - `tables`: all numbers, culprits, rates, and what was in force.

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

/// Writes the page as `latency.html`, and the whole outcome as `latency.json`, into a directory, which is made if need be.
/// Files of an earlier run are replaced, each at once; other files are left alone. Gives where the page is.
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
    page.heading("Who made ticks late");
    tables::add_culprits(&mut page, outcome);
    page.heading("The worst ticks");
    ticks::add(&mut page, outcome)?;
    page.heading("How fast it can run");
    tables::add_rates(&mut page, outcome);
    page.heading("What was in force");
    tables::add_settings(&mut page, outcome);
    page.heading("How this was measured");
    for paragraph in MEASURED {
        page.paragraph(paragraph);
    }
    Ok(page.finish())
}

const MEASURED: [&str; 3] = [
    "The floor is a bare sleeper, as cyclictest is one: a process that does nothing but sleep until an absolute deadline and publish \
     one value, in the same run, at the same rate, with the same priority, and on the CPU that the loop is on, half a period apart \
     from it so that the two do not meet. How late it is, the machine is late by itself; what the loop is late beyond that, wormd \
     adds. The bare notifier and the bare iceoryx2 pairs are the floors of waking and of delivery in the same way. Subscribers that \
     never sleep are looked at afterwards, on a CPU that loop and floor then keep off.",
    "Lateness is counted without coordinated omission: where a stop lasts several periods, each deadline in it counts with what \
     it was late, not the first one alone. Counted the other way, one stop of a second would be a single late tick among \
     thousands of good ones.",
    "Period and execution are apart: the period is from the beginning of a tick to the beginning of the next one, and tells how \
     steady the loop is; the execution is from the beginning of a tick to its end, and tells how much of the period it needs. \
     Histograms tell durations apart to 1\u{a0}%.",
];

//! The page of `wormd explain`: which effect the model misses, how sure that is, and what to do next.
//!
//! It is read from the top by someone who runs a worm: the answer in a sentence, then where the gap is, why this effect and no
//! other, how the model follows the data before and after, what was changed in it, and which experiment comes next. A part
//! that the search did not give says why it is not there.
//!
//! # The map, in reading order
//! - `words`: effects, parameters and runs in words, and quantities in the units that people read.
//! - `verdict`: the answer, large.
//! - `map`, `effects`, `overlay`, `gap`: the figures with their tables, in the order of the page.
//! - `changes`: the recalibrated values and the difference of the model's text.
//! - `next`: the next experiment.
//! - `recordings`: what it all rests on.

mod changes;
mod effects;
mod gap;
mod map;
mod next;
mod overlay;
mod recordings;
mod verdict;
mod words;

use super::page::Page;
use super::plot::DrawError;
use super::{ReportError, file};
use crate::explain::Answer;
use std::path::{Path, PathBuf};

/// The page on an answer, as the text of one self-contained HTML file.
///
/// # Errors
/// [`DrawError`] where a figure could not be drawn.
pub fn page(answer: &Answer, title: &str) -> Result<String, DrawError> {
    let mut page = Page::new(title).with_style(include_str!("style.css"));
    verdict::add(&mut page, title, answer);
    page.heading("Where is the gap?");
    map::add(&mut page, answer)?;
    page.heading("Which effect is it, and why not another?");
    effects::add(&mut page, answer)?;
    page.heading("The model before and after, against the data");
    overlay::add(&mut page, answer)?;
    page.heading("How the gap shrinks");
    gap::add(&mut page, answer)?;
    page.heading("What was recalibrated first");
    changes::add_calibration(&mut page, answer);
    page.heading("What changes in the model");
    changes::add_diff(&mut page, answer);
    page.heading("What to try next");
    next::add(&mut page, answer);
    page.heading("What it rests on");
    recordings::add(&mut page, answer);
    Ok(page.finish())
}

/// Writes the page as `report.html` into a directory, which is made if need be. An earlier page is replaced at once; other
/// files are left alone. Gives where the page is.
///
/// # Errors
/// [`ReportError::Drawing`] before anything is written; [`ReportError::File`].
pub fn write(answer: &Answer, title: &str, dir: &Path) -> Result<PathBuf, ReportError> {
    let page = page(answer, title)?;
    file::make_directory(dir)?;
    file::replace(dir.join("report.html"), page.as_bytes())
}

//! Which box of a black box says why the worm stands still: a later warning has a box of its own, which does not.

use super::explain_stop;
use crate::black_box::folder::{Entry, Folder, FolderError};
use crate::black_box::trigger;
use std::path::Path;
use worm_log::messages;

/// In how many boxes a stop is looked for: reading one takes a moment.
const MOST_READ: usize = 32;

/// The newest box with a stop.
#[derive(Debug)]
pub(crate) struct NewestStop {
    /// It, or the newest box where none has a stop.
    pub entry: Entry,
    /// The boxes since then, which have none, the oldest first.
    pub later: Vec<Entry>,
}

/// Looks for the newest complete box with a stop; none where there is no box at all.
///
/// # Errors
/// [`FolderError::Folder`] when the folder cannot be read.
pub(crate) fn newest_stop(folder: &Folder) -> Result<Option<NewestStop>, FolderError> {
    let mut boxes = folder.boxes()?;
    if boxes.iter().any(|entry| !entry.under_way) {
        boxes.retain(|entry| !entry.under_way);
    }
    let Some(newest) = boxes.len().checked_sub(1) else {
        return Ok(None);
    };
    let mut numbers = (0..boxes.len()).rev().take(MOST_READ);
    let found = numbers.find(|&number| has_stop(&folder.path().join(&boxes[number].name)));
    let later = boxes.split_off(found.unwrap_or(newest) + 1);
    Ok(boxes.pop().map(|entry| NewestStop { entry, later }))
}

/// One that cannot be read has none, as far as is known.
fn has_stop(path: &Path) -> bool {
    let Ok(log) = messages(path) else { return false };
    let Ok(config) = log.config() else { return false };
    explain_stop(&log, &config, trigger(path).as_ref(), None).stopped
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::log_sample::{Telemetry, crawl, write_log};
    use worm_estimator::message::{Fault, Mode};

    fn fault_from(first: usize) -> Telemetry {
        let mut telemetry = crawl(1.0);
        for state in &mut telemetry.states {
            state.mode = Mode::Crawling.code();
        }
        for state in &mut telemetry.states[first..] {
            (state.mode, state.fault) = (Mode::Fault.code(), Fault::OverCurrent.code());
        }
        telemetry
    }

    #[test]
    fn a_later_box_without_a_stop_does_not_hide_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let named = |name: &str| folder.path().join(name);
        let boxes = Folder::new(folder.path());
        assert!(newest_stop(&boxes).expect("readable").is_none());
        let warned = "box-000009-20261124T201633Z-link-fault.mcap";
        write_log(&named(warned), &fault_from(0));
        let found = newest_stop(&boxes).expect("readable").expect("a box");
        assert_eq!(
            (found.entry.number, found.later.len()),
            (9, 0),
            "the newest for want of a stop"
        );
        write_log(&named("box-000007-20261124T201433Z-motor-stall.mcap"), &fault_from(500));
        write_log(&named("box-000008-20261124T201533Z-jammed-cell.mcap"), &fault_from(500));
        let found = newest_stop(&boxes).expect("readable").expect("a box");
        let later: Vec<&str> = found.later.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!((found.entry.number, later), (8, vec![warned]));
    }
}

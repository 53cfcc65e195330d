//! Why a file cannot be read.

use std::path::{Path, PathBuf};
use worm_estimator::abridged::abridged;

/// Longest place, problem or remedy, bytes: they may quote the file.
const MAX_TEXT_LEN: usize = 2000;

/// Why something cannot be read as a recording.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {place}{problem}: {remedy}", file = file.display(), place = place.as_ref().map(|place| format!("{place}: ")).unwrap_or_default())]
pub struct ReadError {
    /// The file.
    pub file: PathBuf,
    /// The place in it: a line, a column, a channel, a marker.
    pub place: Option<String>,
    /// What is wrong.
    pub problem: String,
    /// What to do about it.
    pub remedy: String,
}

impl ReadError {
    /// Something wrong with the file as a whole.
    #[must_use]
    pub fn whole(file: &Path, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            file: file.to_path_buf(),
            place: None,
            problem: abridged(problem.into(), MAX_TEXT_LEN),
            remedy: abridged(remedy.into(), MAX_TEXT_LEN),
        }
    }

    /// Something wrong at one place in the file.
    #[must_use]
    pub fn at(file: &Path, place: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            place: Some(abridged(place.into(), MAX_TEXT_LEN)),
            ..Self::whole(file, problem, remedy)
        }
    }
}

//! Checking values, and errors that say what to do.

use crate::abridged::abridged;
use std::fmt::{self, Display};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Most problems that are reported at once: nobody reads more.
const MAX_PROBLEMS: usize = 20;
/// Longest value that is quoted, bytes.
const MAX_VALUE_LEN: usize = 100;
/// Longest remedy, bytes; it may quote a name from the file.
const MAX_REMEDY_LEN: usize = 600;
/// Longest message of the TOML parser, bytes; it may quote a key from the file.
const MAX_SYNTAX_LEN: usize = 2000;

/// A configuration that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file could not be read.
    #[error("{}: {source}: give an existing file with --config, or leave --config out for the paper's worm", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not TOML, an unknown key, or a value of the wrong type.
    #[error("{}:{line}:{column}: {message}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong.
        message: String,
    },
    /// Values out of range or in contradiction.
    #[error("{}", ProblemList { file, problems })]
    Values {
        /// The file.
        file: PathBuf,
        /// Every problem found.
        problems: Vec<ConfigProblem>,
    },
}

/// One value that is out of range or contradicts another.
#[derive(Debug, Clone, PartialEq)]
pub struct ConfigProblem {
    /// The key, as `section.key`.
    pub key: String,
    /// The value that was given.
    pub value: String,
    /// What is allowed, or what to do.
    pub remedy: String,
}

impl Display for ConfigProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}: {}", self.key, self.value, self.remedy)
    }
}

struct ProblemList<'a> {
    file: &'a Path,
    problems: &'a [ConfigProblem],
}

impl Display for ProblemList<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().enumerate() {
            let separator = if index == 0 { "" } else { "\n" };
            write!(f, "{separator}{}: {problem}", self.file.display())?;
        }
        Ok(())
    }
}

/// Adds line and column to a TOML error.
pub(super) fn syntax(text: &str, file: &Path, error: &toml::de::Error) -> ConfigError {
    let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or("");
    ConfigError::Syntax {
        file: file.to_path_buf(),
        line: before.matches('\n').count() + 1,
        column: before.chars().rev().take_while(|&c| c != '\n').count() + 1,
        message: abridged(error.message().trim().to_owned(), MAX_SYNTAX_LEN),
    }
}

/// Collects problems, so that all of them are reported at once.
#[derive(Default)]
pub(super) struct Checker {
    pub(super) problems: Vec<ConfigProblem>,
}

impl Checker {
    /// Adds a problem unless `holds`.
    pub(super) fn require(&mut self, holds: bool, key: &str, value: impl Display, remedy: impl Display) {
        if !holds && self.problems.len() < MAX_PROBLEMS {
            self.problems.push(ConfigProblem {
                key: key.to_owned(),
                value: abridged(value.to_string(), MAX_VALUE_LEN),
                remedy: abridged(remedy.to_string(), MAX_REMEDY_LEN),
            });
        }
    }

    /// Adds a problem unless `value` is a number in `range`; `unit` is for the message.
    pub(super) fn range<T: PartialOrd + Display>(&mut self, key: &str, value: T, range: RangeInclusive<T>, unit: &str) {
        let space = if unit.is_empty() { "" } else { " " };
        let remedy = format!("must be from {} to {}{space}{unit}", range.start(), range.end());
        self.require(range.contains(&value), key, value, remedy);
    }
}

//! Recordings of the paper's worm, and files with them.

use std::path::PathBuf;
use tempfile::TempDir;
use worm_analysis::experiment::{Simulation, simulate as run_simulation};
use worm_analysis::recording::{OpenOptions, ReadError, Recording, open, write_csv};
use worm_estimator::config::Config;

/// A temporary folder with files in it.
pub struct Folder(TempDir);

impl Default for Folder {
    fn default() -> Self {
        Self::new()
    }
}

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// Writes a file and returns its path.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, content).expect("a temporary file can be written");
        path
    }

    /// Writes a file and opens it as a recording.
    pub fn open(&self, name: &str, content: impl AsRef<[u8]>) -> Result<Recording, ReadError> {
        open(&self.write(name, content), &OpenOptions::default())
    }
}

/// The paper's worm on a slope of 20°, three cycles at 60 Hz.
pub fn crawl() -> Simulation {
    Simulation {
        slope_deg: 20.0,
        cycles: 3.0,
        rate_hz: 60.0,
        ..Simulation::default()
    }
}

pub fn simulated(simulation: &Simulation) -> Recording {
    run_simulation(&Config::default(), simulation).expect("the paper's worm crawls")
}

pub fn as_csv(recording: &Recording) -> String {
    let mut text = Vec::new();
    write_csv(recording, &mut text).expect("memory can be written");
    String::from_utf8(text).expect("CSV is text")
}

/// All words stand in the error's text.
pub fn assert_says(error: &impl std::fmt::Display, words: &[&str], of: &str) {
    let text = error.to_string();
    for word in words {
        assert!(text.contains(word), "{of}: \"{word}\" is missing in: {text}");
    }
}

/// The largest difference between two series of the same samples, which must lack the same ones.
pub fn difference(left: &[f64], right: &[f64]) -> f64 {
    assert_eq!(left.len(), right.len(), "as many samples");
    let differences = left.iter().zip(right).map(|(left, right)| {
        assert_eq!(left.is_nan(), right.is_nan(), "unseen in the same places");
        if left.is_nan() { 0.0 } else { (left - right).abs() }
    });
    differences.fold(0.0, f64::max)
}

/// Positions from each cell's first; the origin of a canal is anywhere.
pub fn from_start(series: &[f64]) -> Vec<f64> {
    series.iter().map(|position_m| position_m - series[0]).collect()
}

//! The battery's gauge: a file with a percentage, as the kernel's power supplies have one.
//!
//! A thread of its own reads it, for a gauge on a slow or broken bus may block its reader, and the estimator must not wait.

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How often it is read.
const INTERVAL: Duration = Duration::from_secs(5);
/// Longest text that is read, bytes.
const MAX_TEXT_LEN: u64 = 32;

/// The readings of a gauge. The thread ends when this is dropped.
pub(super) struct Gauge {
    readings: Receiver<f64>,
    _end: Sender<()>,
}

impl Gauge {
    /// Begins to read a file.
    ///
    /// # Errors
    /// When there is no thread to be had.
    pub(super) fn open(file: PathBuf) -> std::io::Result<Self> {
        let (sender, readings) = bounded(1);
        let (end, is_over) = bounded::<()>(0);
        std::thread::Builder::new().name("gauge".to_owned()).spawn(move || {
            let mut is_known_to_fail = false;
            loop {
                match read(&file) {
                    Ok(share) => {
                        is_known_to_fail = false;
                        // A reading that nobody has taken yet is as good.
                        let _ = sender.try_send(share);
                    }
                    Err(problem) if !std::mem::replace(&mut is_known_to_fail, true) => {
                        let file = file.display();
                        tracing::warn!("battery.gauge: {file}: {problem}: the range goes by voltage alone meanwhile");
                    }
                    Err(_) => {}
                }
                if is_over.recv_timeout(INTERVAL) != Err(RecvTimeoutError::Timeout) {
                    return;
                }
            }
        })?;
        Ok(Self { readings, _end: end })
    }

    /// A reading that was not taken yet, 0 to 1.
    pub(super) fn next(&self) -> Option<f64> {
        self.readings.try_recv().ok()
    }
}

fn read(file: &Path) -> Result<f64, String> {
    let mut text = String::new();
    let opened = File::open(file).map_err(|error| error.to_string())?;
    let read = opened.take(MAX_TEXT_LEN).read_to_string(&mut text);
    read.map_err(|error| error.to_string())?;
    let percent: Option<f64> = text.trim().parse().ok();
    let percent = percent.filter(|percent| (0.0..=100.0).contains(percent));
    Ok(percent.ok_or_else(|| format!("'{}' is no percentage", text.trim().escape_debug()))? / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_holds_a_percentage_or_is_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("capacity");
        for (text, expected) in [
            ("87\n", Ok(0.87)),
            ("0", Ok(0.0)),
            ("101\n", Err("'101' is no percentage".to_owned())),
            ("full", Err("'full' is no percentage".to_owned())),
            ("nan", Err("'nan' is no percentage".to_owned())),
        ] {
            std::fs::write(&file, text).expect("a temporary file can be written");
            assert_eq!(read(&file), expected);
        }
        assert!(read(&folder.path().join("none")).is_err());
        std::fs::write(&file, "50").expect("a temporary file can be written");
        let gauge = Gauge::open(file).expect("a thread");
        assert_eq!(gauge.readings.recv_timeout(Duration::from_secs(60)), Ok(0.5));
        assert_eq!(gauge.next(), None);
    }
}

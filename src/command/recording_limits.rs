//! The arguments for the files of a recording, the same for `wormd record` and `wormd up --record`.

use crate::recorder::FileOptions;
use clap::Args;
use std::ffi::OsString;
use std::time::Duration;
use worm_log::Index;

/// Smallest size of a file, bytes: schemas and configuration take some tens of kB of each.
const MIN_BYTES: u64 = 1_000_000;

/// Files that a quota is divided into: one is being written, and removing the oldest one loses this part of what is kept.
const FILES_IN_QUOTA: u64 = 10;

/// When a file of the recording is followed by the next, how many are kept, and whether they have an index.
#[derive(Debug, Clone, Args)]
pub struct RecordingLimits {
    /// Go on in the next file (run.1.mcap, run.2.mcap, …) when this one has that size, as 100MB or 2GB; without it, files
    /// may have any size
    #[arg(long, value_name = "SIZE", value_parser = Size::parse)]
    max_size: Option<Size>,
    /// Go on in the next file when this one is that old, as 30s, 10min, 2h or 1d
    #[arg(long, value_name = "TIME", value_parser = Age::parse)]
    max_age: Option<Age>,
    /// Keep only this many files, at least 2: the oldest of this recording is removed when a new one is begun
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    keep: Option<u32>,
    /// Keep the files of this recording together below that size, as 2GB: a new file begins at a tenth of it, and the oldest is removed
    #[arg(long, value_name = "SIZE", value_parser = Size::parse, conflicts_with_all = ["max_size", "keep"])]
    max_total: Option<Size>,
    /// Leave the index out: 30 % smaller. Foxglove and Python then read the file from the front, and some viewers not at all
    /// until `wormd export --mcap` has added it
    #[arg(long)]
    no_index: bool,
    /// Only so many ticks and estimates a second, such as 100, and all in which something changes; of everything else all. Such a log
    /// cannot be replayed to the same results
    #[arg(long, value_name = "HZ", value_parser = rate, allow_negative_numbers = true)]
    rate: Option<f64>,
}

/// Ticks a second, of those that there are.
fn rate(text: &str) -> Result<f64, String> {
    let rate_hz = text.parse().ok().filter(|rate_hz| (0.1..=1000.0).contains(rate_hz));
    rate_hz.ok_or_else(|| format!("'{text}' is no rate: give 0.1 to 1000 ticks a second"))
}

impl RecordingLimits {
    /// The same, for the recorder.
    ///
    /// # Errors
    /// When `--keep` is given without anything that begins a new file, or a quota is too small to be divided.
    pub(crate) fn file_options(&self) -> Result<FileOptions, String> {
        if self.keep.is_some() && self.max_size.is_none() && self.max_age.is_none() {
            return Err("--keep needs --max-size or --max-age: without them there is only one file".to_owned());
        }
        let mut options = FileOptions {
            max_bytes: self.max_size.as_ref().map(|size| size.bytes),
            max_age: self.max_age.as_ref().map(|age| age.time),
            keep: self.keep.map(|keep| keep as usize),
            index: if self.no_index { Index::None } else { Index::Messages },
            rate_hz: self.rate,
        };
        if let Some(total) = &self.max_total {
            let part = total.bytes / FILES_IN_QUOTA;
            if part < MIN_BYTES {
                let least = MIN_BYTES * FILES_IN_QUOTA / 1_000_000;
                return Err(format!(
                    "--max-total {} is too small: give at least {least}MB",
                    total.text
                ));
            }
            // A file becomes larger than its limit by a second of messages and its index, so one file less is kept.
            (options.max_bytes, options.keep) = (Some(part), Some(FILES_IN_QUOTA as usize - 1));
        }
        Ok(options)
    }

    /// Whether none is given.
    pub(crate) const fn is_empty(&self) -> bool {
        self.max_size.is_none()
            && self.max_age.is_none()
            && self.keep.is_none()
            && self.max_total.is_none()
            && !self.no_index
            && self.rate.is_none()
    }

    /// The same as arguments for another process.
    pub(crate) fn forward(&self) -> Vec<OsString> {
        let keep = self.keep.map(|keep| keep.to_string());
        let rate = self.rate.map(|rate| rate.to_string());
        let arguments = [
            ("--max-size", self.max_size.as_ref().map(|size| &size.text)),
            ("--max-age", self.max_age.as_ref().map(|age| &age.text)),
            ("--keep", keep.as_ref()),
            ("--rate", rate.as_ref()),
            ("--max-total", self.max_total.as_ref().map(|size| &size.text)),
        ];
        let given = arguments.into_iter().filter_map(|(flag, value)| Some([flag, value?]));
        let no_index = self.no_index.then_some("--no-index");
        given
            .flatten()
            .map(OsString::from)
            .chain(no_index.map(OsString::from))
            .collect()
    }
}

/// A size as it was given.
#[derive(Debug, Clone, PartialEq)]
struct Size {
    text: String,
    bytes: u64,
}

impl Size {
    fn parse(text: &str) -> Result<Self, String> {
        let units = [("kB", 1e3), ("MB", 1e6), ("GB", 1e9), ("TB", 1e12)];
        let bytes =
            quantity(text, &units).ok_or_else(|| format!("'{text}' is no size: give one such as 100MB or 2GB"))?;
        if !(MIN_BYTES as f64..=1e15).contains(&bytes) {
            return Err(format!("{text} is not usable: give 1MB to 1000TB"));
        }
        let text = text.to_owned();
        Ok(Self {
            text,
            bytes: bytes as u64,
        })
    }
}

/// A time span as it was given.
#[derive(Debug, Clone, PartialEq)]
struct Age {
    text: String,
    time: Duration,
}

impl Age {
    fn parse(text: &str) -> Result<Self, String> {
        let units = [("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86_400.0)];
        let seconds = quantity(text, &units)
            .ok_or_else(|| format!("'{text}' is no time: give one such as 30s, 10min, 2h or 1d"))?;
        if !(1.0..=1e8).contains(&seconds) {
            return Err(format!("{text} is not usable: give 1s to 1000d"));
        }
        let (text, time) = (text.to_owned(), Duration::from_secs_f64(seconds));
        Ok(Self { text, time })
    }
}

/// The value of a number with one of these units, by which it is multiplied.
fn quantity(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let unit_at = text.find(|character: char| character.is_ascii_alphabetic())?;
    let (number, unit) = text.split_at(unit_at);
    let (_, factor) = units.iter().find(|(name, _)| name.eq_ignore_ascii_case(unit))?;
    number.trim().parse::<f64>().ok().map(|number| number * factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quota_holds_for_all_files_together() {
        let of = |text: &str| {
            let limits = RecordingLimits {
                max_size: None,
                max_age: None,
                keep: None,
                max_total: Some(Size::parse(text).expect("a size")),
                no_index: false,
                rate: None,
            };
            limits.file_options()
        };
        let options = of("2GB").expect("enough");
        let (each, files) = (options.max_bytes.expect("a size"), options.keep.expect("a number"));
        // Each file may become a twentieth larger than its limit.
        assert!(
            each * 21 / 20 * files as u64 <= 2_000_000_000 && files >= 5,
            "{options:?}"
        );
        assert_eq!(
            of("9MB"),
            Err("--max-total 9MB is too small: give at least 10MB".to_owned())
        );
    }

    #[test]
    fn sizes_and_times_are_read_or_refused_with_an_example() {
        for (text, bytes) in [("100MB", 100_000_000), ("1.5 GB", 1_500_000_000), ("2000kb", 2_000_000)] {
            assert_eq!(Size::parse(text).map(|size| size.bytes), Ok(bytes), "{text}");
        }
        for text in [
            "", "100", "MB", "1 MiB", "-3MB", "1kB", "nanMB", "infGB", "1e30GB", "10 min",
        ] {
            let error = Size::parse(text).expect_err(text);
            assert!(error.contains("MB"), "{text}: {error}");
        }
        for (text, seconds) in [("30s", 30), ("10min", 600), ("2 h", 7_200), ("1d", 86_400)] {
            assert_eq!(Age::parse(text).map(|age| age.time.as_secs()), Ok(seconds), "{text}");
        }
        for text in ["", "10", "0s", "-1h", "1 week", "nans", "1e30d"] {
            assert!(Age::parse(text).is_err(), "{text}");
        }
    }
}

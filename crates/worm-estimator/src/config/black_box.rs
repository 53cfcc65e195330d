//! The black box: what is kept of the moments before and after each alarm and fault.

use super::check::Checker;
use serde::Deserialize;
use std::path::Path;

/// The black box.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BlackBox {
    /// Folder for boxes and the thin log, an absolute path; absent: given on the command line.
    pub folder: Option<String>,
    /// How much is kept before an alarm or fault, s.
    pub before_s: f64,
    /// How much is kept after the last one, s.
    pub after_s: f64,
    /// Longest box, s; events that follow each other share one until then.
    pub longest_s: f64,
    /// Room for all boxes and the thin log together, MB.
    pub quota_mb: f64,
    /// Most that is kept in memory, compressed, MB.
    pub memory_mb: f64,
    /// Ticks and estimates a second in the thin log, Hz.
    pub thin_rate_hz: f64,
}

impl Default for BlackBox {
    fn default() -> Self {
        Self {
            folder: None,
            before_s: 60.0,
            after_s: 20.0,
            longest_s: 600.0,
            quota_mb: 1000.0,
            memory_mb: 64.0,
            thin_rate_hz: 10.0,
        }
    }
}

impl BlackBox {
    pub(super) fn check(&self, checker: &mut Checker) {
        for (key, value, range, unit) in [
            ("black_box.before_s", self.before_s, 1.0..=600.0, "s"),
            ("black_box.after_s", self.after_s, 1.0..=600.0, "s"),
            ("black_box.longest_s", self.longest_s, 10.0..=3600.0, "s"),
            ("black_box.quota_mb", self.quota_mb, 10.0..=1e6, "MB"),
            ("black_box.memory_mb", self.memory_mb, 4.0..=4096.0, "MB"),
            ("black_box.thin_rate_hz", self.thin_rate_hz, 0.1..=100.0, "Hz"),
        ] {
            checker.range(key, value, range, unit);
        }
        let around_s = self.before_s + self.after_s;
        checker.require(
            self.longest_s >= around_s,
            "black_box.longest_s",
            self.longest_s,
            format!("must be at least before_s and after_s together, {around_s} s"),
        );
        if let Some(folder) = &self.folder {
            checker.require(
                Path::new(folder).is_absolute(),
                "black_box.folder",
                format!("{folder:?}"),
                "must be an absolute path, such as /var/lib/wormd/worm1/black-box",
            );
        }
    }
}

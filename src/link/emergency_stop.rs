//! The emergency stop's input: a switch at the tracker, or at a GPIO line of this computer.
//!
//! A source that gives no reading for a while counts as pressed: a cut wire must not keep the worm going.

use super::ExchangeOutcome;
use gpiocdev_uapi::Name;
use gpiocdev_uapi::v2::{LineConfig, LineFlags, LineRequest, LineValues, Offsets, get_line, get_line_values};
use std::fs::File;
use std::path::PathBuf;
use worm_estimator::config::{Config, EmergencyStop, EmergencyStopSource};

/// Who holds the line, for tools that list lines.
const CONSUMER: &str = "wormd-estop";

/// Why the emergency stop cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum EmergencyStopError {
    /// The chip's device file cannot be opened.
    #[error("{chip}: {source}: correct emergency_stop.chip, and add the user to the group that owns it (gpio)", chip = chip.display())]
    Chip {
        /// The chip.
        chip: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The line cannot be had.
    #[error(
        "{chip}: line {line} cannot be read: {reason}: correct emergency_stop.line; `gpioinfo` lists the lines and who uses them",
        chip = chip.display()
    )]
    Line {
        /// The chip.
        chip: PathBuf,
        /// Number of the line.
        line: u32,
        /// What the system says.
        reason: String,
    },
}

/// The input, asked once a tick.
#[derive(Debug)]
pub struct EmergencyStopInput {
    source: Source,
    timeout_ns: u64,
    /// When it was last read, or first asked.
    read_ns: Option<u64>,
}

#[derive(Debug)]
enum Source {
    /// The exchange brings it.
    Tracker,
    /// A line that was requested.
    Gpio(File),
}

impl EmergencyStopInput {
    /// The configured input, ready to be read; nothing where none is configured.
    ///
    /// # Errors
    /// [`EmergencyStopError`] for a GPIO line that cannot be had.
    pub fn open(config: &Config) -> Result<Option<Self>, EmergencyStopError> {
        let Some(configured) = &config.emergency_stop else {
            return Ok(None);
        };
        let source = match configured.source {
            EmergencyStopSource::Tracker => Source::Tracker,
            EmergencyStopSource::Gpio => Source::Gpio(request_line(configured)?),
        };
        Ok(Some(Self {
            source,
            timeout_ns: (configured.timeout_s * 1e9) as u64,
            read_ns: None,
        }))
    }

    /// Whether the worm has to stop at `now_ns`: the switch is pressed, or has not been read for the configured time. `outcome` is this
    /// tick's exchange. Takes one system call for a GPIO line, none for the tracker; allocates nothing.
    ///
    /// Pass a clock that stands still while the computer pauses, or the pause counts as silence.
    pub fn is_pressed(&mut self, now_ns: u64, outcome: &ExchangeOutcome) -> bool {
        let reading = match &self.source {
            Source::Tracker => outcome.emergency_stop,
            Source::Gpio(line) => read_line(line),
        };
        self.judge(now_ns, reading)
    }

    /// As [`is_pressed`](Self::is_pressed), without an exchange: whether a GPIO line says so. A switch at the tracker is not read.
    pub(super) fn is_pressed_at_line(&mut self, now_ns: u64) -> bool {
        let Source::Gpio(line) = &self.source else {
            return false;
        };
        let reading = read_line(line);
        self.judge(now_ns, reading)
    }

    /// Forgets when it was last read: it was not asked for a while.
    pub(crate) fn forget(&mut self) {
        self.read_ns = None;
    }

    fn judge(&mut self, now_ns: u64, reading: Option<bool>) -> bool {
        match reading {
            Some(pressed) => {
                self.read_ns = Some(now_ns);
                pressed
            }
            None => now_ns.saturating_sub(*self.read_ns.get_or_insert(now_ns)) > self.timeout_ns,
        }
    }
}

/// Requests the configured line as an input that is pulled up.
fn request_line(configured: &EmergencyStop) -> Result<File, EmergencyStopError> {
    let chip = PathBuf::from(&configured.chip);
    let line = configured.line.unwrap_or_default(); // a checked configuration names it
    let file = match File::open(&chip) {
        Ok(file) => file,
        Err(source) => return Err(EmergencyStopError::Chip { chip, source }),
    };
    let mut flags = LineFlags::INPUT | LineFlags::BIAS_PULL_UP;
    flags.set(LineFlags::ACTIVE_LOW, configured.active_low);
    let request = LineRequest {
        offsets: Offsets::from_slice(&[line]),
        consumer: Name::from(CONSUMER),
        config: LineConfig {
            flags,
            ..LineConfig::default()
        },
        num_lines: 1,
        ..LineRequest::default()
    };
    get_line(&file, request).map_err(|error| EmergencyStopError::Line {
        chip,
        line,
        reason: error.to_string(),
    })
}

/// Whether the line is active; nothing when it cannot be read.
fn read_line(line: &File) -> Option<bool> {
    let mut values = LineValues::default();
    values.set(0, false);
    get_line_values(line, &mut values).ok()?;
    values.get(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(text: &str) -> Config {
        Config::from_toml(text, std::path::Path::new("test")).expect("a configuration")
    }

    #[test]
    fn a_source_that_is_not_read_counts_as_pressed_after_a_while() {
        let config = config("[emergency_stop]\nsource = \"tracker\"\ntimeout_s = 0.1\n");
        let mut input = EmergencyStopInput::open(&config)
            .expect("it needs nothing")
            .expect("it is configured");
        let ms = 1_000_000;
        // (time in ms, reading, pressed)
        for (at_ms, reading, pressed) in [
            (1000, None, false), // it has just begun
            (1100, None, false),
            (1101, None, true),
            (1102, Some(false), false),
            (1103, Some(true), true),
            (1104, Some(false), false),
            (1204, None, false),
            (1205, None, true),
        ] {
            assert_eq!(input.judge(at_ms * ms, reading), pressed, "at {at_ms} ms");
        }
        assert!(EmergencyStopInput::open(&Config::default()).expect("nothing").is_none());
    }

    #[test]
    fn a_gpio_line_that_cannot_be_had_is_refused_with_a_remedy() {
        let open = |chip: &str| {
            let text = format!("[emergency_stop]\nsource = \"gpio\"\nchip = \"{chip}\"\nline = 17\n");
            let refused = EmergencyStopInput::open(&config(&text)).expect_err("no such line");
            refused.to_string()
        };
        let missing = open("/dev/no-such-chip");
        assert!(missing.contains("emergency_stop.chip"), "{missing}");
        let no_chip = open("/dev/null");
        assert!(no_chip.contains("line 17") && no_chip.contains("gpioinfo"), "{no_chip}");
    }
}

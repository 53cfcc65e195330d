//! What a detector finds, and the latch that turns findings into one "raised" and one "cleared".

use crate::message::{Alarm, AlarmKind, Severity};

/// Which side of its threshold the watched quantity is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ReadingState {
    /// Beyond the threshold, confirmed against noise by the detector.
    Bad,
    /// Neither beyond the threshold nor clearly off it: changes nothing.
    Between,
    /// Clearly on the good side.
    Good,
}

/// What a detector knows after an update.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum DetectorOutput {
    /// It cannot tell: not calibrated, or nothing to compare. What is raised stays raised.
    Unknown,
    /// The worm does not do what is watched, so nothing can be wrong with it. What is raised will clear.
    Idle,
    /// It watches.
    Measured(Reading),
}

/// The watched quantity and how it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reading {
    pub value: f64,
    /// In the unit of `value`.
    pub threshold: f64,
    pub verdict: ReadingState,
    /// When the condition began, if it holds, ns.
    pub since_ns: u64,
    /// The cell that is meant.
    pub cell: Option<usize>,
    pub severity: Severity,
}

impl DetectorOutput {
    pub(super) const fn watches(&self) -> bool {
        matches!(self, Self::Measured(_))
    }
}

/// How long a condition must hold before the latch follows it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Delays {
    /// How long the verdict must be bad, ns; 0 where the detector confirms by itself.
    pub raise_after_ns: u64,
    /// How long the verdict must be good, or the worm idle, ns.
    pub clear_after_ns: u64,
}

/// Raised or not, with hysteresis in time; the hysteresis in value is the detector's three-way [`ReadingState`].
#[derive(Debug, Clone)]
pub(super) struct Latch {
    kind: AlarmKind,
    delays: Delays,
    raised: Option<Reading>,
    watched_from_ns: Option<u64>, // nothing is known from before
    bad_from_ns: Option<u64>,
    over_from_ns: Option<u64>,
}

impl Latch {
    pub(super) const fn new(kind: AlarmKind, delays: Delays) -> Self {
        Self {
            kind,
            delays,
            raised: None,
            watched_from_ns: None,
            bad_from_ns: None,
            over_from_ns: None,
        }
    }

    pub(super) const fn kind(&self) -> AlarmKind {
        self.kind
    }

    pub(super) const fn is_raised(&self) -> bool {
        self.raised.is_some()
    }

    /// Follows the newest finding; the change it made, if any, still without its number.
    pub(super) fn update(&mut self, now_ns: u64, phase: f64, finding: &DetectorOutput) -> Option<Alarm> {
        let watched_from_ns = *self.watched_from_ns.get_or_insert(now_ns);
        match (self.raised, finding) {
            (None, DetectorOutput::Measured(reading)) if reading.verdict == ReadingState::Bad && is_sound(reading) => {
                let from_ns = *self.bad_from_ns.get_or_insert(now_ns);
                (now_ns.saturating_sub(from_ns) >= self.delays.raise_after_ns).then(|| {
                    let reading = Reading {
                        since_ns: reading.since_ns.min(from_ns).max(watched_from_ns),
                        ..*reading
                    };
                    self.raised = Some(reading);
                    self.over_from_ns = None;
                    self.change(now_ns, phase, &reading)
                })
            }
            (None, _) => {
                self.bad_from_ns = None;
                None
            }
            (Some(raised), finding) => {
                let over = match finding {
                    DetectorOutput::Unknown => false,
                    DetectorOutput::Idle => true,
                    DetectorOutput::Measured(reading) => reading.verdict == ReadingState::Good,
                };
                if !over {
                    self.over_from_ns = None;
                    return None;
                }
                let from_ns = *self.over_from_ns.get_or_insert(now_ns);
                if now_ns.saturating_sub(from_ns) < self.delays.clear_after_ns {
                    return None;
                }
                let last = match finding {
                    DetectorOutput::Measured(now) if is_sound(now) => Reading {
                        value: now.value,
                        threshold: now.threshold,
                        ..raised
                    },
                    _ => raised,
                };
                Some(self.clear(now_ns, phase, last))
            }
        }
    }

    /// Clears at once, for a new start; the change, if it was raised.
    pub(super) fn reset(&mut self, now_ns: u64, phase: f64) -> Option<Alarm> {
        self.bad_from_ns = None;
        self.watched_from_ns = None;
        self.raised.map(|raised| self.clear(now_ns, phase, raised))
    }

    fn clear(&mut self, now_ns: u64, phase: f64, last: Reading) -> Alarm {
        self.raised = None;
        self.bad_from_ns = None;
        self.over_from_ns = None;
        self.change(now_ns, phase, &last)
    }

    fn change(&self, now_ns: u64, phase: f64, reading: &Reading) -> Alarm {
        Alarm {
            sequence: 0,
            time_ns: now_ns,
            since_ns: reading.since_ns,
            value: reading.value,
            threshold: reading.threshold,
            phase,
            kind: self.kind.code(),
            severity: reading.severity.code(),
            raised: u32::from(self.raised.is_some()),
            cell: reading.cell.map_or(u32::MAX, |cell| cell as u32),
        }
    }
}

/// No alarm rests on a value that is not a number.
fn is_sound(reading: &Reading) -> bool {
    reading.value.is_finite() && reading.threshold.is_finite()
}

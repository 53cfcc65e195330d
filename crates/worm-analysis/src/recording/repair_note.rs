//! What was repaired in a recording, or noticed in it.

use serde::Serialize;
use std::fmt::{self, Display};

/// What was seen. The names in JSON are a contract.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RepairKind {
    /// Samples whose time does not grow: left out.
    TimeNotIncreasing,
    /// Samples that are missing from an even rate: nothing is changed.
    MissingSamples,
    /// A marker that carried the label of another: given back its own.
    SwappedLabel,
    /// A position that belongs to no cell: left out.
    StrayPosition,
    /// A marker that did not change at all, or far less than its noise: left out.
    FrozenMarker,
    /// A marker that jumped away and came back: left out in between.
    MarkerJump,
    /// A marker that changed its place on its cell for good: its shift is estimated and taken out.
    MarkerMoved,
    /// A shift of all cells at once: estimated and taken out.
    CameraKnock,
    /// Motion of all cells while the gait stands still: nothing is changed.
    CameraDrift,
    /// The clocks of gait phase and positions run apart: nothing is changed.
    ClockDrift,
}

/// One repair of a recording, or one observation of what cannot be repaired.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repair {
    /// What was seen.
    pub what: RepairKind,
    /// The run, from 1: its place in the campaign; 1 for a single recording.
    pub run: usize,
    /// The cell, from 1; none for all.
    pub cell: Option<usize>,
    /// First time concerned, s of the recording's time.
    pub from_s: f64,
    /// Last time concerned, s.
    pub to_s: f64,
    /// Samples that were left out, relabelled, shifted or missing; 0 where nothing was changed.
    pub samples: usize,
    /// The shift that was estimated, m, where there is one: the mean over the cells concerned.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift_m: Option<f64>,
    /// Its standard error, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift_sigma_m: Option<f64>,
    /// Speed of a drift: m/s of a camera, s/s of a clock.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate: Option<f64>,
}

impl Repair {
    /// Something seen over a time, in the first run; `cell` counts from 0.
    pub(crate) fn new(what: RepairKind, cell: Option<usize>, (from_s, to_s): (f64, f64), samples: usize) -> Self {
        Self {
            what,
            run: 1,
            cell: cell.map(|cell| cell + 1),
            from_s,
            to_s,
            samples,
            shift_m: None,
            shift_sigma_m: None,
            rate: None,
        }
    }

    /// The same with an estimated shift and its standard error, m.
    pub(crate) fn with_shift(self, shift_m: f64, shift_sigma_m: f64) -> Self {
        Self {
            shift_m: Some(shift_m),
            shift_sigma_m: Some(shift_sigma_m),
            ..self
        }
    }

    /// The same in a run of a campaign, from 0.
    pub(crate) fn in_run(&self, run: usize) -> Self {
        Self {
            run: run + 1,
            ..self.clone()
        }
    }

    fn place(&self) -> String {
        self.cell.map_or("all cells".to_owned(), |cell| format!("cell {cell}"))
    }

    fn shift(&self) -> String {
        let (shift_m, sigma_m) = (self.shift_m.unwrap_or(0.0), self.shift_sigma_m.unwrap_or(0.0));
        format!("{:+.2} ± {:.2} mm", shift_m * 1e3, sigma_m * 1e3)
    }
}

impl Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            from_s, to_s, samples, ..
        } = self;
        let place = self.place();
        match self.what {
            RepairKind::TimeNotIncreasing => write!(
                f,
                "{samples} samples between {from_s:.3} s and {to_s:.3} s have a time that does not grow: left out"
            ),
            RepairKind::MissingSamples => write!(
                f,
                "{samples} samples are missing between {from_s:.3} s and {to_s:.3} s: the positions are bridged there"
            ),
            RepairKind::SwappedLabel => write!(
                f,
                "{place} carried another cell's label from {from_s:.3} s to {to_s:.3} s ({samples} samples): undone by the order \
                 along the canal, one sample at each end of the swap left out"
            ),
            RepairKind::StrayPosition => write!(
                f,
                "{samples} positions labelled as {place} between {from_s:.3} s and {to_s:.3} s belong to no cell: left out"
            ),
            RepairKind::FrozenMarker => write!(
                f,
                "{place} is frozen from {from_s:.3} s to {to_s:.3} s ({samples} samples): left out"
            ),
            RepairKind::MarkerJump => write!(
                f,
                "{place} jumps away and comes back from {from_s:.3} s to {to_s:.3} s ({samples} samples): left out"
            ),
            RepairKind::MarkerMoved => write!(
                f,
                "the marker of {place} changed its place at {from_s:.3} s by {}: taken out of its later positions",
                self.shift()
            ),
            RepairKind::CameraKnock => write!(
                f,
                "all cells shift at once at {from_s:.3} s by {}, and no other cycle has the like: taken for a knock of the \
                 camera, and taken out; the distance from before to after it is uncertain by as much",
                self.shift()
            ),
            RepairKind::CameraDrift => write!(
                f,
                "while the gait stands still, from {from_s:.3} s to {to_s:.3} s, all cells move by {:+.4} mm/s: the camera \
                 drifts, or the pads creep; nothing is changed",
                self.rate.unwrap_or(0.0) * 1e3
            ),
            RepairKind::ClockDrift => write!(
                f,
                "gait phase and positions run apart by {:+.1} ms from {from_s:.3} s to {to_s:.3} s: two clocks, or a lag that \
                 grows; nothing is changed",
                self.rate.unwrap_or(0.0) * (to_s - from_s) * 1e3
            ),
        }
    }
}

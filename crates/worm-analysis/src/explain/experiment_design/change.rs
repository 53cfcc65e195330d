//! What may be changed from one run to the next, with instructions.

use super::super::answer::RunChange;
use crate::explain::worm::predict::Scene;

/// Slopes, degrees; factors on the cycle time, and the cycle times in s that motors do; extra masses, kg; ways that the start is
/// shifted by, m; factors on the number of cycles; rests after each cycle, s.
pub(in super::super) const SLOPES_DEG: [f64; 7] = [-30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0];
const CYCLE_FACTORS: [f64; 3] = [0.5, 2.0, 4.0];
const CYCLES_S: std::ops::RangeInclusive<f64> = 0.8..=20.0;
const PAYLOADS_KG: [f64; 3] = [0.05, 0.1, 0.2];
const SHIFTS_M: [f64; 2] = [0.02, 0.04];
const LENGTHS: [f64; 2] = [2.0, 3.0];
const DWELLS_S: [f64; 2] = [2.0, 5.0];
/// Slopes nearer to each other than this, degrees, and cycle times by this share, are the same.
const SAME_SLOPE_DEG: f64 = 2.5;
const SAME_CYCLE: f64 = 0.1;
/// Gait cycles of a run that is not made longer.
const CYCLES: f64 = 12.0;

/// What may be changed, cheapest first.
pub(super) const BY_COST: [RunChange; 6] = [
    RunChange::Slope,
    RunChange::Cycle,
    RunChange::Start,
    RunChange::Payload,
    RunChange::Cycles,
    RunChange::Dwell,
];

/// What a run with a change costs of a person's time, in plain runs.
pub(super) fn cost(what: RunChange) -> f64 {
    match what {
        RunChange::Slope | RunChange::Cycle | RunChange::Start => 1.0,
        RunChange::Payload => 1.2,
        RunChange::Cycles | RunChange::Dwell => 1.5,
    }
}

/// A run that may be made next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Change {
    pub what: RunChange,
    /// To which value.
    pub value: f64,
    /// The run of the campaign that is repeated with the change.
    pub base: usize,
    pub slope_deg: f64,
    pub cycle_s: f64,
    /// Known mass beyond that of the base run, kg.
    pub extra_kg: f64,
    pub shift_m: f64,
    pub cycles: f64,
    pub dwell_s: f64,
}

impl Change {
    /// Instructions.
    pub fn in_words(&self) -> String {
        let slope = format!("{}°", self.slope_deg).replace('-', "−");
        let again = format!("Repeat the run at {slope}");
        let value = self.value;
        match self.what {
            RunChange::Slope => format!(
                "Lay the canal at {slope} and let the worm crawl {} cycles.",
                self.cycles
            ),
            RunChange::Cycle => format!("{again} with a gait cycle of {value} s."),
            RunChange::Start => format!(
                "{again} with the worm laid down {:.0} mm further up the canal.",
                value * 1e3
            ),
            RunChange::Payload => format!(
                "{again} with {:.0} g of known mass on the worm, in equal shares on all cells.",
                value * 1e3
            ),
            RunChange::Cycles => format!("{again} for {value} cycles."),
            RunChange::Dwell => format!("{again} and stop the motor for {value} s after each whole cycle."),
        }
    }
}

/// Every change that the campaign does not hold yet.
pub(super) fn changes(scene: &Scene<'_>, cycle_s: f64) -> Vec<Change> {
    let slope_of = |run: usize| scene.observed[run].run.slope_deg;
    let runs = 0..scene.observed.len();
    let same_slope = |a_deg: f64, b_deg: f64| (a_deg - b_deg).abs() < SAME_SLOPE_DEG;
    let plain = |base: usize| Change {
        what: RunChange::Slope,
        value: slope_of(base),
        base,
        slope_deg: slope_of(base),
        cycle_s,
        extra_kg: 0.0,
        shift_m: 0.0,
        cycles: CYCLES,
        dwell_s: 0.0,
    };
    let mut changes = Vec::new();
    for slope_deg in SLOPES_DEG {
        if runs.clone().any(|run| same_slope(slope_of(run), slope_deg)) {
            continue;
        }
        let off_deg = |run: &usize| (slope_of(*run) - slope_deg).abs();
        let nearest = runs.clone().min_by(|a, b| off_deg(a).total_cmp(&off_deg(b)));
        changes.extend(nearest.map(|base| Change {
            value: slope_deg,
            slope_deg,
            ..plain(base)
        }));
    }
    for base in runs.clone() {
        // One run of each slope is enough to be repeated.
        if (0..base).any(|run| same_slope(slope_of(run), slope_of(base))) {
            continue;
        }
        let here = plain(base);
        let mut push = |what, value, change| changes.push(Change { what, value, ..change });
        for factor in CYCLE_FACTORS {
            let cycle_s = factor * cycle_s;
            let is_done = |run: usize| {
                let ratio = scene.observed[run].cycle_s / cycle_s;
                same_slope(slope_of(run), slope_of(base)) && (ratio - 1.0).abs() < SAME_CYCLE
            };
            if CYCLES_S.contains(&cycle_s) && !runs.clone().any(is_done) {
                push(RunChange::Cycle, cycle_s, Change { cycle_s, ..here });
            }
        }
        for shift_m in SHIFTS_M {
            push(RunChange::Start, shift_m, Change { shift_m, ..here });
        }
        for extra_kg in PAYLOADS_KG {
            let payload_kg = scene.observed[base].run.payload_kg + extra_kg;
            push(RunChange::Payload, payload_kg, Change { extra_kg, ..here });
        }
        for factor in LENGTHS {
            let cycles = factor * CYCLES;
            push(RunChange::Cycles, cycles, Change { cycles, ..here });
        }
        for dwell_s in DWELLS_S {
            push(RunChange::Dwell, dwell_s, Change { dwell_s, ..here });
        }
    }
    changes
}

//! Energy over budget: cycles cost more than they should.
//!
//! Two CUSUM charts (see [`super::cusum`]), one for the electrical energy of a cycle and one for its locomotion energy by equation (11);
//! either may raise the alarm. Only whole, undisturbed cycles count: crawling at one steady speed from end to end, with every tip's
//! deformation known. On a worm that may crawl without positions, cycles without them count in the chart of the electrical energy, from
//! the second on: in the first the tips load up. The cost of a cycle depends on speed and direction, so a new regime calibrates anew and the alarm is unarmed
//! meanwhile; a hold that resumes at the same speed keeps the calibration.

use super::cam_motion::Tick;
use super::cusum::{CusumChart, CusumLevel};
use super::latch::{DetectorOutput, Reading, ReadingState};
use crate::config::Config;
use crate::message::{Cycle, Severity};

/// Lowest baseline of the locomotion energy, as a fraction of the model's prediction: less is a bad calibration, not a good worm.
const MIN_OF_PREDICTION: f64 = 0.5;
/// A cycle whose duration differs from the steady one by more than this fraction was disturbed.
const DURATION_FRACTION: f64 = 0.1;

#[derive(Debug, Clone)]
pub(super) struct EnergyOverBudget {
    initial: CusumChart,
    electrical: CusumChart,
    locomotion: CusumChart,
    may_lack_positions: bool,
    regime: u32,
    disturbed: bool, // since the last cycle ended
    reading: Option<Reading>,
}

impl EnergyOverBudget {
    pub(super) fn new(config: &Config) -> Self {
        let initial = CusumChart::new(
            config.alarms.energy_over_budget.threshold,
            config.estimator.calibration_cycles,
        );
        Self {
            electrical: initial.clone(),
            locomotion: initial.clone(),
            initial,
            may_lack_positions: config.position_source().may_be_missing(),
            regime: 0,
            disturbed: true,
            reading: None,
        }
    }

    /// Processes every tick; `fault_free` says that nothing else is wrong, so that the cycle may count.
    pub(super) fn update(&mut self, tick: &Tick, cycle: Option<&Cycle>, fault_free: bool) -> DetectorOutput {
        if tick.regime != self.regime {
            self.regime = tick.regime;
            self.electrical = self.initial.clone();
            self.locomotion = self.initial.clone();
            self.disturbed = true;
            self.reading = None;
        }
        self.disturbed |= !tick.steady || !fault_free;
        if let Some(cycle) = cycle {
            let expected_s = 1.0 / tick.regime_cycles_per_s.abs();
            let whole = (cycle.duration_s - expected_s).abs() <= DURATION_FRACTION * expected_s;
            let lacks_positions = self.may_lack_positions && cycle.advance_m.is_nan() && cycle.index > 0;
            if !self.disturbed && whole && (cycle.settled == 1 || lacks_positions) {
                self.evaluate(cycle);
            }
            self.disturbed = false;
        }
        // A new regime has another baseline: an excess over the old one says nothing about it.
        self.reading.map_or(DetectorOutput::Idle, DetectorOutput::Measured)
    }

    fn evaluate(&mut self, cycle: &Cycle) {
        let began_ns = cycle.end_ns.saturating_sub((cycle.duration_s * 1e9) as u64);
        let electrical = self.electrical.add(
            cycle.energy_electrical_j,
            cycle.energy_electrical_sigma_j,
            0.0,
            began_ns,
        );
        let locomotion = self.locomotion.add(
            cycle.energy_loss_j,
            cycle.energy_loss_sigma_j,
            MIN_OF_PREDICTION * cycle.predicted_energy_loss_j,
            began_ns,
        );
        if !self.electrical.is_calibrated() && !self.locomotion.is_calibrated() {
            return;
        }
        let nothing = CusumLevel {
            excess: 0.0,
            reference: 0.0,
            beyond: false,
            at_zero: true,
            since_ns: began_ns,
        };
        let (electrical, locomotion) = (electrical.unwrap_or(nothing), locomotion.unwrap_or(nothing));
        let worse = if locomotion.beyond && !electrical.beyond
            || locomotion.beyond == electrical.beyond && locomotion.excess > electrical.excess
        {
            locomotion
        } else {
            electrical
        };
        let verdict = if worse.beyond {
            ReadingState::Bad
        } else if electrical.at_zero && locomotion.at_zero {
            ReadingState::Good
        } else {
            ReadingState::Between
        };
        self.reading = Some(Reading {
            value: worse.excess,
            threshold: worse.reference,
            verdict,
            since_ns: worse.since_ns,
            cell: None,
            severity: Severity::Warning,
        });
    }
}

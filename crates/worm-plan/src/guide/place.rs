//! Where the worm is on its route, from the gait cycles that were measured.

use crate::correction::{Correction, Measured};
use crate::itinerary::{Heading, Itinerary};
use worm_estimator::message::Cycle;

/// A cycle whose duration differs from the planned one by more than this fraction contains a hold, or has another speed.
const OTHER_DURATION: f64 = 0.2;
/// Standard error added to a cycle that began before the tips were known, as a fraction.
const UNSETTLED_SIGMA: f64 = 0.1;
/// Standard error of a cycle that was not measured, as a fraction.
const UNMEASURED_SIGMA: f64 = 0.2;
/// Most cycles that may be missing between two.
const MAX_MISSING: u64 = 1000;

/// A place on the route.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Distance from home, m.
    pub(super) m: f64,
    variance_m2: f64,
    /// Furthest distance so far, m.
    pub(super) furthest_m: f64,
    /// Cycles that were measured.
    pub(super) cycles: u32,
    /// Cycles that ended before are not of this trip.
    from_ns: u64,
    last: Option<(u64, i32)>,
}

/// What a cycle did.
#[derive(Debug, Clone, Copy)]
pub(super) struct Progress {
    pub(super) heading: Heading,
    /// Advance over what the model says.
    pub(super) fraction: f64,
}

impl Place {
    pub(super) const fn home(now_ns: u64) -> Self {
        Self {
            m: 0.0,
            variance_m2: 0.0,
            furthest_m: 0.0,
            cycles: 0,
            from_ns: now_ns,
            last: None,
        }
    }

    /// Standard error, m.
    pub(super) fn sigma_m(&self) -> f64 {
        self.variance_m2.sqrt()
    }

    /// Takes a cycle; returns what it did, where that is known.
    pub(super) fn add(
        &mut self,
        itinerary: &Itinerary,
        correction: &mut Correction,
        cycle: &Cycle,
    ) -> Option<Progress> {
        if cycle.end_ns <= self.from_ns || cycle.direction == 0 {
            return None;
        }
        let heading = if itinerary.out_sign() * f64::from(cycle.direction) > 0.0 {
            Heading::Out
        } else {
            Heading::Home
        };
        let leg = itinerary.leg_at(self.m, heading);
        // A worm that cannot come home has no model of it, but it may be driven there.
        let model = itinerary
            .cycle(leg, heading)
            .or_else(|| itinerary.cycle(leg, Heading::Out))?;
        let ratio = correction.of(heading).advance.mean();
        let missing = match self.last {
            Some((index, direction)) if direction == cycle.direction => {
                cycle.index.saturating_sub(index.saturating_add(1)).min(MAX_MISSING)
            }
            _ => 0,
        };
        let expected_m = heading.sign() * model.advance_m * ratio;
        self.step(
            missing as f64 * expected_m,
            missing as f64 * UNMEASURED_SIGMA * expected_m,
        );
        self.last = Some((cycle.index, cycle.direction));
        self.cycles += 1;
        let advance_m = itinerary.out_sign() * cycle.advance_m;
        if !advance_m.is_finite() {
            self.step(expected_m, UNMEASURED_SIGMA * expected_m);
            return None;
        }
        let sigma_m = if cycle.advance_sigma_m.is_finite() {
            cycle.advance_sigma_m
        } else {
            0.0
        };
        self.step(advance_m, sigma_m);
        let fraction = heading.sign() * advance_m / model.advance_m;
        let usual = (cycle.duration_s / itinerary.cycle_s(leg) - 1.0).abs() <= OTHER_DURATION;
        if usual && cycle.host_paused_s == 0.0 {
            let unsettled = if cycle.settled == 0 { UNSETTLED_SIGMA } else { 0.0 };
            let energy = cycle.energy_electrical_j / model.motor_j;
            let energy_sigma = cycle.energy_electrical_sigma_j / model.motor_j;
            let energy_sigma = if energy_sigma.is_finite() { energy_sigma } else { 0.0 };
            let measured = Measured {
                advance: Some((fraction, (sigma_m / model.advance_m).hypot(unsettled))),
                energy: (energy > 0.0 && energy.is_finite()).then_some((energy, energy_sigma.hypot(unsettled))),
            };
            correction.add(heading, leg, &measured);
        }
        Some(Progress { heading, fraction })
    }

    fn step(&mut self, by_m: f64, sigma_m: f64) {
        self.m += by_m;
        self.variance_m2 += sigma_m * sigma_m;
        self.furthest_m = self.furthest_m.max(self.m);
    }
}

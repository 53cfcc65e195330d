//! Where the worm is on its route: by what was measured of each gait cycle, or by dead reckoning where nobody saw it.
//!
//! A cycle that nobody saw goes as far as the model says on its leg, times what the model has been off by so far. That ratio's error is the
//! same in every cycle, so what it adds to the error of the place grows with the distance, out and home apart. A mark corrects the place.

use super::by_current::{ByCurrent, KnownPlace};
use crate::correction::{Advance, Correction, Measured, Ratio};
use crate::itinerary::{Heading, Itinerary};
use worm_estimator::message::Cycle;

/// A cycle whose duration differs from the planned one by more than this fraction contains a hold, or has another speed.
const OTHER_DURATION: f64 = 0.2;
/// Standard error added to a cycle that began before the tips were known, as a fraction.
const UNSETTLED_SIGMA: f64 = 0.1;
/// Standard error of a cycle of which nothing is known, as a fraction: the worm may have stood still in it.
const UNKNOWN_SIGMA: f64 = 0.2;
/// Standard errors of the difference from which on a mark is believed, and what was reckoned is not.
const FAR_SIGMAS: f64 = 4.0;
/// Most cycles that may be missing between two.
const MAX_MISSING: u64 = 1000;

/// A place on the route.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Distance from home, m.
    pub(super) m: f64,
    variance_m2: f64,
    /// Standard error that cycles have in common, m, out and home.
    drift_m: [f64; 2],
    /// Furthest distance so far, m.
    pub(super) furthest_m: f64,
    /// Cycles that were counted.
    pub(super) cycles: u32,
    /// Cycles that ended before are not of this trip.
    from_ns: u64,
    last: Option<(u64, i32)>,
    /// The leg on which the last cycle was crawled, the way, and since when.
    on: Option<(usize, Heading, u64)>,
    /// Where a cycle was last measured, and whether the last one was.
    measured_on: Option<(usize, Heading)>,
    is_seen: bool,
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
            drift_m: [0.0; 2],
            furthest_m: 0.0,
            cycles: 0,
            from_ns: now_ns,
            last: None,
            on: None,
            measured_on: None,
            is_seen: false,
        }
    }

    /// Standard error, m.
    pub(super) fn sigma_m(&self) -> f64 {
        let [out_m, home_m] = self.drift_m;
        self.variance_m2.sqrt().hypot(out_m).hypot(home_m)
    }

    /// Whether the last cycle was measured.
    pub(super) const fn is_seen(&self) -> bool {
        self.is_seen
    }

    /// Takes a cycle; returns what it did, where that is known.
    pub(super) fn add(
        &mut self,
        itinerary: &Itinerary,
        correction: &mut Correction,
        by_current: &ByCurrent,
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
        let missing = match self.last {
            Some((index, direction)) if direction == cycle.direction => {
                cycle.index.saturating_sub(index.saturating_add(1)).min(MAX_MISSING)
            }
            _ => 0,
        };
        let usual_m = correction.of(heading).advance.mean() * model.advance_m;
        self.step(
            heading.sign() * missing as f64 * usual_m,
            missing as f64 * UNKNOWN_SIGMA * usual_m,
        );
        self.last = Some((cycle.index, cycle.direction));
        self.cycles += 1;
        let since_ns = match self.on {
            Some((on, way, since_ns)) if (on, way) == (leg, heading) => since_ns,
            _ => cycle.end_ns.saturating_sub((cycle.duration_s * 1e9) as u64),
        };
        self.on = Some((leg, heading, since_ns));
        let advance_m = itinerary.out_sign() * cycle.advance_m;
        self.is_seen = advance_m.is_finite();
        // Where nobody looks, no tip is ever known; all but the first cycle are steady.
        let is_steady = cycle.settled == 1 || !self.is_seen && self.cycles > 1;
        let unsettled = if is_steady { 0.0 } else { UNSETTLED_SIGMA };
        let (advance, fraction) = if self.is_seen {
            let sigma_m = finite_or(cycle.advance_sigma_m, 0.0);
            self.step(advance_m, sigma_m);
            self.measured_on = Some((leg, heading));
            let fraction = heading.sign() * advance_m / model.advance_m;
            let sigma = (sigma_m / model.advance_m).hypot(unsettled);
            (Some(Advance::Measured(fraction, sigma)), Some(fraction))
        } else {
            // The current says how far a cycle goes that turns the cam forward, and no other.
            let inferred = by_current
                .ratio(model.advance_m, cycle.duration_s, since_ns)
                .filter(|_| cycle.direction > 0);
            let ratio = &correction.of(heading).advance;
            self.reckon(heading, ratio, model.advance_m, inferred.is_some());
            // What was measured here is better known.
            let is_better = self.measured_on != Some((leg, heading));
            let advance = inferred.map(|(ratio, sigma)| Advance::Inferred(ratio, sigma));
            (advance.filter(|_| is_better), inferred.map(|(ratio, _)| ratio))
        };
        let usual = (cycle.duration_s / itinerary.cycle_s(leg) - 1.0).abs() <= OTHER_DURATION;
        if usual && cycle.host_paused_s == 0.0 {
            let energy = cycle.energy_electrical_j / model.motor_j;
            let energy_sigma = finite_or(cycle.energy_electrical_sigma_j / model.motor_j, 0.0);
            let measured = Measured {
                advance,
                energy: (energy > 0.0 && energy.is_finite()).then_some((energy, energy_sigma.hypot(unsettled))),
            };
            correction.add(heading, leg, &measured);
        }
        fraction.map(|fraction| Progress { heading, fraction })
    }

    /// The worm ended its last cycle here, as somebody says who knows.
    pub(super) fn mark(&mut self, place: &KnownPlace) {
        let innovation_m = place.m - self.m;
        let own_m2 = self.sigma_m().powi(2);
        let known_m2 = place.sigma_m * place.sigma_m;
        let variance_m2 = own_m2 + known_m2;
        let is_far = innovation_m * innovation_m > FAR_SIGMAS * FAR_SIGMAS * variance_m2;
        let gain = if is_far || variance_m2 <= 0.0 {
            1.0
        } else {
            own_m2 / variance_m2
        };
        self.step(gain * innovation_m, 0.0);
        self.drift_m = [0.0; 2];
        self.variance_m2 = if is_far { known_m2 } else { gain * known_m2 };
    }

    /// One cycle by the model, m, times this ratio.
    fn reckon(&mut self, heading: Heading, ratio: &Ratio, model_m: f64, is_inferred: bool) {
        let scatter = if is_inferred { ratio.scatter() } else { UNKNOWN_SIGMA };
        self.step(heading.sign() * ratio.mean() * model_m, scatter * model_m);
        self.drift_m[usize::from(heading == Heading::Home)] += ratio.sigma() * model_m;
    }

    fn step(&mut self, by_m: f64, sigma_m: f64) {
        self.m += by_m;
        self.variance_m2 += sigma_m * sigma_m;
        self.furthest_m = self.furthest_m.max(self.m);
    }
}

const fn finite_or(value: f64, other: f64) -> f64 {
    if value.is_finite() { value } else { other }
}

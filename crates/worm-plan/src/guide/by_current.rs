//! What the motor's current says of the way, for the cycles that nobody saw.
//!
//! The estimator infers the advance of a forward cycle from the torque, and reckons a position along the canal by it. The trip takes the
//! advance, over the model's on the leg where its cycle was crawled, and goes on by the model of each leg with that ratio: it knows the slopes
//! ahead and on the way home, which the estimator does not. Of the position it takes where home is, so that marks, which are places along the
//! canal, are places on the route.

use crate::correction::LEG_SIGMA;
use crate::itinerary::{Heading, Itinerary};
use worm_estimator::message::{CommandRecord, Inferred};
use worm_estimator::time::seconds;

/// A known place, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct KnownPlace {
    pub(super) m: f64,
    pub(super) sigma_m: f64,
}

/// What is inferred, as far as a trip needs it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ByCurrent {
    newest: Option<Inferred>,
    /// Where home is along the canal.
    home: Option<KnownPlace>,
}

impl ByCurrent {
    pub(super) const fn note(&mut self, inferred: &Inferred) {
        self.newest = Some(*inferred);
    }

    /// The worm is `place_m` from home at this gait phase: so home is somewhere along the canal, the first time that it can be known.
    pub(super) fn note_phase(&mut self, phase: f64, place_m: f64, itinerary: &Itinerary) {
        let Some(inferred) = self.newest.as_ref().filter(|_| self.home.is_none()) else {
            return;
        };
        let at_m = inferred.position_at_m(phase);
        if at_m.is_finite() && inferred.position_sigma_m.is_finite() {
            self.home = Some(KnownPlace {
                m: at_m - itinerary.out_sign() * place_m,
                sigma_m: inferred.position_sigma_m,
            });
        }
    }

    /// The worm is at home now, and somebody says where that is.
    pub(super) fn mark_home(&mut self, record: &CommandRecord) {
        self.home = Some(KnownPlace {
            m: record.position_m,
            sigma_m: record.position_sigma_m,
        });
    }

    /// Advance over the model's, with its standard error, by a cycle that was crawled since `since_ns`: the time on a leg with this advance by the
    /// model, m. The model itself is off by as much as on any leg: the current cannot tell how a cycle goes otherwise than by the model.
    pub(super) fn ratio(&self, model_m: f64, cycle_s: f64, since_ns: u64) -> Option<(f64, f64)> {
        let inferred = self.newest.as_ref()?;
        let (advance_m, sigma_m) = inferred.known_advance_m()?;
        let is_of_leg = seconds(inferred.end_ns.saturating_sub(since_ns)) >= cycle_s;
        (is_of_leg && model_m > 0.0).then(|| (advance_m / model_m, (sigma_m / model_m).hypot(LEG_SIGMA)))
    }

    /// The place, from home, at which the worm ended its last cycle, by a mark that was given in the one under way.
    pub(super) fn place_of_mark(
        &self,
        record: &CommandRecord,
        heading: Heading,
        itinerary: &Itinerary,
        advance_m: f64,
    ) -> Option<KnownPlace> {
        let home = self.home?;
        let out_sign = itinerary.out_sign();
        // A cycle begins and ends at whole phases, from either side.
        let turned = if out_sign * heading.sign() > 0.0 {
            record.phase - record.phase.floor()
        } else {
            record.phase - record.phase.ceil()
        };
        let m = out_sign * (record.position_m - turned * advance_m - home.m);
        let sigma_m = record.position_sigma_m.hypot(home.sigma_m);
        (m.is_finite() && sigma_m.is_finite()).then_some(KnownPlace { m, sigma_m })
    }
}

//! One tip: a pad that gives, in series with a contact that grips the canal.
//!
//! The pad between cell and tip is a spring with a damper beside it, and with what may be hidden in it: a part that grows
//! stiffer, Maxwell branches, elements that yield. The tip itself has no mass and holds to the canal by the friction law that was drawn
//! for the worm ([`contact`]). Without mass the forces of pad and contact are equal at every moment; with the pad taken
//! linear over a time step, each law solves that for the tip's displacement at the end of the step.

pub mod bristle;
pub mod contact;
pub mod coulomb;
pub mod dahl;
pub mod elasto_plastic;
pub mod laws;
pub mod lugre;
pub mod weakening;

use bristle::TipLoad;
use contact::Contact;
use laws::Laws;
use weakening::FrictionState;

/// Number of elements of the yielding part of a pad.
const ELEMENTS: usize = 16;

/// The wave that a discrepancy is: rad for each metre of deformation, and without any.
const WAVE_PER_M: f64 = 2.7e3;
const WAVE_START_RAD: f64 = 0.6;

/// Parameters of a pad and its tip.
#[derive(Debug, Clone)]
pub struct Pad {
    pub stiffness_n_per_m: f64,
    pub damping_n_s_per_m: f64,
    pub hardening: f64,
    /// Forms of hardening and creep.
    pub laws: Laws,
    /// Size of a smooth wave in the pad's law, m.
    pub discrepancy_m: f64,
    pub creep_share: f64,
    pub creep_s: f64,
    pub yielding_share: f64,
    /// Deformation to which the elements that yield are spread, m.
    pub yielding_m: f64,
    pub bristle_n_per_m: f64,
    pub contact: Contact,
    /// Friction limit of a tip at rest over that of a sliding one.
    pub static_over_kinetic: f64,
}

impl Pad {
    /// Slope of the elastic force, N/m, at most.
    fn tangent_n_per_m(&self, deformation_m: f64) -> f64 {
        let (growth, slope) = self.laws.hardening.growth(deformation_m);
        self.stiffness_n_per_m * (1.0 + (1.0 + slope) * self.hardening * growth + self.creep_share)
    }
}

/// Kinetic friction limits at this time, N.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    pub forward_n: f64,
    pub backward_n: f64,
}

/// State of one tip.
#[derive(Debug, Clone)]
pub struct Tip {
    /// Where it touches the canal, m.
    pub place_m: f64,
    /// Force of the pad on the tip, forward, without its damper, N; the cell feels it backward.
    pub elastic_n: f64,
    /// The same with the damper, N.
    pub force_n: f64,
    deformation_m: f64,
    bristle_m: f64,
    crept_m: [f64; 2],
    yielded_m: [f64; ELEMENTS],
    friction_state: FrictionState,
}

impl Tip {
    /// A tip placed on the canal without load.
    pub fn laid_down(place_m: f64) -> Self {
        Self {
            place_m,
            elastic_n: 0.0,
            force_n: 0.0,
            deformation_m: 0.0,
            bristle_m: 0.0,
            crept_m: [0.0; 2],
            yielded_m: [0.0; ELEMENTS],
            friction_state: FrictionState::default(),
        }
    }

    /// One time step in which the cell goes `displacement_m`.
    pub fn follow(&mut self, displacement_m: f64, step_s: f64, pad: &Pad, limits: Limits) {
        let stiffness = pad.tangent_n_per_m(self.deformation_m);
        let damping = pad.damping_n_s_per_m / step_s;
        // What pulls the tip if it stays where it is, and what holds it.
        let pull_n = self.elastic_n + (stiffness + damping) * displacement_m;
        let sign = (pull_n - pad.bristle_n_per_m * self.bristle_m).signum();
        let limit_n = if sign > 0.0 {
            limits.forward_n
        } else {
            limits.backward_n
        };
        let static_excess = pad.contact.weakening.static_excess(&self.friction_state, sign);
        let step = pad.contact.law.solve(&TipLoad {
            pull_n: sign * pull_n,
            slack_n_per_m: stiffness + damping,
            limit_n: limit_n * (1.0 + (pad.static_over_kinetic - 1.0) * static_excess),
            bristle_n_per_m: pad.bristle_n_per_m,
            bristle_m: sign * self.bristle_m,
            step_s,
        });
        let tip_m = sign * step.displacement_m;
        let bristle_m = sign * step.bristle_m;
        let slipped_m = tip_m - (bristle_m - self.bristle_m);
        self.friction_state
            .update(&pad.contact.weakening, tip_m, slipped_m, step_s);
        self.bristle_m = bristle_m;
        self.place_m += tip_m;
        let strained_m = displacement_m - tip_m;
        self.deformation_m += strained_m;
        self.deform(step_s, pad);
        self.force_n = self.elastic_n + damping * strained_m;
    }

    /// The pad's elastic force at its new deformation.
    fn deform(&mut self, step_s: f64, pad: &Pad) {
        let (stiffness, reach_m) = (pad.stiffness_n_per_m, self.deformation_m);
        let growth = pad.hardening * pad.laws.hardening.growth(reach_m).0;
        let mut force_n = stiffness * (1.0 - pad.yielding_share + growth) * reach_m;
        if pad.discrepancy_m > 0.0 {
            force_n += stiffness * pad.discrepancy_m * (WAVE_PER_M * reach_m + WAVE_START_RAD).sin();
        }
        if pad.creep_share > 0.0 {
            let (branches, ratio) = if pad.laws.creep_ratio > 0.0 {
                (2, pad.laws.creep_ratio.sqrt())
            } else {
                (1, 1.0)
            };
            for (crept_m, time_s) in self.crept_m[..branches]
                .iter_mut()
                .zip([pad.creep_s * ratio, pad.creep_s / ratio])
            {
                *crept_m += (reach_m - *crept_m) * step_s / (time_s + step_s);
                force_n += stiffness * pad.creep_share / branches as f64 * (reach_m - *crept_m);
            }
        }
        if pad.yielding_share > 0.0 {
            let element = stiffness * pad.yielding_share / ELEMENTS as f64;
            for (place, yielded_m) in self.yielded_m.iter_mut().enumerate() {
                let max_m = pad.yielding_m * (place as f64 + 0.5) / ELEMENTS as f64;
                *yielded_m = yielded_m.clamp(reach_m - max_m, reach_m + max_m);
                force_n += element * (reach_m - *yielded_m);
            }
        }
        self.elastic_n = force_n;
    }
}

//! Displacement of the body by theory, with the small effect of inertia.
//!
//! The worm is slow, and the quasi-static [`Motion`] is right except for a few milliseconds: whenever a tip begins to slide or a step
//! ends, the mean velocity of the cells changes, and the mass cannot follow at once. It oscillates about the quasi-static path on the
//! stiffness of the contacts, z″ + 2ζω z′ + ω² z = −x″ with ω² = K/m, K the stiffness of all contacts but the sliding one. At 2.5 s a
//! cycle that is up to a tenth of a millimetre at every corner of the path, and would bias the bounds if it were ignored. Mass and
//! stiffness are known; the damping ratio ζ is fitted.

use worm_physics::{Motion, SlidesDown, Worm};

/// Largest damping ratio: the oscillation then dies out before it could be seen, and the motion is quasi-static.
const LARGEST_RATIO: f64 = 100.0;
/// Distance of the damping ratio from 1, critical damping, within which it is reduced: the closed forms would divide 0 by 0 there.
const CRITICAL: f64 = 1e-3;

/// Longest time step, s: a small part of an oscillation.
const LONGEST_STEP_S: f64 = 2.5e-3;

/// The displacement of the body by theory, streamed.
#[derive(Debug, Clone)]
pub(crate) struct TheoryBody<'a> {
    worm: &'a Worm,
    motion: Motion,
    first_phase: f64,
    swing: Swing,
    mean_m: f64,       // quasi-static mean position
    velocity_m_s: f64, // its velocity
}

/// A driven damped oscillator, below or above critical damping.
#[derive(Debug, Clone, Copy)]
struct Swing {
    decay_per_s: f64, // ζω
    turn_per_s: f64,  // ω √|1 − ζ²|
    is_overdamped: bool,
    at_m: f64,
    velocity_m_s: f64,
}

impl Swing {
    fn new(worm: &Worm, damping_ratio: f64) -> Self {
        let stiffness: f64 = worm.contacts().iter().map(|contact| contact.stiffness_n_per_m).sum();
        let sticking = stiffness * (1.0 - 1.0 / worm.cells() as f64);
        let natural_rad_s = (sticking / worm.mass_kg()).sqrt();
        let ratio = if (damping_ratio - 1.0).abs() < CRITICAL {
            1.0 - CRITICAL
        } else {
            damping_ratio.min(LARGEST_RATIO)
        };
        Self {
            decay_per_s: ratio * natural_rad_s,
            turn_per_s: natural_rad_s * (1.0 - ratio * ratio).abs().sqrt(),
            is_overdamped: ratio > 1.0,
            at_m: 0.0,
            velocity_m_s: 0.0,
        }
    }

    /// Swings freely for a while; exact.
    fn swing(&mut self, step_s: f64) {
        let turn = self.turn_per_s * step_s;
        let fade = (-self.decay_per_s * step_s).exp();
        let (sine, cosine, sign) = if self.is_overdamped {
            (turn.sinh() * fade, turn.cosh() * fade, 1.0)
        } else {
            (turn.sin() * fade, turn.cos() * fade, -1.0)
        };
        let across = (self.velocity_m_s + self.decay_per_s * self.at_m) / self.turn_per_s;
        let at_m = self.at_m * cosine + across * sine;
        let turned_m_s = (across * cosine + sign * self.at_m * sine) * self.turn_per_s;
        self.velocity_m_s = turned_m_s - self.decay_per_s * at_m;
        self.at_m = at_m;
    }
}

impl<'a> TheoryBody<'a> {
    /// A worm that rests at a phase with these deformations; its way begins at 0.
    pub fn at_rest(worm: &'a Worm, phase: f64, deformations_m: &[f64], damping_ratio: f64) -> Self {
        let places_m = vec![0.0; worm.cells()];
        let motion = Motion::under_way(worm, phase, &places_m, deformations_m);
        Self {
            worm,
            swing: Swing::new(worm, damping_ratio),
            first_phase: phase,
            mean_m: motion.mean_position_m(),
            velocity_m_s: 0.0,
            motion,
        }
    }

    /// Deformations by the quasi-static motion, m.
    pub fn deformations_m(&self) -> &[f64] {
        self.motion.deformations_m()
    }

    /// Way so far, m: the mean of the cells' positions less what the stroke alone would have made.
    pub fn displacement_m(&self) -> f64 {
        self.mean_m + self.swing.at_m - self.worm.stroke_m() * (self.motion.phase() - self.first_phase)
    }

    /// Goes on to a phase that is reached evenly after `step_s`; the way then, m.
    ///
    /// # Errors
    /// [`SlidesDown`] when the tips cannot hold the worm.
    pub fn go_to(&mut self, phase: f64, step_s: f64) -> Result<f64, SlidesDown> {
        let from = self.motion.phase();
        let parts = (step_s / LONGEST_STEP_S).ceil().max(1.0);
        for part in 1..parts as usize {
            self.step(from + (phase - from) * part as f64 / parts, step_s / parts)?;
        }
        self.step(phase, step_s / parts)?;
        Ok(self.displacement_m())
    }

    fn step(&mut self, phase: f64, step_s: f64) -> Result<(), SlidesDown> {
        self.motion.advance_to(self.worm, phase)?;
        let mean_m = self.motion.mean_position_m();
        if step_s > 0.0 {
            let velocity_m_s = (mean_m - self.mean_m) / step_s;
            self.swing.velocity_m_s -= velocity_m_s - self.velocity_m_s;
            self.swing.swing(step_s);
            self.velocity_m_s = velocity_m_s;
            self.slide_with_swing();
        }
        self.mean_m = mean_m;
        Ok(())
    }

    /// Tips that the swing takes beyond their bounds slide, and stay where they slid to. The stepping tip slides anyway.
    fn slide_with_swing(&mut self) {
        let stepping = self.motion.stepping_cell(self.worm);
        for cell in 0..self.worm.cells() {
            let contact = self.worm.contact(cell);
            let deformation_m = self.motion.deformation_m(cell) + self.swing.at_m;
            let held_m = deformation_m.clamp(-contact.backward_bound_m, contact.forward_bound_m);
            if cell != stepping && held_m != deformation_m {
                self.motion.slide_tip(self.worm, cell, deformation_m - held_m);
            }
        }
    }
}

#[cfg(test)]
mod tests;

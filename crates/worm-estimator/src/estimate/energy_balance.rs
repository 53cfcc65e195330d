//! What a fitted cycle cost: contact points by (1) to (3) along the fit, losses (11, 12) and actuator work (13).
//!
//! Between two knots every position is a straight line, so tips start to slide at exact places and no noise is taken for
//! motion: what a tip slides is the way between two contact points, each bound to the fit at one knot. That also gives the
//! derivatives of every energy by every unknown of the fit, and with them the standard errors.

use super::fit::Fit;
use super::window::INTERVALS;
use worm_physics::Ledger;
use worm_physics::MAX_CELLS;

/// Slides up to this many standard errors of the advance are not told from noise. Every peak that a fitted path has at a
/// bound would count as a slide otherwise, and always as a positive one.
const DEADBAND_SIGMAS: f64 = 1.3;
/// The same without noise, strokes: by this much a fit overshoots a corner that lies between two knots.
const MIN_DEADBAND: f64 = 2e-3;

/// What a tip is, seen in the direction of the crawl.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tip {
    pub(super) stiffness_n_per_m: f64,
    pub(super) bound_m: f64,
    /// Weight of the cell along the canal, N, positive against the crawl.
    pub(super) weight_n: f64,
}

/// A contact point and the knot to which it is bound; none when it was brought along.
#[derive(Debug, Clone, Copy)]
struct ContactPoint {
    at_m: f64, // NaN before it is known
    knot: Option<usize>,
    guessed: bool,
}

/// The account of one cycle, in the direction of the crawl.
#[derive(Debug, Clone, Copy)]
pub(super) struct EnergyBalance {
    pub(super) advance_m: f64,
    pub(super) advance_sigma_m: f64,
    pub(super) forward_slide_m: [f64; MAX_CELLS],
    pub(super) backward_slide_m: [f64; MAX_CELLS],
    pub(super) loss_j: f64,
    pub(super) loss_sigma_j: f64,
    pub(super) actuator_net_j: f64,
    pub(super) actuator_positive_j: f64,
    pub(super) actuator_sigma_j: f64,
    /// Where the tips touched at the start of this cycle and at its end; `NaN` where not known.
    pub(super) contact_at_start_m: [f64; MAX_CELLS],
    pub(super) contact_at_end_m: [f64; MAX_CELLS],
    /// Deformation of each tip at the cycle's end; `NaN` where not known.
    pub(super) deformation_at_end_m: [f64; MAX_CELLS],
    /// Every contact point was known, or guessed, from the cycle's start: the account leaves nothing out.
    pub(super) complete: bool,
    /// Every contact point was known from the cycle's start.
    pub(super) settled: bool,
}

impl EnergyBalance {
    /// Forward and backward slides of the tips as the canal sees them, for a crawl in the direction of `sign`, m.
    pub(super) fn slides_along_canal_m(&self, sign: f64) -> ([f64; MAX_CELLS], [f64; MAX_CELLS]) {
        if sign > 0.0 {
            (self.forward_slide_m, self.backward_slide_m)
        } else {
            (self.backward_slide_m, self.forward_slide_m)
        }
    }
}

/// What is known of the tips at the start of a window.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start<'a> {
    /// Contact points, m; `NaN` where not known.
    pub(super) contact_m: &'a [f64],
    /// Deformations of a worm that was laid down and stands, m.
    pub(super) resting_m: [f64; MAX_CELLS],
    /// Such a worm it was.
    pub(super) starts_at_rest: bool,
}

/// Keeps the account of the last cycle of a fit.
#[derive(Debug, Clone)]
pub(super) struct EnergyIntegrator {
    tips: Vec<Tip>,
    contact: Vec<ContactPoint>,
    loss_gradient: Vec<f64>,
    actuator_gradient: Vec<f64>,
    advance_gradient: Vec<f64>,
    sliding: Vec<Option<(f64, f64)>>, // sense of a tip that slid in the present step, and its way back since
    deadband_m: f64,                  // slides up to this are not counted
    work_by_contact_n: Vec<f64>,      // derivative of the actuator work by each contact point
}

impl EnergyIntegrator {
    pub(super) fn new(cells: usize, unknowns: usize) -> Self {
        let contact = ContactPoint {
            at_m: f64::NAN,
            knot: None,
            guessed: false,
        };
        Self {
            tips: vec![Tip::default(); cells],
            contact: vec![contact; cells],
            loss_gradient: Vec::with_capacity(unknowns),
            actuator_gradient: Vec::with_capacity(unknowns),
            advance_gradient: Vec::with_capacity(unknowns),
            sliding: vec![None; cells],
            deadband_m: 0.0,
            work_by_contact_n: vec![0.0; cells],
        }
    }

    /// Accounts for the last cycle of the fit. Where a tip's contact point is not known at its start, the tip is taken to
    /// carry its part of the weight if the worm was laid down and began to crawl; else the cycle is taken to be like any
    /// other, so that the tip begins it as it ends it.
    pub(super) fn close(&mut self, fit: &Fit, tips: &[Tip], start: &Start<'_>) -> EnergyBalance {
        if start.starts_at_rest {
            return self.close_with_guess(fit, tips, start.contact_m, &start.resting_m);
        }
        let balance = self.close_with_guess(fit, tips, start.contact_m, &[f64::NAN; MAX_CELLS]);
        if balance.complete {
            return balance;
        }
        let mut guess_m = balance.deformation_at_end_m;
        for (guess_m, resting_m) in guess_m.iter_mut().zip(start.resting_m) {
            if guess_m.is_nan() {
                *guess_m = resting_m; // it has not made a step, so nothing tells how it stands
            }
        }
        self.close_with_guess(fit, tips, start.contact_m, &guess_m)
    }

    /// The account with a guess of the deformations with which tips of unknown contact point begin, `NaN` for none. A guess
    /// holds until the end of the cell's own step, where (1) puts an end to it; its doubt goes into the standard errors.
    fn close_with_guess(&mut self, fit: &Fit, tips: &[Tip], contact_m: &[f64], guess_m: &[f64]) -> EnergyBalance {
        self.tips.copy_from_slice(tips);
        self.work_by_contact_n.fill(0.0);
        self.sliding.fill(None);
        for (cell, contact) in self.contact.iter_mut().enumerate() {
            let guessed = contact_m[cell].is_nan();
            *contact = ContactPoint {
                at_m: if guessed {
                    fit.position_m(cell, 0) - guess_m[cell]
                } else {
                    contact_m[cell]
                },
                knot: None,
                guessed,
            };
        }
        fit.clear_gradient(&mut self.loss_gradient);
        fit.clear_gradient(&mut self.actuator_gradient);
        fit.clear_gradient(&mut self.advance_gradient);
        let mut balance = EnergyBalance {
            advance_m: 0.0,
            advance_sigma_m: f64::NAN,
            forward_slide_m: [0.0; MAX_CELLS],
            backward_slide_m: [0.0; MAX_CELLS],
            loss_j: 0.0,
            loss_sigma_j: f64::NAN,
            actuator_net_j: 0.0,
            actuator_positive_j: 0.0,
            actuator_sigma_j: f64::NAN,
            contact_at_start_m: [f64::NAN; MAX_CELLS],
            contact_at_end_m: [f64::NAN; MAX_CELLS],
            deformation_at_end_m: [f64::NAN; MAX_CELLS],
            complete: false,
            settled: false,
        };
        let mut guess_j2 = 0.0;
        let (from, knots) = (fit.last_cycle_from(), fit.knots());
        self.add_weight(fit, from, knots - 1, &mut balance);
        balance.advance_sigma_m = fit.standard_error(&mut self.advance_gradient);
        self.deadband_m = (DEADBAND_SIGMAS * balance.advance_sigma_m).max(MIN_DEADBAND * fit.stroke_m());
        for piece in 0..knots - 1 {
            if piece == from {
                balance.contact_at_start_m = self.contacts();
                balance.complete = self.contact.iter().all(|contact| contact.at_m.is_finite());
                guess_j2 = self.guess_variance_j2();
            }
            let counts = piece >= from;
            if counts {
                self.add_work(fit, piece, &mut balance);
            }
            for cell in 0..self.tips.len() {
                self.slide(fit, cell, piece, counts, &mut balance);
            }
        }
        balance.contact_at_end_m = self.contacts();
        for cell in 0..self.tips.len() {
            balance.deformation_at_end_m[cell] = fit.position_m(cell, knots - 1) - balance.contact_at_end_m[cell];
        }
        balance.settled = balance.contact_at_start_m[..self.tips.len()]
            .iter()
            .all(|at| at.is_finite());
        if balance.complete {
            let overshoot_m = MIN_DEADBAND * fit.stroke_m();
            let overshoot_variance_j2: f64 = tips
                .iter()
                .map(|tip| (tip.stiffness_n_per_m * tip.bound_m * overshoot_m).powi(2))
                .sum();
            balance.loss_sigma_j = fit
                .standard_error(&mut self.loss_gradient)
                .hypot((overshoot_variance_j2 + guess_j2).sqrt());
            // A slide too small to be told leaves its contact point off by up to that, and the force all along the loading.
            let deadband_variance_j2: f64 = self
                .work_by_contact_n
                .iter()
                .map(|by_contact_n| (0.5 * self.deadband_m * by_contact_n).powi(2))
                .sum();
            balance.actuator_sigma_j = fit
                .standard_error(&mut self.actuator_gradient)
                .hypot((deadband_variance_j2 + guess_j2).sqrt());
        }
        balance
    }

    /// Variance of an energy when every deformation that is still guessed may be anything between the bounds: a tip that
    /// begins elsewhere slides by so much more or less, at the force of its bound.
    fn guess_variance_j2(&self) -> f64 {
        let guessed = self
            .tips
            .iter()
            .zip(&self.contact)
            .filter(|(_, contact)| contact.guessed);
        guessed
            .map(|(tip, _)| (tip.stiffness_n_per_m * tip.bound_m * tip.bound_m).powi(2) / 3.0)
            .sum()
    }

    /// Moves a tip to the end of a piece.
    fn slide(&mut self, fit: &Fit, cell: usize, piece: usize, counts: bool, balance: &mut EnergyBalance) {
        let (end, bound_m) = (piece + 1, self.tips[cell].bound_m);
        let at_m = fit.position_m(cell, end);
        // (1): at the end of its own step, if it was a step, the tip has slid forward.
        let own_end = fit.stepping_cell(piece) == cell && end.is_multiple_of(INTERVALS);
        let has_stepped = own_end && at_m - fit.position_m(cell, end - INTERVALS) > 2.0 * bound_m;
        if !self.contact[cell].at_m.is_nan() {
            self.follow(fit, cell, piece, counts, balance);
            self.contact[cell].guessed &= !has_stepped;
        } else if has_stepped {
            self.contact[cell] = ContactPoint {
                at_m: at_m - bound_m,
                knot: Some(end),
                guessed: false,
            };
        }
    }

    /// Moves a tip whose contact point is known, or guessed, to the end of a piece.
    fn follow(&mut self, fit: &Fit, cell: usize, piece: usize, counts: bool, balance: &mut EnergyBalance) {
        let Tip {
            stiffness_n_per_m,
            bound_m,
            ..
        } = self.tips[cell];
        let (end, at_m) = (piece + 1, fit.position_m(cell, piece + 1));
        let ContactPoint {
            at_m: was_m,
            knot: was,
            guessed,
        } = self.contact[cell];
        let deformation_m = at_m - was_m;
        let (sign, excess_m) = (deformation_m.signum(), deformation_m.abs() - bound_m);
        if piece.is_multiple_of(INTERVALS) {
            self.sliding[cell] = None;
        }
        // Once a tip slides, small ways back within the same step are peaks of the fit too: the tip stays at its bound.
        let back_m = match self.sliding[cell] {
            Some((sliding, back_m)) if sliding == sign && back_m - excess_m <= self.deadband_m => back_m,
            None if excess_m > self.deadband_m => 0.0,
            _ => return,
        };
        self.sliding[cell] = Some((sign, (back_m - excess_m).max(0.0)));
        let slide_m = sign * excess_m;
        self.contact[cell] = ContactPoint {
            at_m: was_m + slide_m,
            knot: Some(end),
            guessed,
        };
        if !counts {
            return;
        }
        let slides = if sign > 0.0 {
            &mut balance.forward_slide_m
        } else {
            &mut balance.backward_slide_m
        };
        slides[cell] += excess_m;
        let force_n = stiffness_n_per_m * sign * bound_m;
        balance.loss_j += force_n * slide_m;
        fit.add_to_gradient(&mut self.loss_gradient, cell, end, force_n);
        if let Some(knot) = was {
            fit.add_to_gradient(&mut self.loss_gradient, cell, knot, -force_n);
        }
    }

    /// Adds the actuator work of a piece, ∫ (k δ + m g sin λ) d(extension).
    fn add_work(&mut self, fit: &Fit, piece: usize, balance: &mut EnergyBalance) {
        let cell = fit.stepping_cell(piece);
        let Tip {
            stiffness_n_per_m,
            bound_m,
            weight_n,
        } = self.tips[cell];
        let contact = self.contact[cell];
        let extension_m = fit.extension_m(piece);
        let before_m = fit.position_m(cell, piece) - contact.at_m;
        if before_m.is_nan() {
            return; // the account is not complete, and will be kept once more with a guess
        }
        let shift_m = fit.position_m(cell, piece + 1) - fit.position_m(cell, piece);
        let held_m = (before_m + shift_m).clamp(-bound_m, bound_m);
        // Share of the piece in which the tip still loads; then it slides at its bound.
        let loading = if shift_m == 0.0 {
            1.0
        } else {
            ((held_m - before_m) / shift_m).clamp(0.0, 1.0)
        };
        let force_n = |deformation_m: f64| stiffness_n_per_m * deformation_m + weight_n;
        let (first, second) = (loading * extension_m, (1.0 - loading) * extension_m);
        let mut work = Ledger::default();
        work.add_actuator_work(force_n(before_m), force_n(held_m), first);
        work.add_actuator_work(force_n(held_m), force_n(held_m), second);
        balance.actuator_net_j += work.actuator_net_j;
        balance.actuator_positive_j += work.actuator_positive_j;
        let mean_force_n = force_n(0.5 * (before_m + held_m)) * loading + force_n(held_m) * (1.0 - loading);
        fit.add_extension_to_gradient(&mut self.actuator_gradient, piece, mean_force_n);
        // The mean deformation changes by `loading` with the one before, by loading²/2 with the shift.
        let by_before = stiffness_n_per_m * extension_m * loading;
        let by_shift = 0.5 * by_before * loading;
        self.work_by_contact_n[cell] += by_before;
        fit.add_to_gradient(&mut self.actuator_gradient, cell, piece, by_before - by_shift);
        fit.add_to_gradient(&mut self.actuator_gradient, cell, piece + 1, by_shift);
        if let Some(knot) = contact.knot {
            fit.add_to_gradient(&mut self.actuator_gradient, cell, knot, -by_before);
        }
    }

    /// Adds advance and work against the weight.
    fn add_weight(&mut self, fit: &Fit, from: usize, to: usize, balance: &mut EnergyBalance) {
        let fraction = 1.0 / self.tips.len() as f64;
        for (cell, tip) in self.tips.iter().enumerate() {
            let displacement_m = fit.position_m(cell, to) - fit.position_m(cell, from);
            balance.advance_m += fraction * displacement_m;
            balance.loss_j += tip.weight_n * displacement_m;
            for (knot, sign) in [(to, 1.0), (from, -1.0)] {
                fit.add_to_gradient(&mut self.advance_gradient, cell, knot, sign * fraction);
                fit.add_to_gradient(&mut self.loss_gradient, cell, knot, sign * tip.weight_n);
            }
        }
    }

    /// Contact points as they are known now, without guesses.
    fn contacts(&self) -> [f64; MAX_CELLS] {
        let mut contact_m = [f64::NAN; MAX_CELLS];
        for (to, contact) in contact_m.iter_mut().zip(&self.contact) {
            *to = if contact.guessed { f64::NAN } else { contact.at_m };
        }
        contact_m
    }
}

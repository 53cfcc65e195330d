//! Follows the tips along a worm's path: contact points, deformations, slides, energy, cycle by cycle (1 to 4, 10 to 13).
//!
//! The path is that of the fit: the displacement of the body by theory plus the drift, with the cells where the gait has them. It is free
//! of noise, so a tip slides where the worm's did and not with every peak of the noise; where theory and worm differ, the drift
//! follows the worm.

use super::analysis::{CycleResult, CycleValues, Series};
use crate::identify::gait::steps_made;
use crate::identify::theory::TheoryBody;
use crate::identify::{FittedRun, IdentifiedGait};
use crate::recording::Recording;
use worm_physics::{Ledger, SlidesDown, Worm};

/// Fewest parts of a step, so that forces are linear in each.
const PARTS: f64 = 64.0;
/// Distance from the bound, as a fraction of the bound, that counts as sliding in the series.
const SLIDING: f64 = 1e-9;

/// What the tips did on one recording.
#[derive(Debug, Clone)]
pub(super) struct EnergyBalance {
    /// Whole gait cycles.
    pub cycles: Vec<CycleResult>,
    /// The series at every sample.
    pub series: Series,
    /// Samples from the beginning of the first settled cycle to the end of the last.
    pub settled: std::ops::Range<usize>,
}

/// Totals since the recording's start.
#[derive(Debug, Clone, Default)]
struct Totals {
    forward_m: Vec<f64>,
    backward_m: Vec<f64>,
    ledger: Ledger,
}

struct Follower<'a> {
    worm: &'a Worm,
    gait: &'a IdentifiedGait,
    place_of: Vec<usize>,
    body: TheoryBody<'a>,
    origin_m: f64, // where theory's way begins
    phase: f64,
    position_m: Vec<f64>,
    contact_m: Vec<f64>,
    slid: Vec<i8>,
    totals: Totals,
}

/// Follows the tips. `damping_ratio` is that of the body on its contacts, `mass_kg` the mass whose weight the total force is to hold.
///
/// # Errors
/// [`SlidesDown`] when the worm found cannot hold itself.
pub(super) fn follow(
    recording: &Recording,
    gait: &IdentifiedGait,
    fitted: &FittedRun,
    damping_ratio: f64,
    mass_kg: f64,
) -> Result<EnergyBalance, SlidesDown> {
    let time_s = &recording.time_s;
    let worm = &fitted.worm;
    let cells = worm.cells();
    let mut follower = Follower::new(gait, fitted, damping_ratio);
    let mut series = Series {
        time_s: time_s.clone(),
        phase: gait.phase.clone(),
        measured_m: recording.position_m.clone(),
        position_m: vec![Vec::new(); cells],
        contact_m: vec![Vec::new(); cells],
        deformation_m: vec![Vec::new(); cells],
        sliding: vec![Vec::new(); cells],
        theory_m: vec![Vec::new(); cells],
        ..Series::default()
    };
    let pull_n = mass_kg * worm.gravity_m_per_s2() * worm.slope_rad().sin();
    let mut boundaries: Vec<(f64, f64, Totals, Vec<f64>)> = Vec::new(); // phase, time, totals, positions
    let samples = time_s.len();
    let sample_phase = (gait.phase[samples - 1] - gait.phase[0]) / (samples - 1) as f64;
    let first_boundary = (gait.phase[0] - 1.5 * sample_phase).ceil();
    if first_boundary <= gait.phase[0] {
        boundaries.push((
            first_boundary,
            time_s[0],
            follower.totals.clone(),
            follower.position_m.clone(),
        ));
    }
    for sample in 0..samples {
        let last = sample + 1 == samples;
        let mut target = gait.phase[sample];
        let before = sample.saturating_sub(1);
        let drift_m = (fitted.drift_m[before], fitted.drift_m[sample]);
        let from = follower.phase;
        follower.slid.fill(0);
        // A cycle that ends within a sample of the recording's end is whole.
        if last && target.ceil() - target < 1.5 * sample_phase {
            target = target.ceil();
        }
        let before_s = time_s[before];
        let mut reached_s = before_s;
        for phase in stations(from, target, cells) {
            let fraction = if target > from {
                (phase - from) / (target - from)
            } else {
                1.0
            };
            let at_s = before_s + fraction * (time_s[sample] - before_s);
            let drift_m = drift_m.0 + fraction * (drift_m.1 - drift_m.0);
            follower.go_to(phase, at_s - reached_s, drift_m)?;
            reached_s = at_s;
            if phase.fract() == 0.0 && phase > from {
                boundaries.push((phase, at_s, follower.totals.clone(), follower.position_m.clone()));
            }
        }
        follower.record(&mut series, pull_n, fitted.drift_m[sample]);
    }
    let mut cycles = Vec::new();
    let mut settled = samples..samples;
    for (index, pair) in boundaries.windows(2).enumerate() {
        let ((begin, start_s, before, from_m), (_, end_s, after, to_m)) = (&pair[0], &pair[1]);
        let is_settled = *begin >= gait.phase[0] + 1.0 - 1.5 * sample_phase;
        if is_settled && settled.start == samples {
            settled.start = time_s.partition_point(|time_s| time_s < start_s);
        }
        if is_settled {
            settled.end = time_s.partition_point(|time_s| time_s <= end_s);
        }
        let difference =
            |after: &[f64], before: &[f64]| after.iter().zip(before).map(|(a, b)| a - b).collect::<Vec<f64>>();
        let spent = after.ledger.since(&before.ledger);
        cycles.push(CycleResult {
            index,
            start_s: *start_s,
            duration_s: end_s - start_s,
            settled: is_settled,
            values: CycleValues {
                advance_m: difference(to_m, from_m).iter().sum::<f64>() / cells as f64,
                forward_slide_m: difference(&after.forward_m, &before.forward_m),
                backward_slide_m: difference(&after.backward_m, &before.backward_m),
                energy_loss_j: spent.loss_j(),
                energy_actuator_net_j: spent.actuator_net_j,
                energy_actuator_positive_j: spent.actuator_positive_j,
            },
        });
    }
    Ok(EnergyBalance {
        cycles,
        series,
        settled,
    })
}

/// The phases to stop at on the way: step boundaries and enough in between, the target last.
fn stations(from: f64, to: f64, cells: usize) -> impl Iterator<Item = f64> {
    let cells = cells as f64;
    let (first, last) = ((from * cells * PARTS).floor() + 1.0, (to * cells * PARTS).ceil());
    let between = (0..(last - first).max(0.0) as usize).map(move |at| (first + at as f64) / PARTS / cells);
    between
        .filter(move |&phase| phase > from && phase < to)
        .chain(std::iter::once(to))
}

impl<'a> Follower<'a> {
    fn new(gait: &'a IdentifiedGait, fitted: &'a FittedRun, damping_ratio: f64) -> Self {
        let worm = &fitted.worm;
        let cells = worm.cells();
        let first_phase = gait.phase[0];
        let body = TheoryBody::at_rest(worm, first_phase, &fitted.start_deformation_m, damping_ratio);
        let mut follower = Self {
            worm,
            gait,
            place_of: (0..cells)
                .map(|cell| worm.step_order().iter().position(|&other| other == cell).unwrap_or(0))
                .collect(),
            origin_m: fitted.theory_m[0] - body.displacement_m(),
            contact_m: Vec::new(),
            position_m: Vec::new(),
            slid: vec![0; cells],
            phase: first_phase,
            totals: Totals {
                forward_m: vec![0.0; cells],
                backward_m: vec![0.0; cells],
                ledger: Ledger::default(),
            },
            body,
        };
        follower.position_m = follower.cells_m(fitted.theory_m[0] + fitted.drift_m[0]);
        let deformations = follower.body.deformations_m().iter();
        follower.contact_m = follower
            .position_m
            .iter()
            .zip(deformations)
            .map(|(at, deformation)| at - deformation)
            .collect();
        follower
    }

    /// Positions of the cells for a way of the body, m.
    fn cells_m(&self, displacement_m: f64) -> Vec<f64> {
        let made = |cell: usize| steps_made(self.place_of.len(), self.place_of[cell], self.phase);
        (0..self.place_of.len())
            .map(|cell| self.gait.place_m[cell] + self.worm.stroke_m() * made(cell) + displacement_m)
            .collect()
    }

    fn deformation_m(&self, cell: usize) -> f64 {
        self.position_m[cell] - self.contact_m[cell]
    }

    /// Force that the actuator of a cell exerts (13), N.
    fn actuator_force_n(&self, cell: usize) -> f64 {
        self.worm.contact(cell).stiffness_n_per_m * self.deformation_m(cell) + self.worm.cell_weight_n(cell)
    }

    /// The cell that steps just before the present phase, or just after it.
    fn stepping_cell(&self, phase: f64) -> usize {
        let cells = self.worm.cells() as f64;
        self.worm.step_order()[(phase * cells).floor().rem_euclid(cells) as usize]
    }

    /// Moves on to a phase within the same step, in `step_s`, with the drift there.
    fn go_to(&mut self, phase: f64, step_s: f64, drift_m: f64) -> Result<(), SlidesDown> {
        let stepping = self.stepping_cell(0.5 * (self.phase + phase));
        let force_before_n = self.actuator_force_n(stepping);
        let extension_m = self.worm.stroke_m() * (phase - self.phase) * self.worm.cells() as f64;
        let displacement_m = self.origin_m + self.body.go_to(phase, step_s)? + drift_m;
        self.phase = phase;
        let position_m = self.cells_m(displacement_m);
        for (cell, at_m) in position_m.into_iter().enumerate() {
            self.totals.ledger.weight_work_j += self.worm.cell_weight_n(cell) * (at_m - self.position_m[cell]);
            self.position_m[cell] = at_m;
            self.slide(cell);
        }
        let force_after_n = self.actuator_force_n(stepping);
        self.totals
            .ledger
            .add_actuator_work(force_before_n, force_after_n, extension_m);
        Ok(())
    }

    /// (2, 3): lets the tip follow once the bound is passed.
    fn slide(&mut self, cell: usize) {
        let contact = self.worm.contact(cell);
        let deformation_m = self.deformation_m(cell);
        let held_m = deformation_m.clamp(-contact.backward_bound_m, contact.forward_bound_m);
        let slide_m = deformation_m - held_m;
        if slide_m.abs() <= SLIDING * contact.forward_bound_m {
            return;
        }
        self.contact_m[cell] += slide_m;
        self.totals.ledger.sliding_loss_j[cell] += contact.stiffness_n_per_m * held_m * slide_m;
        if slide_m > 0.0 {
            self.totals.forward_m[cell] += slide_m;
            self.slid[cell] = 1;
        } else {
            self.totals.backward_m[cell] -= slide_m;
            self.slid[cell] = -1;
        }
    }

    /// Writes this moment into the series.
    fn record(&self, series: &mut Series, pull_n: f64, drift_m: f64) {
        let stepping = self.stepping_cell(self.phase);
        let mut force_n = pull_n;
        for cell in 0..self.worm.cells() {
            force_n += self.worm.contact(cell).stiffness_n_per_m * self.deformation_m(cell);
            series.position_m[cell].push(self.position_m[cell]);
            series.contact_m[cell].push(self.contact_m[cell]);
            series.deformation_m[cell].push(self.deformation_m(cell));
            series.sliding[cell].push(self.slid[cell]);
            series.theory_m[cell].push(self.position_m[cell] - drift_m);
        }
        let steps = self.phase * self.worm.cells() as f64;
        series.stepping_cell.push(stepping);
        series.total_force_n.push(force_n);
        series.extension_m.push(self.worm.stroke_m() * (steps - steps.floor()));
        series.actuator_force_n.push(self.actuator_force_n(stepping));
        series.energy_loss_j.push(self.totals.ledger.loss_j());
        series.energy_actuator_net_j.push(self.totals.ledger.actuator_net_j);
    }
}

#[cfg(test)]
mod tests;

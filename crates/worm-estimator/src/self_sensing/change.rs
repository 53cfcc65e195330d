//! Alarms from the current alone: a cycle whose profile is not like the others'.
//!
//! Every cycle is compared with the mean of those before: by how much would friction of single cells, the pull and the friction of the
//! gears have to differ? One cycle may be an accident (a lost reading, a bump), so two in a row count. Then the fit begins anew, because
//! the worm is another now. What it finds is compared with the worm before. The alarms stand until two cycles in a row have the profile of
//! before, or until the fit differs no more. Where no alarm has a name for the change (less load, or what looks like it), the worm before is
//! remembered for a while all the same: its return is no change of the other one.

use super::fit::CycleChange;
use super::parameters::{Parameters, Vector};
use super::profile::BINS_PER_STEP;
use std::f64::consts::TAU;
use worm_physics::{MAX_CELLS, Worm};

/// Cycles that must be known before a cycle can differ from them.
const KNOWN_CYCLES: f64 = 3.0;
/// Cycles in a row that must differ.
const IN_A_ROW: u32 = 2;
/// Cycles for which the worm before is remembered where a change raises no alarm; then the changed one is the usual one.
const REMEMBERED: u32 = 20;
/// Change of ln friction that counts: a loss of 16 %.
const FRICTION_CHANGE: f64 = 0.175;
/// Change of the torque of a whole cycle that counts, as pull on the body, N …
const PULL_CHANGE_N: f64 = 0.3;
/// … or in the gears, as a share of their friction.
const GEAR_CHANGE: f64 = 0.15;
/// Share of a change that the profile must show directly: one step from the fit shows less than there is.
const SHOWN_SHARE: f64 = 0.5;
/// Share of a loss of friction by which the torque late in that cell's step must fall, whatever the fit makes of the profile: of 828 losses on
/// drawn worms the least was 0.6.
const LATE_SHARE: f64 = 0.4;
/// Standard errors by which a change must be known.
const SIGMAS: f64 = 3.5;
/// Gait-to-gait scatter of ln friction, and of the pull, N, beyond the noise of one cycle.
const SCATTER: f64 = 0.025;
const PULL_SCATTER_N: f64 = 0.04;
/// Share of the usual torque late in a step below which its cell does not move. Ripple leaves some of it; a cell that has lost
/// most of its friction leaves more.
const JAMMED_SHARE: f64 = 0.12;
/// Share of the usual torque late in a step below which all cells together have lost friction, whatever the fit makes of it: a pull downhill that does
/// this to every cell is hardly to be met, and neither are several jams at once.
const SLIPPING_SHARE: f64 = 0.6;
/// Least standard error of the share that is lost then: what the gears take of so small a torque is not known better.
const SLIPPING_SIGMA: f64 = 0.05;
/// What the fit of one or two cycles leaves unknown of a rise of the load, as a share of it.
const RISE_SCATTER: f64 = 0.15;
/// Standard deviation that is allowed for a change of ln friction, of the pull, N, and of the gears' friction, N m.
const ALLOWED: [f64; 3] = [0.5, 0.7, 0.02];

/// What differs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Changes {
    /// Bit i: friction of cell i is lost.
    pub friction_lost: u16,
    /// Friction of every cell is lost.
    pub all_friction_lost: bool,
    /// Bit i: cell i does not move.
    pub jammed: u16,
    /// The load is larger than usual: a pull on the body or friction of the gears. The current alone hardly says which.
    pub more_load: bool,
    /// Largest share of a cell's friction that is lost.
    pub loss_share: f64,
    /// Standard error of `loss_share`.
    pub loss_sigma: f64,
    /// By how much the load is larger, as a pull on the body, N.
    pub load_rise_n: f64,
    /// Standard error of `load_rise_n`, N.
    pub load_rise_sigma_n: f64,
    /// Torque late in the step of the cell that moves least, as a share of the usual.
    pub reach_share: f64,
}

impl Changes {
    /// Whether anything differs.
    pub fn any(&self) -> bool {
        self.friction_lost != 0 || self.jammed != 0 || self.more_load
    }
}

/// Which changes could be seen now.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Armed {
    /// Bit i: a loss of 30 % of cell i's friction.
    pub friction: u16,
    /// Bit i: cell i jammed.
    pub jammed: u16,
    /// More load.
    pub load: bool,
    /// Standard error of one cycle's ln friction, the worst cell's.
    pub friction_sigma: f64,
    /// Standard error of one cycle's pull, N.
    pub pull_sigma_n: f64,
}

/// The comparison, cycle by cycle.
#[derive(Debug, Clone)]
pub(super) struct ChangeDetector {
    cells: usize,
    step_order: [usize; MAX_CELLS],
    gear_friction_n_m: f64,
    pull_per_torque: f64, // 1/m: a pull on the body that raises the mean torque as much as friction in the gears
    in_a_row: u32,
    as_before_in_a_row: u32,
    without_alarm: u32, // cycles of the changed worm
    reference: Option<Reference>,
    changes: Changes,
    armed: Armed,
}

/// A fitted worm, and the pull that follows from the slope where it was measured, N.
pub(super) type WormNow<'a> = (&'a Parameters, Option<f64>);

/// The worm before it changed.
#[derive(Debug, Clone, Copy)]
struct Reference {
    ln_friction: [f64; MAX_CELLS],
    reach_n_m: [f64; MAX_CELLS],
    pull_n: f64,
    weight_n: Option<f64>, // along the canal, where the pitch was measured: its part of the pull
    gear_n_m: f64,
}

/// A cycle beside those before.
pub(super) struct ComparedCycle<'a> {
    /// The worm and the gears before.
    pub(super) usual: &'a Parameters,
    /// The pull that follows from the slope where it was measured, N.
    pub(super) weight_n: Option<f64>,
    /// How many cycles that was.
    pub(super) cycles: f64,
    /// By how much the unknowns differ in this cycle.
    pub(super) change: CycleChange,
    /// Torque profile of this cycle.
    pub(super) torque_n_m: &'a [f64],
    /// Mean profile of those before.
    pub(super) mean_n_m: &'a [f64],
}

/// What a cycle is, for the detector.
pub(super) enum Seen {
    /// Like the others.
    Usual,
    /// Not like them; it may be an accident.
    Odd,
    /// Like the odd one before it: the worm has changed …
    FirstChanged,
    /// … and now again, while it is another than it was.
    Changed,
    /// Like the one before it, and like those before the worm changed.
    AsBefore,
}

impl ChangeDetector {
    /// `gear_friction_n_m` is the usual friction of the gears without load.
    pub(super) fn new(worm: &Worm, gear_friction_n_m: f64) -> Self {
        let cells = worm.cells();
        let mut step_order = [0; MAX_CELLS];
        step_order[..cells].copy_from_slice(worm.step_order());
        Self {
            cells,
            step_order,
            gear_friction_n_m,
            pull_per_torque: TAU / worm.stroke_m(),
            in_a_row: 0,
            as_before_in_a_row: 0,
            without_alarm: 0,
            reference: None,
            changes: Changes::default(),
            armed: Armed::default(),
        }
    }

    /// By how much each unknown may differ.
    pub(super) fn allowed(&self) -> Vector {
        let mut allowed = Vector::zeros();
        for cell in 0..self.cells {
            allowed[cell] = ALLOWED[0];
        }
        allowed[2 * self.cells] = ALLOWED[1];
        allowed[2 * self.cells + 1] = ALLOWED[2];
        allowed
    }

    pub(super) fn changes(&self) -> &Changes {
        &self.changes
    }

    pub(super) fn armed(&self) -> &Armed {
        &self.armed
    }

    /// Compares a cycle with those before.
    pub(super) fn compare(&mut self, cycle: &ComparedCycle) -> Seen {
        let ComparedCycle {
            usual,
            weight_n,
            cycles,
            change: CycleChange { by: change, sigma, .. },
            torque_n_m,
            mean_n_m,
        } = cycle;
        self.as_before_in_a_row = 0;
        let gear_friction_n_m = self.gear_friction_n_m;
        let step_order = self.step_order;
        let step_order = &step_order[..self.cells];
        self.remember();
        // While an alarm stands, one cycle of the changed worm is enough to see that it is over; that one scatters as well.
        let is_enough = *cycles >= KNOWN_CYCLES || self.changes.any();
        let widened = if *cycles < KNOWN_CYCLES { 2f64.sqrt() } else { 1.0 };
        let sigma_of = |index: usize, scatter: f64| widened * (sigma[index].powi(2) + scatter * scatter).sqrt();
        let (pull_at, gear_at) = (2 * self.cells, 2 * self.cells + 1);
        self.armed = Armed {
            pull_sigma_n: sigma_of(pull_at, PULL_SCATTER_N),
            ..Armed::default()
        };
        if !is_enough {
            return Seen::Usual;
        }
        let before = Reference::of((usual, *weight_n), mean_n_m, usual.values[usual.gears_at()], step_order);
        let mut odd = false;
        for (place, &cell) in step_order.iter().enumerate() {
            let sigma = sigma_of(cell, SCATTER);
            self.armed.friction_sigma = self.armed.friction_sigma.max(sigma);
            self.armed.friction |= u16::from(SIGMAS * sigma < 0.35) << cell;
            odd |= change[cell].abs() > FRICTION_CHANGE.max(SIGMAS * sigma);
            let share = reach_n_m(torque_n_m, place, before.gear_n_m) / before.reach_n_m[cell];
            odd |= !(JAMMED_SHARE..1.0 / JAMMED_SHARE).contains(&share);
            self.armed.jammed |= 1 << cell;
        }
        let gear_sigma = sigma_of(gear_at, 0.02 * gear_friction_n_m);
        odd |= change[pull_at].abs() > PULL_CHANGE_N.max(SIGMAS * self.armed.pull_sigma_n);
        odd |= change[gear_at].abs() > (GEAR_CHANGE * gear_friction_n_m).max(SIGMAS * gear_sigma);
        self.armed.load = SIGMAS * self.armed.pull_sigma_n < 1.0;
        if !odd {
            self.in_a_row = 0;
            return Seen::Usual;
        }
        self.in_a_row += 1;
        if self.in_a_row < IN_A_ROW {
            return Seen::Odd;
        }
        self.in_a_row = 0;
        if self.reference.is_some() {
            return Seen::Changed;
        }
        self.reference = Some(before);
        self.without_alarm = 0;
        Seen::FirstChanged
    }

    /// Counts the cycles for which the worm before is remembered.
    fn remember(&mut self) {
        self.without_alarm = if self.changes.any() { 0 } else { self.without_alarm + 1 };
        if self.without_alarm > REMEMBERED {
            self.reference = None;
        }
    }

    /// Whether the worm differs from one before it.
    pub(super) fn is_another(&self) -> bool {
        self.reference.is_some()
    }

    /// While the worm is another: takes a cycle that is like those before it changed. After another such cycle the change is over.
    pub(super) fn see_one_as_before(&mut self) -> Seen {
        self.in_a_row = 0;
        self.as_before_in_a_row += 1;
        if self.as_before_in_a_row < IN_A_ROW {
            return Seen::Odd;
        }
        self.as_before_in_a_row = 0;
        self.reference = None;
        self.changes = Changes::default();
        Seen::AsBefore
    }

    /// Says in what a changed worm differs from the one before, once it is fitted anew.
    ///
    /// `difference` is what the cycle's profile says directly, by one step from the fit. Where a profile has two answers, the fits before and
    /// after may be at different ones, and differ although the profiles do not.
    pub(super) fn judge(&mut self, changed: WormNow<'_>, torque_n_m: &[f64], difference: Option<&CycleChange>) {
        if let Some(changes) = self.changes_of(changed, torque_n_m, difference) {
            self.changes = changes;
        }
    }

    /// The same of a later cycle, where the first could not say it: a loss of friction that began in the middle of that one hardly shows there,
    /// if the cycle before it was odd for another reason. A load would show in the first one.
    pub(super) fn judge_late(&mut self, changed: WormNow<'_>, torque_n_m: &[f64], difference: Option<&CycleChange>) {
        let changes = self.changes_of(changed, torque_n_m, difference);
        if let Some(changes) = changes.filter(|changes| changes.friction_lost != 0) {
            self.changes = changes;
        }
    }

    /// The same by a first answer, which only counts where it shows a change. True when it does.
    pub(super) fn judge_early(
        &mut self,
        changed: WormNow<'_>,
        torque_n_m: &[f64],
        difference: Option<&CycleChange>,
    ) -> bool {
        let changes = self.changes_of(changed, torque_n_m, difference).filter(Changes::any);
        if let Some(changes) = changes {
            self.changes = changes;
        }
        changes.is_some()
    }

    fn changes_of(
        &self,
        changed: WormNow<'_>,
        torque_n_m: &[f64],
        difference: Option<&CycleChange>,
    ) -> Option<Changes> {
        let reference = self.reference?;
        let now = Reference::of(changed, torque_n_m, reference.gear_n_m, &self.step_order[..self.cells]);
        let mut changes = reference.compare(&now, self.cells, self.gear_friction_n_m, self.pull_per_torque);
        if let Some(difference) = difference {
            let is_shown = |cell: &usize| {
                difference.by[*cell] <= -SHOWN_SHARE * FRICTION_CHANGE
                    && 1.0 - reference.reach_share(&now, *cell) >= LATE_SHARE * reference.lost_share(&now, *cell)
            };
            if !reference.all_slip(&now, self.cells) {
                for cell in (0..self.cells).filter(|cell| !is_shown(cell)) {
                    changes.friction_lost &= !(1 << cell);
                }
            }
            changes.all_friction_lost &= changes.friction_lost.count_ones() as usize == self.cells;
            let (pull_at, gear_at) = (2 * self.cells, 2 * self.cells + 1);
            let pulled_n = difference.by[pull_at] - reference.steeper_by_n(&now);
            changes.more_load &= pulled_n > SHOWN_SHARE * PULL_CHANGE_N
                || difference.by[gear_at] > SHOWN_SHARE * GEAR_CHANGE * self.gear_friction_n_m;
            let cell = reference.cell_that_lost_most(&now, self.cells);
            let by_scatter = (1.0 - changes.loss_share) * difference.sigma[cell].hypot(SCATTER);
            changes.loss_sigma = if reference.all_slip(&now, self.cells) {
                by_scatter.max(SLIPPING_SIGMA)
            } else {
                by_scatter
            };
            let left_n = RISE_SCATTER * changes.load_rise_n;
            changes.load_rise_sigma_n = difference.load_sigma_n.hypot(PULL_SCATTER_N).hypot(left_n);
        }
        Some(changes)
    }
}

impl Reference {
    fn of((parameters, weight_n): WormNow<'_>, mean_n_m: &[f64], idle_n_m: f64, step_order: &[usize]) -> Self {
        let mut reference = Self {
            ln_friction: [0.0; MAX_CELLS],
            reach_n_m: [0.0; MAX_CELLS],
            pull_n: parameters.pull_n(),
            weight_n,
            gear_n_m: parameters.values[parameters.gears_at()],
        };
        for (place, &cell) in step_order.iter().enumerate() {
            reference.ln_friction[cell] = parameters.friction_n(cell).ln();
            reference.reach_n_m[cell] = reach_n_m(mean_n_m, place, idle_n_m);
        }
        reference
    }

    /// How much more the weight pulls along the canal now, N; 0 where the pitch was not measured both times.
    fn steeper_by_n(&self, now: &Self) -> f64 {
        self.weight_n
            .zip(now.weight_n)
            .map_or(0.0, |(before_n, now_n)| now_n - before_n)
    }

    /// Torque late in a cell's step, as a share of what it was.
    fn reach_share(&self, now: &Self, cell: usize) -> f64 {
        now.reach_n_m[cell] / self.reach_n_m[cell]
    }

    /// Share of a cell's friction that is lost, by the fit.
    fn lost_share(&self, now: &Self, cell: usize) -> f64 {
        1.0 - (now.ln_friction[cell] - self.ln_friction[cell]).exp()
    }

    /// Whether every cell steps with much less torque than before.
    fn all_slip(&self, now: &Self, cells: usize) -> bool {
        (0..cells).all(|cell| now.reach_n_m[cell] < SLIPPING_SHARE * self.reach_n_m[cell])
    }

    fn cell_that_lost_most(&self, now: &Self, cells: usize) -> usize {
        let kept = |cell: &usize| now.ln_friction[*cell] - self.ln_friction[*cell];
        (0..cells).min_by(|a, b| kept(a).total_cmp(&kept(b))).unwrap_or(0)
    }

    fn compare(&self, now: &Self, cells: usize, gear_friction_n_m: f64, pull_per_torque: f64) -> Changes {
        // A steeper canal is no load.
        let pulled_n = now.pull_n - self.pull_n - self.steeper_by_n(now);
        let mut changes = Changes {
            reach_share: f64::INFINITY,
            load_rise_n: pulled_n + (now.gear_n_m - self.gear_n_m) * pull_per_torque,
            loss_sigma: f64::NAN,
            load_rise_sigma_n: f64::NAN,
            ..Changes::default()
        };
        for cell in 0..cells {
            changes.reach_share = changes.reach_share.min(self.reach_share(now, cell));
            changes.loss_share = changes.loss_share.max(self.lost_share(now, cell));
            if now.reach_n_m[cell] < JAMMED_SHARE * self.reach_n_m[cell] {
                changes.jammed |= 1 << cell;
            } else if now.ln_friction[cell] - self.ln_friction[cell] < -FRICTION_CHANGE {
                changes.friction_lost |= 1 << cell;
            }
        }
        if self.all_slip(now, cells) {
            changes.jammed = 0;
            changes.friction_lost = ((1_u32 << cells) - 1) as u16;
            let lost_share = |cell: usize| 1.0 - self.reach_share(now, cell);
            changes.loss_share = (0..cells).map(lost_share).fold(changes.loss_share, f64::max).min(1.0);
        }
        if changes.jammed != 0 {
            // The others push a jammed cell along, so their frictions look different, too.
            changes.friction_lost = 0;
        }
        changes.all_friction_lost = changes.friction_lost.count_ones() as usize == cells;
        changes.more_load = changes.jammed == 0
            && changes.friction_lost == 0
            && (pulled_n > PULL_CHANGE_N || now.gear_n_m - self.gear_n_m > GEAR_CHANGE * gear_friction_n_m);
        changes
    }
}

/// Torque late in a step, N m, beyond `idle_n_m`, what turning the cam takes while no cell moves.
fn reach_n_m(torque_n_m: &[f64], place: usize, idle_n_m: f64) -> f64 {
    let end = (place + 1) * BINS_PER_STEP - 1;
    let late = &torque_n_m[end - 8..end];
    late.iter().sum::<f64>() / late.len() as f64 - idle_n_m
}

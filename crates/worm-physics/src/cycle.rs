//! One cycle of the periodic crawl, and closed forms to compare it with.

#[cfg(test)]
mod tests;

use super::ledger::Ledger;
use super::locomotion::Locomotion;
use super::physics::Physics;
use super::worm::{SlidesDown, Worm};
use crate::MAX_CELLS;

/// Change of any deformation over a cycle, as a fraction of the stroke, below which the crawl counts as periodic.
const PERIODIC_FRACTION: f64 = 1e-12;
/// Cycles after which the search for the periodic crawl ends.
const MAX_CYCLES: u32 = 10_000;
/// As [`PERIODIC_FRACTION`], for the incremental motion, whose increments do not end where the events are.
const NEARLY_PERIODIC_FRACTION: f64 = 1e-7;
/// As [`MAX_CYCLES`], for the incremental motion.
const MAX_INCREMENTAL_CYCLES: u32 = 1000;
/// Cycles from rest before the one that is reported for a crawl that never becomes periodic: as many as a recording has.
pub const CYCLES_BEFORE: u32 = 10;
/// Periods of a canal that repeats over which a mean is taken at least, and cycles at most.
const PERIODS: f64 = 3.0;
const MOST_MEAN_CYCLES: u32 = 100;
/// Advance, as a fraction of the stroke, up to which the worm counts as standing still: well above rounding.
const STANDSTILL_FRACTION: f64 = 1e-9;

/// What becomes of a worm that keeps stepping.
#[derive(Debug, Clone, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "nearly every outcome is a cycle, so a box would save no memory"
)]
pub enum Outcome {
    /// It settles into a periodic motion, with or without progress.
    Steady(Cycle),
    /// Its tips cannot hold it even at rest.
    SlidesDown(SlidesDown),
}

impl Outcome {
    /// The steady cycle, if there is one.
    pub fn cycle(&self) -> Option<&Cycle> {
        match self {
            Self::Steady(cycle) => Some(cycle),
            Self::SlidesDown(_) => None,
        }
    }

    /// Whether the worm advances.
    pub fn progresses(&self) -> bool {
        self.cycle().is_some_and(|cycle| cycle.progresses)
    }
}

/// One gait cycle of the steady crawl.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    /// Advance L: mean over the cells of the net displacement, m. Negative when the worm slips back by more than it steps.
    pub advance_m: f64,
    /// Whether the advance is more than rounding.
    pub progresses: bool,
    /// Distance each tip slid forward, m.
    pub forward_slide_m: [f64; MAX_CELLS],
    /// Distance each tip slid backward, m, counted positive.
    pub backward_slide_m: [f64; MAX_CELLS],
    /// Sliding losses and work against weight and resisting forces (11), J.
    pub energy_loss_j: f64,
    /// Net actuator work (13), J; equal to `energy_loss_j` in a periodic cycle, except for the heat of pads that creep or yield and of
    /// sudden slides.
    pub energy_actuator_net_j: f64,
    /// Positive part of the actuator work, the energy of the paper's Table 1, J.
    pub energy_actuator_positive_j: f64,
    /// Cost of transport, positive work over m g L; none without progress or weight.
    pub cot: Option<f64>,
    /// Positive work over the advance, J/m; none without progress.
    pub energy_per_distance_j_per_m: Option<f64>,
    /// Mean over the cycle of Σ δᵢ (8), m.
    pub mean_deformation_m: f64,
    /// Cycles from rest to the periodic crawl.
    pub cycles_to_steady: u32,
    /// Largest change of a deformation over this cycle, m: how well it closes. A crawl that never becomes periodic closes badly.
    pub closure_m: f64,
}

impl Cycle {
    /// Whether the worm ends the cycle further back than it began, by more than rounding.
    pub fn slips_back(&self, worm: &Worm) -> bool {
        self.advance_m < -STANDSTILL_FRACTION * worm.stroke_m()
    }

    fn new(worm: &Worm, advance_m: f64, ledger: &Ledger, cycles_to_steady: u32, closure_m: f64) -> Self {
        let progresses = advance_m > STANDSTILL_FRACTION * worm.stroke_m();
        let positive_j = ledger.actuator_positive_j;
        let energy_per_distance_j_per_m = progresses.then(|| positive_j / advance_m);
        let weight_n = worm.weight_n();
        Self {
            advance_m,
            progresses,
            forward_slide_m: ledger.forward_slide_m,
            backward_slide_m: ledger.backward_slide_m,
            energy_loss_j: ledger.loss_j(),
            energy_actuator_net_j: ledger.actuator_net_j,
            energy_actuator_positive_j: positive_j,
            cot: energy_per_distance_j_per_m
                .filter(|_| weight_n > 0.0)
                .map(|energy| energy / weight_n),
            energy_per_distance_j_per_m,
            mean_deformation_m: ledger.deformation_integral_m,
            cycles_to_steady,
            closure_m,
        }
    }
}

/// Crawls forward from rest until no deformation changes over a cycle by more than 10⁻¹² strokes, and reports that cycle.
///
/// The deformations of two worms under the same gait never grow apart in the norm of their elastic energy, so the crawl
/// always tends to a periodic one; if 10 000 cycles are not enough, the last is returned and its `closure_m` says how far off it
/// is. For the crawl in reverse use [`Worm::mirrored`].
///
/// A worm that cannot hold only while a cell steps still has a steady cycle, with a negative advance. The transition can be a
/// jump: once the pull exceeds what the others hold against a sliding cell, the stepping cell no longer
/// slides forward at all and every step pushes the others back instead. The paper's worm with 3 cells advances by 1.0 mm
/// just below 44.43° and loses 12.5 mm just above.
pub fn steady_cycle(worm: &Worm) -> Outcome {
    // The exact motion has no clock, so the time of a cycle does not matter.
    steady_cycle_of(&Physics::of(worm.clone()), 1.0)
}

/// As [`steady_cycle`], under any physics, with gait cycles of `cycle_s`. Both are the same where the exact motion applies; otherwise
/// the crawl goes on until no deformation changes over a cycle by more than 10⁻⁷ strokes, or for 1000 cycles.
///
/// Wear, a tether and a patch in the canal leave no periodic crawl: their figures are those of the cycle that follows
/// [`CYCLES_BEFORE`] cycles from rest, of a worm whose cells all begin at position 0. Where a table repeats along the canal, one cycle says
/// where in the canal it was made, so the figures are the mean of those after these, over whole periods as nearly as whole cycles allow; of
/// a worm that does not come through a period in a hundred cycles they are those of the one cycle. For the crawl in reverse use
/// [`Physics::mirrored`].
///
/// A worm that begins to slide down in one of these cycles does so in the [`Outcome`].
pub fn steady_cycle_of(physics: &Physics, cycle_s: f64) -> Outcome {
    crawl_until_periodic(physics, cycle_s).map_or_else(Outcome::SlidesDown, |(cycle, _)| Outcome::Steady(cycle))
}

/// The steady cycle, and the motion at its end.
pub(super) fn crawl_until_periodic(physics: &Physics, cycle_s: f64) -> Result<(Cycle, Locomotion), SlidesDown> {
    let worm = &physics.worm;
    let mut motion = Locomotion::at_rest(physics, &[0.0; MAX_CELLS][..worm.cells()])?;
    let (fraction, max_cycles) = match (motion.is_exact(), physics.is_periodic()) {
        (true, _) => (PERIODIC_FRACTION, MAX_CYCLES),
        (false, true) => (NEARLY_PERIODIC_FRACTION, MAX_INCREMENTAL_CYCLES),
        (false, false) => (0.0, CYCLES_BEFORE),
    };
    let mut cycles = 0;
    loop {
        if cycles == max_cycles
            && let Some(period_m) = physics.period_along_canal_m()
            && let Some((mean, motion)) = mean_cycle(worm, &motion, cycles, cycle_s, period_m)?
        {
            return Ok((mean, motion));
        }
        let before = motion.clone();
        motion.advance_to(f64::from(cycles + 1), cycle_s)?;
        let closure_m = (0..worm.cells())
            .map(|cell| (motion.deformation_m(cell) - before.deformation_m(cell)).abs())
            .fold(0.0, f64::max);
        let is_closed = physics.is_periodic() && closure_m <= fraction * worm.stroke_m();
        if is_closed || cycles == max_cycles {
            let advance_m = motion.mean_position_m() - before.mean_position_m();
            let ledger = motion.ledger().since(before.ledger());
            return Ok((Cycle::new(worm, advance_m, &ledger, cycles, closure_m), motion));
        }
        cycles += 1;
    }
}

/// The mean of the cycles that take a worm through whole periods of the canal, as nearly as whole cycles do, and the motion at their end;
/// none where it does not come through one.
fn mean_cycle(
    worm: &Worm,
    start: &Locomotion,
    cycles_before: u32,
    cycle_s: f64,
    period_m: f64,
) -> Result<Option<(Cycle, Locomotion)>, SlidesDown> {
    let mut motion = start.clone();
    let mut best: Option<(f64, u32, Locomotion)> = None;
    for cycles in 1..=MOST_MEAN_CYCLES {
        motion.advance_to(f64::from(cycles_before + cycles), cycle_s)?;
        let periods = (motion.mean_position_m() - start.mean_position_m()).abs() / period_m;
        // What is too much or too little of a period counts the less the more cycles there are.
        let off = (periods - periods.round()).abs() / f64::from(cycles);
        if periods.round() >= 1.0 && best.as_ref().is_none_or(|(least, ..)| off < *least) {
            best = Some((off, cycles, motion.clone()));
        }
        if periods >= PERIODS {
            break;
        }
    }
    Ok(best.map(|(_, cycles, end)| {
        let advance_m = (end.mean_position_m() - start.mean_position_m()) / f64::from(cycles);
        let closure = |cell: usize| (end.deformation_m(cell) - start.deformation_m(cell)).abs();
        let closure_m = (0..worm.cells()).map(closure).fold(0.0, f64::max);
        let ledger = end.ledger().since(start.ledger()).mean_of(cycles);
        let cycle = Cycle::new(worm, advance_m, &ledger, cycles_before, closure_m);
        (cycle, end)
    }))
}

/// Energy that the same worm on rigid contacts would take to cover a distance: n μN L + m g sin λ L, J, with μN = k δmax
/// for each cell. Rigid tips neither spring back nor slide backward, so each slides forward by the distance itself.
pub fn rigid_energy_j(worm: &Worm, distance_m: f64) -> f64 {
    let friction_n: f64 = worm
        .contacts()
        .iter()
        .map(|contact| contact.stiffness_n_per_m * contact.forward_bound_m)
        .sum();
    (friction_n + worm.pull_n()) * distance_m
}

/// The steady cycle of equal cells on the level in closed form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelCycle {
    /// L = Ls − 2 δmax n/(n−1), m.
    pub advance_m: f64,
    /// Positive actuator work n [k δmax L + ½ k δmax² n/(n−1)], J.
    pub energy_actuator_positive_j: f64,
}

/// The steady cycle of `cells` equal cells on the level without resisting force: the stepping cell loads from −δmax to
/// +δmax while every other cell gives back 2 δmax/(n−1), and no tip slides backward. Valid where the advance is positive.
pub fn level_closed_form(cells: usize, stiffness_n_per_m: f64, max_deformation_m: f64, stroke_m: f64) -> LevelCycle {
    let n = cells as f64;
    let give = n / (n - 1.0);
    let friction_n = stiffness_n_per_m * max_deformation_m;
    let advance_m = stroke_m - 2.0 * max_deformation_m * give;
    LevelCycle {
        advance_m,
        energy_actuator_positive_j: n * friction_n * (advance_m + 0.5 * max_deformation_m * give),
    }
}

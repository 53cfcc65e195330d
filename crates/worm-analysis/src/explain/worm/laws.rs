//! What a law of a worm may depend on: the quantities of its cells, over the ranges that they go through.
//!
//! The ranges are those of a crawl of the recalibrated model in every run, with a law where one is fitted anew, and for the place those of
//! the recordings.

use super::recorded_worm::RecordedWorm;
use crate::explain::search::fit::Fit;
use crate::explain::search::law::grid::{about_rest, ends, evenly, from_rest, scaled, thinned, with_spacing};
use crate::explain::search::law::offer::Offer;
use crate::explain::search::law::shape::LawShape;
use crate::explain::search::plant::{Plant, Recorded};
use worm_physics::{ActsOn, Axis, Crawl, Mechanics};

/// Cycles that are run before a crawl is followed, and the parts of each of the two that are: the first for what is remembered of it, the
/// second to be looked at.
const LEAD_CYCLES: f64 = 2.0;
const PARTS: usize = 240;
/// How far a law may remember, s: what pads and tips forget spreads over decades, and one time for each factor of four comes near to any.
const MEMORIES_S: [f64; 4] = [0.05, 0.2, 0.8, 3.2];
/// Points along an axis; along a place and a time, what lies between them at least: m, and cycles.
const POINTS: usize = 9;
const POINTS_OF_CELL: usize = 5;
const POINTS_OF_PHASE: usize = 16;
const SPACING_M: f64 = 3.5e-3;
const SPACING_CYCLES: f64 = 0.5;
/// Most intervals of a time for single cells, all together.
const INTERVALS_OF_CELLS: f64 = 220.0;
/// Shortest periods, in points of a grid.
const OF_PERIOD: f64 = 2.2;
/// Scales of a force, as a fraction of the friction of a tip, of a factor on friction, and of a displacement, as a fraction of the stroke.
const FORCES: [f64; 4] = [0.02, 0.06, 0.2, 0.5];
const FACTORS: [f64; 4] = [0.04, 0.1, 0.25, 0.5];
const DISPLACEMENTS: [f64; 4] = [0.005, 0.015, 0.05, 0.15];
/// Times within a run that are kept as where the data are.
const TIMES: usize = 600;

/// Where the cells of a worm are on the axes that a crawl shows.
#[derive(Default)]
struct Visited {
    deformation_m: Vec<f64>,
    rate_m_s: Vec<f64>,
    speed_m_s: Vec<f64>,
    load_n: Vec<f64>,
    /// These two for each of [`MEMORIES_S`].
    recent_deformation_m: [Vec<f64>; MEMORIES_S.len()],
    recent_slide_m: [Vec<f64>; MEMORIES_S.len()],
}

/// Every law that is tried.
pub(super) fn laws(worm: &RecordedWorm<'_>, recalibrated: &Fit) -> Vec<Offer> {
    let mut visited = Visited::default();
    for run in 0..worm.runs() {
        visit(worm, run, recalibrated, &mut visited);
    }
    let friction_n = friction_n(worm);
    let stroke_m = worm.scene.nominal[0].worm.stroke_m();
    let offer = |acts_on: ActsOn, axis: Axis, cell: Option<usize>, grid: Vec<f64>, seen: &[f64]| {
        let scaled = scaled(axis, &grid);
        let sigmas = match acts_on {
            ActsOn::ContactForce => FORCES.map(|fraction| fraction * friction_n),
            ActsOn::FrictionFactor => FACTORS,
            ActsOn::DriveDisplacement => {
                // What a cell loses of its strokes adds up over time.
                let strokes = if axis == Axis::Time { grid[grid.len() - 1] } else { 1.0 };
                DISPLACEMENTS.map(|fraction| fraction * strokes * stroke_m)
            }
            // Nothing of a worm's motor is offered.
            ActsOn::MotorFriction | ActsOn::MotorTorque => [0.0; 4],
        };
        let spacing = grid.get(1).map_or(0.0, |second| second - grid[0]);
        let width = grid[grid.len() - 1] - grid[0];
        let may_repeat = matches!(axis, Axis::Place | Axis::Time) && grid.len() > 3 * POINTS_OF_CELL;
        Offer {
            scaled: vec![scaled],
            period: (axis == Axis::Phase).then_some(1.0),
            periods: may_repeat.then_some([OF_PERIOD * spacing, 0.7 * width]),
            sigmas,
            constant: Offer::CONSTANT,
            guess: None,
            seen: thinned(seen),
            shape: LawShape::of_points(acts_on, vec![(axis, grid)], cell),
        }
    };
    let mut offers = Vec::new();
    let place_m = worm.stretch_m();
    let places_m: Vec<f64> = seen_places_m(worm);
    let cycles = worm.scene.observed.iter().map(|observed| {
        let phase = &observed.phase;
        phase[phase.len() - 1] - phase[0]
    });
    let cycles = cycles.fold(0.0, f64::max);
    let times: Vec<f64> = (0..TIMES).map(|at| cycles * at as f64 / TIMES as f64).collect();
    let slopes_deg = slopes_deg(worm);
    let phases: Vec<f64> = (0..POINTS_OF_PHASE)
        .map(|point| point as f64 / POINTS_OF_PHASE as f64)
        .collect();
    let force = ActsOn::ContactForce;
    let friction = ActsOn::FrictionFactor;
    let displacement = ActsOn::DriveDisplacement;
    let evenly_of = |seen: &[f64], points: usize| ends(seen).map(|(from, to)| evenly(from, to, points));
    for (axis, seen) in [
        (Axis::Deformation, &visited.deformation_m),
        (Axis::Load, &visited.load_n),
    ] {
        let grid = evenly_of(seen, POINTS);
        offers.extend(grid.map(|grid| offer(force, axis, None, grid, seen)));
    }
    for (number, memory_s) in MEMORIES_S.into_iter().enumerate() {
        let seen = &visited.recent_deformation_m[number];
        let of_pad = evenly_of(seen, POINTS).map(|grid| offer(force, Axis::RecentDeformation, None, grid, seen));
        let seen = &visited.recent_slide_m[number];
        let grid = ends(seen).map(|(_, longest)| from_rest(longest));
        let of_tip = grid.map(|grid| offer(friction, Axis::RecentSlide, None, grid, seen));
        offers.extend(of_pad.into_iter().chain(of_tip).map(|mut offer| {
            offer.shape.memory_s = Some(memory_s);
            offer
        }));
    }
    for (axis, seen) in [
        (Axis::DeformationRate, &visited.rate_m_s),
        (Axis::Speed, &visited.speed_m_s),
    ] {
        let grid = ends(seen).map(|(from, to)| about_rest(from, to));
        offers.extend(grid.map(|grid| offer(force, axis, None, grid, seen)));
    }
    let grid = ends(&visited.speed_m_s).map(|(from, to)| about_rest(from, to));
    offers.extend(grid.map(|grid| offer(friction, Axis::Speed, None, grid, &visited.speed_m_s)));
    let grid = evenly_of(&visited.load_n, POINTS);
    offers.extend(grid.map(|grid| offer(friction, Axis::Load, None, grid, &visited.load_n)));
    // What does not change within a run, and the same displacement of every cell, are nothing that can be seen.
    offers.push(offer(displacement, Axis::Phase, None, phases.clone(), &phases));
    offers.extend(
        evenly_of(&visited.load_n, POINTS).map(|grid| offer(displacement, Axis::Load, None, grid, &visited.load_n)),
    );
    let time_grid = with_spacing(0.0, cycles, SPACING_CYCLES);
    let of_cell = SPACING_CYCLES.max(cycles * worm.channels() as f64 / INTERVALS_OF_CELLS);
    let grid_of_cell = with_spacing(0.0, cycles, of_cell);
    for cell in 0..worm.channels() {
        offers.push(offer(displacement, Axis::Phase, Some(cell), phases.clone(), &phases));
        offers.push(offer(
            displacement,
            Axis::Time,
            Some(cell),
            grid_of_cell.clone(),
            &times,
        ));
        offers.push(offer(friction, Axis::Time, Some(cell), grid_of_cell.clone(), &times));
    }
    for acts_on in [force, friction] {
        let place_grid = with_spacing(place_m.0, place_m.1, SPACING_M);
        offers.push(offer(acts_on, Axis::Place, None, place_grid, &places_m));
        offers.push(offer(acts_on, Axis::Phase, None, phases.clone(), &phases));
        offers.push(offer(acts_on, Axis::Time, None, time_grid.clone(), &times));
        if slopes_deg.len() > 1 {
            offers.push(offer(acts_on, Axis::Slope, None, slopes_deg.clone(), &slopes_deg));
        }
        for cell in 0..worm.channels() {
            let grid = evenly_of(&visited.deformation_m, POINTS_OF_CELL);
            offers.extend(grid.map(|grid| offer(acts_on, Axis::Deformation, Some(cell), grid, &visited.deformation_m)));
        }
    }
    offers
}

/// One cycle of the recalibrated crawl of a run, after one whose memory it has.
fn visit(worm: &RecordedWorm<'_>, run: usize, fit: &Fit, visited: &mut Visited) {
    let observed = &worm.scene.observed[run];
    let (physics, damping) = worm.scene.physics(run, &fit.hypothesis, &fit.at);
    let mechanics = Mechanics::new(&physics);
    let Ok(mut crawl) = Crawl::at_rest(&mechanics, 0.0, &observed.first_m, Some(damping)) else {
        return;
    };
    if crawl
        .advance_to(&mechanics, LEAD_CYCLES, LEAD_CYCLES * observed.cycle_s)
        .is_err()
    {
        return;
    }
    let step_s = observed.cycle_s / PARTS as f64;
    let remembered = MEMORIES_S.map(|memory_s| (-step_s / memory_s).exp());
    let mut recent_m = vec![[[0.0; 2]; MEMORIES_S.len()]; observed.cells()];
    for part in 1..=2 * PARTS {
        let before = crawl.clone();
        let phase = LEAD_CYCLES + part as f64 / PARTS as f64;
        if crawl.advance_to(&mechanics, phase, step_s).is_err() {
            return;
        }
        for (cell, recent_m) in recent_m.iter_mut().enumerate() {
            let deformation_m = crawl.deformation_m(cell);
            let strain_m = deformation_m - before.deformation_m(cell);
            let shift_m = crawl.positions_m()[cell] - before.positions_m()[cell];
            for (of_memory_m, left) in recent_m.iter_mut().zip(remembered) {
                of_memory_m[0] = (of_memory_m[0] + strain_m) * left;
                of_memory_m[1] = (of_memory_m[1] + (shift_m - strain_m).abs()) * left;
            }
            if part <= PARTS {
                continue;
            }
            visited.deformation_m.push(deformation_m);
            visited.rate_m_s.push(strain_m / step_s);
            visited.speed_m_s.push(shift_m / step_s);
            for (memory, [strained_m, slid_m]) in recent_m.iter().enumerate() {
                visited.recent_deformation_m[memory].push(*strained_m);
                visited.recent_slide_m[memory].push(*slid_m);
            }
            let worm = mechanics.worm();
            visited
                .load_n
                .push(crawl.contact_force_n(cell) + worm.cell_weight_n(cell) + worm.cell_resistance_n());
        }
    }
}

/// Mean friction of a tip, N.
fn friction_n(worm: &RecordedWorm<'_>) -> f64 {
    let worms = worm.scene.nominal.iter().map(|physics| &physics.worm);
    let all: Vec<f64> = worms
        .flat_map(|worm| worm.contacts())
        .map(|contact| contact.stiffness_n_per_m * contact.forward_bound_m)
        .collect();
    all.iter().sum::<f64>() / all.len() as f64
}

/// The slopes of the runs, each once, ascending, degrees.
fn slopes_deg(worm: &RecordedWorm<'_>) -> Vec<f64> {
    let mut all: Vec<f64> = worm
        .scene
        .observed
        .iter()
        .map(|observed| observed.run.slope_deg)
        .collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

fn seen_places_m(worm: &RecordedWorm<'_>) -> Vec<f64> {
    let all = worm.scene.observed.iter().flat_map(|observed| &observed.position_m);
    all.flatten().copied().filter(|at_m| at_m.is_finite()).collect()
}

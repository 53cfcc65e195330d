//! Worms and runs from wider ranges than the library's priors: number of cells, rate, cycles, speed, slopes, noise, laws.

use super::artefact::Artefact;
use super::body::Placement;
use super::camera::Camera;
use super::hidden::Hidden;
use super::parameters::{WormParameters, each_of};
use super::scene::{MotionCapture, STEP_S, Scene};
use super::setting::Setting;
use super::tip::laws::Laws;
use crate::nominal::GRAVITY_M_S2;
use crate::random::{about_one, log_uniform, shuffle, truncated_normal};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Standard deviation of a slope about what is stated, degrees.
const SLOPE_SIGMA_DEG: f64 = 0.2;
/// Steepest slope, degrees.
const STEEPEST_DEG: f64 = 45.0;
/// Share of what the tips can hold that a slope asks of them, while one of them is stepping.
const HOLD_SHARE: f64 = 0.75;
/// Gentler slopes that are tried where the worm does not crawl.
const EASIER: [f64; 4] = [1.0, 0.8, 0.6, 0.45];
/// Cycles over all runs at most: the time of a search is proportional to it.
const MAX_CYCLES: f64 = 150.0;
/// Least gait cycles in a run in which something begins.
const ONSET_CYCLES: f64 = 11.0;
/// Earliest and latest cycle of an onset.
const ONSET: [f64; 2] = [3.0, 10.0];
/// Earliest and latest cycle of one that ends again, and for how many it lasts.
const SPELL: [f64; 2] = [2.0, 6.0];
const LASTS: [f64; 2] = [2.0, 4.0];
/// Gait cycles and samples per second of a short recording.
const SHORT_CYCLES: f64 = 8.0;
const SHORT_HZ: f64 = 60.0;
/// Shares of campaigns with one to six runs, summed up.
const RUNS: [f64; 6] = [0.05, 0.2, 0.7, 0.85, 0.95, 1.0];

/// A worm, its runs and its camera.
pub fn setting(hidden: Hidden, rng: &mut Xoshiro256PlusPlus) -> Setting {
    let cells = rng.random_range(3..=8);
    let parameters = worm(cells, rng);
    let drawn: f64 = rng.random();
    let runs = 1 + RUNS.iter().filter(|&&up_to| drawn >= up_to).count();
    let cycle_s = log_uniform(0.8, 10.0, rng);
    // More short recordings than long ones.
    let exponent = rng.random::<f64>().powi(2);
    let mut cycles = (8.0 * (60.0_f64 / 8.0).powf(exponent))
        .min((MAX_CYCLES / runs as f64).max(8.0))
        .round();
    let is_spell = matches!(hidden, Hidden::Spell(..));
    let is_onset = is_spell || matches!(hidden, Hidden::Onset(..));
    if is_onset {
        cycles = cycles.max(ONSET_CYCLES);
    }
    let capture = MotionCapture {
        camera: Camera {
            rate_hz: [60.0, 100.0, 120.0, 120.0, 200.0, 240.0][rng.random_range(0..6)],
            noise_m: log_uniform(0.02e-3, 0.3e-3, rng),
            ..Camera::default()
        },
        drift_m: log_uniform(0.01e-3, 0.06e-3, rng),
        drift_s: log_uniform(0.02, 0.3, rng),
    };
    let with_phase = rng.random::<f64>() < 0.6;
    let warm_up_cycles = if rng.random::<bool>() {
        rng.random_range(1.2..2.2)
    } else {
        0.0
    };
    let [earliest, latest] = if is_spell { SPELL } else { ONSET };
    let begins_at_cycle = rng.random_range(earliest..latest);
    let ends_at_cycle = if is_spell {
        begins_at_cycle + rng.random_range(LASTS[0]..LASTS[1])
    } else {
        f64::INFINITY
    };
    let everywhere = rng.random::<f64>() < 0.7;
    let first_run = rng.random_range(0..runs);
    let scenes = (0..runs)
        .map(|run| Scene {
            placement: Placement {
                slope_deg: SLOPE_SIGMA_DEG * truncated_normal(rng),
                payload_kg: 0.0,
                start_m: 0.0,
            },
            drive: parameters.motor.drive(cycle_s, rng),
            capture: capture.clone(),
            warm_up_cycles,
            cycles,
            dwell_s: 0.0,
            jump_at_cycle: match run.cmp(&(runs / 2)) {
                std::cmp::Ordering::Less => f64::INFINITY,
                std::cmp::Ordering::Equal => 0.5 * cycles,
                std::cmp::Ordering::Greater => f64::NEG_INFINITY,
            },
            begins_at_cycle: match run.cmp(&first_run) {
                _ if !is_onset => f64::NEG_INFINITY,
                _ if everywhere => begins_at_cycle,
                // It happens once, in one run, and stays.
                std::cmp::Ordering::Less => f64::INFINITY,
                std::cmp::Ordering::Equal => begins_at_cycle,
                std::cmp::Ordering::Greater if is_spell => f64::INFINITY,
                std::cmp::Ordering::Greater => f64::NEG_INFINITY,
            },
            ends_at_cycle,
            with_phase,
            servo: 1,
            seed: rng.random(),
            step_s: STEP_S,
        })
        .collect();
    let may_be_spoiled = matches!(hidden, Hidden::Clean | Hidden::Single(..));
    let artefact = Artefact::draw(rng).filter(|_| may_be_spoiled);
    Setting {
        slopes_deg: slopes_deg(&parameters, runs, rng),
        parameters,
        scenes,
        cycle_s,
        laws: Laws::draw(rng),
        artefact,
        discrepancy_m: match hidden {
            Hidden::Discrepant(micrometres) => 1e-6 * f64::from(micrometres),
            _ => 0.0,
        },
    }
}

impl Setting {
    /// Only the gentlest and the steepest run, short ones before a slow camera: the time of a search is proportional to the samples.
    pub fn shortened(mut self) -> Self {
        let is_onset = self
            .scenes
            .iter()
            .any(|scene| scene.begins_at_cycle != f64::NEG_INFINITY);
        let middle = 1..self.scenes.len().saturating_sub(1).max(1);
        self.scenes.drain(middle.clone());
        self.slopes_deg.drain(middle);
        for scene in &mut self.scenes {
            scene.cycles = if is_onset { ONSET_CYCLES } else { SHORT_CYCLES };
            scene.capture.camera.rate_hz = SHORT_HZ;
        }
        self
    }
}

/// Parameters that spread wider than the priors of a careful laboratory.
fn worm(cells: usize, rng: &mut Xoshiro256PlusPlus) -> WormParameters {
    let nominal = WormParameters::nominal();
    let usual = WormParameters::draw(rng);
    let (friction, stiffness) = (about_one(0.10, rng), about_one(0.05, rng));
    let mut step_order: Vec<usize> = (0..cells).collect();
    if rng.random_range(0..4) == 0 {
        shuffle(&mut step_order, rng);
    }
    WormParameters {
        cells,
        mass_kg: nominal.mass_kg * cells as f64 / nominal.cells as f64 * about_one(0.01, rng),
        friction_n: each_of(cells, |_| nominal.friction_n[0] * friction * about_one(0.03, rng)),
        stiffness_n_per_m: each_of(cells, |_| {
            nominal.stiffness_n_per_m[0] * stiffness * about_one(0.02, rng)
        }),
        stroke_m: nominal.stroke_m * about_one(0.012, rng),
        damping_ratio: 10f64.powf(rng.random_range(-0.7..0.2)),
        scatter: rng.random_range(0.002..0.02),
        step_order,
        ..usual
    }
}

/// The slopes of the runs from the level up, each with gentler ones where the worm does not crawl on it.
fn slopes_deg(worm: &WormParameters, runs: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<Vec<f64>> {
    let mean_n = worm.friction_n[..worm.cells].iter().sum::<f64>() / worm.cells as f64;
    let holds_n = HOLD_SHARE * mean_n * (worm.cells - 2) as f64;
    let sine = (holds_n / (worm.mass_kg * GRAVITY_M_S2)).min(1.0);
    let steepest_deg = sine.asin().to_degrees().min(STEEPEST_DEG) * rng.random_range(0.8..1.0);
    (0..runs)
        .map(|run| {
            let share = if runs > 1 { run as f64 / (runs - 1) as f64 } else { 0.0 };
            EASIER
                .iter()
                .map(|easier| (steepest_deg * share * easier).round())
                .collect()
        })
        .collect()
}

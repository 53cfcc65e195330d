//! Campaigns for the tests of the search: the model's own crawl under an effect, with noise and a body that goes astray.

use crate::experiment::{RecordedRun, Simulation, simulate};
use crate::explain::search::discrepancy::Discrepancy;
use crate::explain::search::fit::Fit;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::parameter::{Hypothesised, Onset};
use crate::explain::search::plant::{Plant, Recorded};
use crate::explain::search::problem::FitProblem;
use crate::explain::worm::observed::Observed;
use crate::explain::worm::predict::Scene;
use crate::explain::worm::recorded_worm::{RecordedWorm, WormProblem};
use crate::recording::Recording;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_estimator::config::Config;
use worm_physics::effect::named;
use worm_physics::{Physics, Worm};

/// Standard deviation of one position, and of what the body's random walk gathers in a cycle, m.
pub(super) const NOISE_M: f64 = 5e-5;
pub(super) const WALK_M: f64 = 3e-5;

/// What is recorded: slopes, and how.
pub(super) struct Campaign {
    pub slopes_deg: Vec<f64>,
    pub simulation: Simulation,
}

impl Default for Campaign {
    fn default() -> Self {
        Self {
            slopes_deg: vec![0.0, 20.0],
            simulation: Simulation {
                noise_m: 0.0,
                rate_hz: 60.0,
                ..Simulation::default()
            },
        }
    }
}

/// An effect with the cell, from 0, and its values.
pub(super) type Truth<'t> = Option<(&'t str, Option<usize>, &'t [f64])>;

/// The recordings of a worm with an effect.
pub(super) fn record(campaign: &Campaign, truth: Truth<'_>, seed: u64) -> Vec<Recording> {
    record_under(campaign, &hypothesis(truth), seed)
}

/// The recordings of a worm under a hypothesis.
pub(super) fn record_under(
    campaign: &Campaign,
    (hypothesis, at): &(Hypothesis, Vec<f64>),
    seed: u64,
) -> Vec<Recording> {
    let config = Config::default();
    let simulations = campaign.slopes_deg.iter().map(|&slope_deg| Simulation {
        slope_deg,
        ..campaign.simulation.clone()
    });
    let mut recordings: Vec<Recording> = simulations
        .map(|simulation| simulate(&config, &simulation).expect("the simulation is a fixed one"))
        .collect();
    let scene = scene(&recordings, campaign);
    let runs = 0..recordings.len();
    let predicted: Vec<Vec<f64>> = runs
        .map(|run| scene.predict(run, hypothesis, at).expect("it holds").position_m)
        .collect();
    drop(scene);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    for (recording, predicted_m) in recordings.iter_mut().zip(predicted) {
        let cells = recording.cells();
        let samples = recording.time_s.len();
        let step_m = WALK_M * (campaign.simulation.cycles / samples as f64).sqrt();
        let mut astray_m = 0.0;
        for sample in 0..samples {
            let push: f64 = StandardNormal.sample(&mut rng);
            astray_m += step_m * push;
            for cell in 0..cells {
                let noise: f64 = StandardNormal.sample(&mut rng);
                // What was lost stays lost.
                if recording.position_m[cell][sample].is_finite() {
                    recording.position_m[cell][sample] =
                        predicted_m[sample * cells + cell] + astray_m + NOISE_M * noise;
                }
            }
        }
    }
    recordings
}

/// An effect assumed to act with these values, and nothing else free.
pub(super) fn hypothesis(truth: Truth<'_>) -> (Hypothesis, Vec<f64>) {
    let Some((name, cell, values)) = truth else {
        return (Hypothesis::default(), Vec::new());
    };
    let effect = named(name).expect("the name is in the library");
    (
        Hypothesis::new(&[], &[Hypothesised::throughout(effect, cell)]),
        values.to_vec(),
    )
}

/// The same, from some cycles after the start of the runs that it concerns on.
pub(super) fn begun(truth: Truth<'_>, onset: Onset) -> (Hypothesis, Vec<f64>) {
    let (mut hypothesis, at) = hypothesis(truth);
    hypothesis
        .hypothesised
        .iter_mut()
        .for_each(|one| one.onset = Some(onset));
    (hypothesis, at)
}

pub(super) fn scene<'a>(recordings: &'a [Recording], campaign: &Campaign) -> Scene<'a> {
    let config = Config::default();
    let mut scene = Scene {
        observed: Vec::new(),
        nominal: Vec::new(),
    };
    for (recording, &slope_deg) in recordings.iter().zip(&campaign.slopes_deg) {
        let run = RecordedRun::at_slope(recording, slope_deg);
        let mut observed = Observed::new(run, &config).expect("a recording of this worm");
        observed.assume_laid_down(true);
        let worm = Worm::try_from(&config).expect("the default worm is one");
        let worm = worm.with_slope_rad(slope_deg.to_radians()).expect("a slope");
        scene.nominal.push(Physics::of(worm));
        scene.observed.push(observed);
    }
    scene
}

/// The worm of some recordings with the noise that a hypothesis leaves.
pub(super) fn worm<'a>(
    recordings: &'a [Recording],
    campaign: &Campaign,
    (hypothesis, at): &(Hypothesis, Vec<f64>),
) -> RecordedWorm<'a> {
    let mut worm = RecordedWorm::new(scene(recordings, campaign));
    worm.measure_noise(hypothesis, at).expect("it holds");
    worm
}

/// Its problem with a discrepancy of 10 µm.
pub(super) fn with_discrepancy<'p, 'a>(worm: &'p RecordedWorm<'a>) -> (WormProblem<'p, 'a>, Discrepancy) {
    let discrepancy = Discrepancy::new(worm.discrepancy_columns(1e-5), 1e-5);
    let problem = FitProblem {
        discrepancy: Some(discrepancy.clone()),
        ..FitProblem::with_noise_alone(worm)
    };
    (problem, discrepancy)
}

/// A hypothesis taken as it is, without a discrepancy: these worms are the model's own.
pub(super) fn taken(worm: &RecordedWorm<'_>, (hypothesis, at): (Hypothesis, Vec<f64>)) -> Fit {
    FitProblem::with_noise_alone(worm).evaluate(&hypothesis, at)
}

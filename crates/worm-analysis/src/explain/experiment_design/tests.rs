use super::*;
use crate::experiment::{RecordedRun, Simulation, simulate};
use crate::explain::answer::RunChange;
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::plant::Plant;
use crate::explain::search::problem::FitProblem;
use crate::explain::worm::nuisance::Nuisance;
use crate::explain::worm::observed::Observed;
use crate::explain::worm::predict::{Scene, nominal};
use crate::explain::worm::recorded_worm::RecordedWorm;
use crate::recording::Recording;
use worm_estimator::config::Config;
use worm_physics::{Physics, Worm, effect};

const SLOPES_DEG: [f64; 3] = [0.0, 30.0, 40.0];

fn recordings(config: &Config) -> Vec<Recording> {
    let make = |slope_deg: f64| {
        let simulation = Simulation {
            slope_deg,
            cycles: 6.0,
            rate_hz: 40.0,
            seed: 3,
            ..Simulation::default()
        };
        simulate(config, &simulation).expect("the default worm crawls on these slopes")
    };
    SLOPES_DEG.map(make).to_vec()
}

fn scene<'r>(recordings: &'r [Recording], config: &Config) -> Scene<'r> {
    let observed: Vec<Observed<'_>> = recordings
        .iter()
        .zip(SLOPES_DEG)
        .map(|(recording, slope_deg)| {
            let run = RecordedRun::at_slope(recording, slope_deg);
            Observed::new(run, config).expect("six clean cycles")
        })
        .collect();
    let physics = observed.iter().map(|observed| {
        let worm = Worm::try_from(config).expect("the default worm");
        let worm = worm
            .with_slope_rad(observed.run.slope_deg.to_radians())
            .expect("a slope");
        Physics::of(nominal(observed, worm, 0.0))
    });
    Scene {
        nominal: physics.collect(),
        observed,
    }
}

/// What is proposed for effects with these values, on a campaign that knows little of them.
fn proposed(rivals: &[(&str, f64)]) -> Option<NextExperiment> {
    let config = Config::default();
    let recordings = recordings(&config);
    let mut worm = RecordedWorm::new(scene(&recordings, &config));
    let nuisances = Nuisance::all(config.worm.cells, SLOPES_DEG.len(), true);
    let base = Hypothesis::new(&nuisances, &[]);
    worm.measure_noise(&base, &base.neutral()).expect("the worm holds");
    let problem = FitProblem::with_noise_alone(&worm);
    let fits: Vec<Fit> = rivals
        .iter()
        .map(|&(name, value)| {
            let effect = effect::named(name).expect("an effect of the library");
            let hypothesis = Hypothesis::new(&nuisances, &[Hypothesised::throughout(effect, None)]);
            let mut at = hypothesis.neutral();
            *at.last_mut().expect("the effect's parameter") = value;
            let mut fit = problem.evaluate(&hypothesis, at);
            problem.compute_jacobian(&mut fit);
            fit
        })
        .collect();
    propose(&worm, &fits.iter().collect::<Vec<_>>(), config.gait.cycle_s)
}

#[test]
fn a_payload_tells_a_wrong_slope_from_a_constant_drag() {
    // The same pull at 30°: m g (sin 32.95° − sin 30°).
    let next = proposed(&[("slope-error", 2.95), ("constant-drag", 0.1434)]).expect("two rivals");
    assert_eq!(
        (next.change, &*next.unit),
        (ExperimentChange::Run(RunChange::Payload), "kg"),
        "{next:?}"
    );
    assert!(
        next.value.is_some() && next.description.contains("known mass"),
        "{next:?}"
    );
    assert!(next.separation_sigma.is_some_and(|sigma| sigma > 3.0), "{next:?}");
    let effects: Vec<&str> = next.predictions.iter().map(|prediction| &*prediction.effect).collect();
    assert_eq!(effects, ["slope-error", "constant-drag"]);
    assert!(
        next.predictions.iter().all(|prediction| prediction.advance_m.is_some()),
        "{next:?}"
    );
}

#[test]
fn what_no_run_tells_apart_goes_to_the_bench() {
    // Two effects that do nothing say the same of every run.
    let next = proposed(&[("slope-clamping", 0.0), ("constant-drag", 0.0)]).expect("two rivals");
    assert_eq!((next.value, next.separation_sigma), (None, None), "{next:?}");
    assert_eq!(
        next.change,
        ExperimentChange::Measurement(effect::named("slope-clamping").expect("an effect").separated_by)
    );
    assert_eq!(next.predictions.len(), 2);
}

#[test]
fn one_answer_needs_no_experiment() {
    assert_eq!(proposed(&[("slope-error", 2.5)]), None);
}

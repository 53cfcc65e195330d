use super::{Measured, closed, cycles};
use crate::explain::answer::{Stage, StageKind};
use crate::explain::fixture::{Campaign, NOISE_M, Truth, WALK_M, hypothesis, record, scene, taken, worm};
use crate::explain::worm::predict::Scene;
use crate::recording::Recording;

const EFFECTS: [Truth<'static>; 3] = [
    Some(("slope-error", None, &[3.0])),
    Some(("unequal-clamping", Some(1), &[1.25])),
    Some(("wear", None, &[0.02])),
];

/// Every cycle of every run held out, or none.
fn fold(scene: &Scene<'_>, out: bool) -> Vec<Vec<bool>> {
    scene.observed.iter().map(|_| vec![out; 20]).collect()
}

struct Stages {
    baseline: Stage,
    named: Stage,
    free_form: Stage,
    floor: Stage,
}

fn stages(recordings: &[Recording], truth: Truth<'_>) -> Stages {
    let worm = worm(recordings, &Campaign::default(), &hypothesis(truth));
    let (baseline, named) = (taken(&worm, hypothesis(None)), taken(&worm, hypothesis(truth)));
    let measured = Measured::new(&worm, &named);
    let folds = [(named.clone(), fold(&worm.scene, true))];
    Stages {
        baseline: measured.stage(StageKind::Baseline, None, &baseline, &[]),
        named: measured.stage(StageKind::Named, Some("it".to_owned()), &named, &folds),
        free_form: measured.free_form_stage(&baseline),
        floor: measured.floor_stage(),
    }
}

#[test]
fn the_gap_shrinks_to_the_floor_that_noise_and_walk_make() {
    let floor_m = (NOISE_M * NOISE_M + WALK_M * WALK_M / 6.0).sqrt();
    for truth in EFFECTS {
        let recordings = record(&Campaign::default(), truth, 1);
        let Stages {
            baseline,
            named,
            free_form,
            floor,
        } = stages(&recordings, truth);
        let near = |rms_m: f64, expected_m: f64, fraction: f64| (rms_m / expected_m - 1.0).abs() < fraction;
        let told = format!("{truth:?}\n{baseline:?}\n{named:?}\n{free_form:?}\n{floor:?}\nexpected {floor_m}");
        assert!(near(floor.held_out_rms_m, floor_m, 0.03), "{told}");
        assert!(near(named.held_out_rms_m, floor.held_out_rms_m, 0.03), "{told}");
        assert!(baseline.held_out_rms_m > 1.2 * floor.held_out_rms_m, "{told}");
        assert!(free_form.fit_rms_m < floor.held_out_rms_m, "{told}");
        assert!(
            (1.0..1.1).contains(&(free_form.held_out_rms_m / floor.held_out_rms_m)),
            "{told}"
        );
        assert!(named.advance_error_m < 3.0 * floor.advance_error_m, "{told}");
        assert!(baseline.advance_error_m > 10.0 * floor.advance_error_m, "{told}");
        assert!(free_form.advance_error_m < 0.1 * floor.advance_error_m, "{told}");
        assert!(named.energy_error_j < 0.15 * baseline.energy_error_j, "{told}");
    }
}

#[test]
fn the_advance_that_a_model_misses_is_told() {
    let truth = EFFECTS[0];
    let campaign = Campaign::default();
    let recordings = record(&campaign, truth, 2);
    let scene = scene(&recordings, &campaign);
    let per_cycle_m = |run: usize, truth: Truth<'_>| {
        let (hypothesis, at) = hypothesis(truth);
        let position_m = scene.predict(run, &hypothesis, &at).expect("it holds").position_m;
        let observed = &scene.observed[run];
        let last = position_m.len() - 1;
        let cycle = observed
            .phase
            .partition_point(|phase| *phase < observed.phase[observed.samples() - 1] - 1.0);
        position_m[last] - position_m[(cycle + 1) * observed.cells() - 1]
    };
    let missed_m = (0..2)
        .map(|run| (per_cycle_m(run, truth) - per_cycle_m(run, None)).abs())
        .sum::<f64>()
        / 2.0;
    let told_m = stages(&recordings, truth).baseline.advance_error_m;
    assert!((told_m - missed_m).abs() < 2.0 * WALK_M, "{told_m} for {missed_m}");
}

#[test]
fn only_cycles_that_were_held_out_count_as_such() {
    let campaign = Campaign::default();
    let recordings = record(&campaign, None, 3);
    let worm = worm(&recordings, &campaign, &hypothesis(None));
    let (right, wrong) = (taken(&worm, hypothesis(None)), taken(&worm, hypothesis(EFFECTS[0])));
    let measured = Measured::new(&worm, &right);
    let rms_m = |folds: &[_]| measured.stage(StageKind::Named, None, &right, folds).held_out_rms_m;
    let wrong_m = measured.stage(StageKind::Named, None, &wrong, &[]).fit_rms_m;
    let right_m = rms_m(&[]);
    assert_eq!(rms_m(&[(right.clone(), fold(&worm.scene, true))]), right_m);
    let of_wrong_m = rms_m(&[
        (wrong.clone(), fold(&worm.scene, true)),
        (right.clone(), fold(&worm.scene, false)),
    ]);
    // The sums run in another order.
    assert!((of_wrong_m / wrong_m - 1.0).abs() < 1e-12, "{of_wrong_m} for {wrong_m}");
    assert!(rms_m(&[(wrong, fold(&worm.scene, false))]).is_nan());
}

/// Of a wrong scale, which moves in proportion, a model with half leaves half of what it moves, a quarter of the square.
#[test]
fn half_the_effect_closes_three_quarters_of_the_gap() {
    let [whole, half] = [&[1.04], &[1.02]].map(|scale| Some(("sensor-scale", None, &scale[..])));
    let recordings = record(&Campaign::default(), whole, 5);
    let worm = worm(&recordings, &Campaign::default(), &hypothesis(whole));
    let open = taken(&worm, hypothesis(None));
    let closed = |truth: Truth<'_>, discrepancy_m: f64| {
        let left = taken(&worm, hypothesis(truth));
        closed(&worm, (&open, &[]), (&left, &[]), discrepancy_m)
    };
    for (truth, expected) in [(whole, 1.0), (half, 0.75)] {
        let [least, most] = closed(truth, 0.0).expect("it shows");
        assert!(
            least < expected && expected < most && most - least < 0.2,
            "{least} to {most}"
        );
    }
    assert_eq!(closed(half, 1e-3), None, "nothing is seen beside a discrepancy of 1 mm");
}

#[test]
fn the_mean_cycle_follows_the_model_that_made_it() {
    let campaign = Campaign::default();
    let truth = EFFECTS[1];
    let recordings = record(&campaign, truth, 4);
    let worm = worm(&recordings, &campaign, &hypothesis(truth));
    let (baseline, named) = (taken(&worm, hypothesis(None)), taken(&worm, hypothesis(truth)));
    for series in cycles(&worm, &baseline, &baseline, Some(&named)) {
        let off_m = |model_m: &[f64]| {
            let pairs = model_m.iter().zip(&series.measured_m);
            pairs.map(|(model_m, m)| (model_m - m).abs()).fold(0.0, f64::max)
        };
        assert!(off_m(&series.named_m) < 5e-5, "{series:?}");
        assert!(off_m(&series.baseline_m) > 3e-4, "{series:?}");
        assert!((48..=96).contains(&series.phase.len()), "{} bins", series.phase.len());
        assert_eq!(series.baseline_m, series.recalibrated_m);
    }
}

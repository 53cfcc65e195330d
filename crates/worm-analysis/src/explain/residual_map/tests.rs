use super::super::fixture::{Campaign, Truth, hypothesis, record, taken, worm};
use super::{BINS_PER_STEP, MIN_CYCLES, map, places, standard_errors};
use crate::experiment::Simulation;
use crate::explain::answer::{Place, ResidualMap};

fn maps(campaign: &Campaign, truth: Truth<'_>, seed: u64) -> Vec<ResidualMap> {
    let recordings = record(campaign, truth, seed);
    let worm = worm(&recordings, campaign, &hypothesis(None));
    let nominal = taken(&worm, hypothesis(None));
    (0..worm.scene.observed.len())
        .map(|run| map(&worm, run, &nominal))
        .collect()
}

fn found(campaign: &Campaign, truth: Truth<'_>, seed: u64) -> Vec<Place> {
    places(&maps(campaign, truth, seed), 12)
}

fn with(change: impl Fn(&mut Simulation)) -> Campaign {
    let mut campaign = Campaign::default();
    change(&mut campaign.simulation);
    campaign
}

#[test]
fn one_campaign_in_twenty_shows_a_place_by_chance() {
    let kinds = [
        Campaign::default(),
        with(|simulation| simulation.positions_only = true),
        with(|simulation| simulation.cycles = 5.5),
        with(|simulation| simulation.dropout_share = 0.3),
    ];
    for (kind, campaign) in kinds.iter().enumerate() {
        let with_place = (0..20).filter(|&seed| !found(campaign, None, seed).is_empty());
        // More than three of twenty happen in one case of sixty.
        assert!(with_place.count() <= 3, "campaign {kind}");
    }
}

#[test]
fn the_cell_that_is_another_stands_first() {
    let clamping: Truth<'_> = Some(("unequal-clamping", Some(1), &[1.25]));
    let stroke: Truth<'_> = Some(("lost-stroke", Some(2), &[0.06]));
    for (truth, cell, positions_only) in [(clamping, 2, false), (clamping, 2, true), (stroke, 3, false)] {
        let campaign = with(|simulation| simulation.positions_only = positions_only);
        let places = found(&campaign, truth, 3);
        let first = places.first().expect("a place");
        assert_eq!((first.cell, first.stepping_cell), (cell, cell), "{truth:?}: {places:?}");
        assert!(
            places.is_sorted_by(|a, b| a.significance.abs() >= b.significance.abs()),
            "{places:?}"
        );
    }
}

#[test]
fn a_residual_of_the_body_is_listed_for_the_stepping_cell_and_adds_up_to_the_advance() {
    let campaign = Campaign {
        slopes_deg: vec![20.0],
        ..Campaign::default()
    };
    let truth: Truth<'_> = Some(("slope-error", None, &[4.0]));
    let (maps, places) = (maps(&campaign, truth, 5), found(&campaign, truth, 5));
    assert!(!places.is_empty());
    assert!(
        places.iter().all(|place| place.cell == place.stepping_cell),
        "{places:?}"
    );
    let advance_m = |truth: Truth<'_>| {
        let recordings = record(&campaign, truth, 5);
        let at_m = &recordings[0].position_m[0];
        let cycle = (campaign.simulation.rate_hz * 2.5) as usize;
        (at_m[9 * cycle] - at_m[2 * cycle]) / 7.0
    };
    let missed_m = advance_m(truth) - advance_m(None);
    for residual_m in &maps[0].residual_m {
        let sum_m: f64 = residual_m.iter().sum();
        assert!((sum_m / missed_m - 1.0).abs() < 0.1, "{sum_m} for {missed_m}");
    }
}

#[test]
fn neighbouring_bins_are_one_place_and_too_few_cycles_none() {
    let row = |values: &[f64]| values.to_vec();
    let map = ResidualMap {
        slope_deg: 10.0,
        stepping_cell: vec![1, 1, 1, 2, 2],
        phase: vec![0.1, 0.3, 0.5, 0.7, 0.9],
        residual_m: vec![
            row(&[5e-5, 9e-5, 1e-6, 8e-5, -7e-5]),
            row(&[1e-6; 5]),
            row(&[-1e-6; 5]),
            row(&[f64::NAN; 5]),
        ],
        significance: vec![
            row(&[5.0, 9.0, 0.1, 8.0, -7.0]),
            row(&[0.1; 5]),
            row(&[-0.1; 5]),
            row(&[f64::NAN; 5]),
        ],
        limit: 4.0,
    };
    let found: Vec<(usize, usize, f64)> = places(&[map], 9)
        .iter()
        .map(|place| (place.cell, place.stepping_cell, place.significance))
        .collect();
    assert_eq!(found, [(1, 1, 9.0), (1, 2, 8.0), (1, 2, -7.0)]);
    let draws = [vec![1.0, 1.0], vec![-1.0, -1.0]];
    let sigma = standard_errors(&draws, &[MIN_CYCLES - 1, MIN_CYCLES]);
    assert!(sigma[0].is_nan() && sigma[1].is_finite(), "{sigma:?}");
    assert_eq!(maps(&Campaign::default(), None, 1)[0].phase.len(), 4 * BINS_PER_STEP);
}

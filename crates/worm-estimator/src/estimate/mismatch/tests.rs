use super::reference_model::{ALLOWANCES, ReferenceModel};
use super::weighted_mean::WeightedMean;
use super::{BINS, ResidualMap};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_physics::Worm;

const CELLS: usize = 4;
const THRESHOLD_M: f64 = 1.6e-4;
const NOISE_M: f64 = 3e-5;

/// A map of the paper's worm over so many cycles of noise, and what `add` adds to step, bin and cell.
fn map_of(cycles: usize, seed: u64, add: impl Fn(usize, usize, usize) -> f64) -> ResidualMap {
    let mut map = ResidualMap::new(CELLS, THRESHOLD_M);
    map.clear(1, &ReferenceModel::new(&Worm::paper()));
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    for _ in 0..cycles {
        let increments_m: Vec<f64> = (0..map.size())
            .map(|index| {
                let noise: f64 = StandardNormal.sample(&mut random);
                let bin = index / CELLS;
                NOISE_M * noise + add(bin / BINS, bin % BINS, index % CELLS)
            })
            .collect();
        map.add(&increments_m);
    }
    map
}

/// The standard error says how far the mean is off, with a step on the way or without.
#[test]
fn a_tally_knows_how_well_it_knows() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut squares = 0.0;
    const TALLIES: usize = 4000;
    for _ in 0..TALLIES {
        let mut mean = WeightedMean::default();
        for _ in 0..30 {
            let value: f64 = StandardNormal.sample(&mut random);
            mean.add(2.0 + value);
        }
        let known = mean.known(1.0).expect("enough values");
        squares += ((known.mean - 2.0) / known.sigma).powi(2);
    }
    let ratio = squares / TALLIES as f64;
    assert!((0.9..1.1).contains(&ratio), "{ratio}");
    let mut stepped = WeightedMean::default();
    (0..20).for_each(|index| stepped.add(if index < 12 { 0.0 } else { 1.0 }));
    let known = stepped.known(0.0).expect("enough values");
    assert!(known.mean > 0.6 && known.sigma < 0.1, "{known:?}");
}

#[test]
fn fewer_than_four_cycles_tell_nothing() {
    for cycles in 0..4 {
        let map = map_of(cycles, 1, |_, _, _| 1e-3);
        assert_eq!((map.unexplained(THRESHOLD_M), map.entries().count()), (None, 0));
    }
    assert_eq!(map_of(4, 1, |_, _, _| 0.0).entries().count(), CELLS * BINS * CELLS);
}

/// What is just at the threshold everywhere is significant in no more maps than the family's share.
#[test]
fn the_family_keeps_its_share_of_false_alarms() {
    const MAPS: u64 = 2000;
    let at_threshold =
        |step: usize, bin: usize, _: usize| THRESHOLD_M * if (step + bin).is_multiple_of(2) { 1.0 } else { -1.0 };
    let alarms = (0..MAPS)
        .filter(|&seed| {
            let map = map_of(4 + seed as usize % 20, seed, at_threshold);
            map.unexplained(THRESHOLD_M).is_some_and(|found| found.is_significant)
        })
        .count();
    println!("{alarms} of {MAPS}");
    assert!(alarms as u64 <= MAPS / 20, "{alarms} of {MAPS}");
}

/// What all cells show is named by the stepping one, what one shows by itself by that one; small ways in every step add up.
#[test]
fn the_place_is_where_it_is() {
    type Add = fn(usize, usize, usize) -> f64;
    type StepAndBin = Option<(usize, usize)>;
    let cases: [(Add, usize, StepAndBin); 3] = [
        (
            |step, bin, _| if (step, bin) == (2, 1) { 4e-4 } else { 0.0 },
            2,
            Some((2, 1)),
        ),
        (
            |step, bin, cell| if (step, bin, cell) == (2, 1, 0) { 4e-4 } else { 0.0 },
            0,
            Some((2, 1)),
        ),
        (|_, bin, _| if bin == 1 { 8e-5 } else { 0.0 }, 0, None),
    ];
    for (index, (add, cell, place)) in cases.into_iter().enumerate() {
        let found = map_of(8, 5, add).unexplained(THRESHOLD_M).expect("enough cycles");
        assert!(found.is_significant && !found.is_within, "{index}: {found:?}");
        let at = found.at;
        match place {
            Some((stepping, bin)) => {
                assert_eq!((at.cell, at.stepping_cell, at.bin), (cell, stepping, bin), "{index}");
                assert!((at.phase - (stepping as f64 + (bin as f64 + 0.5) / 4.0) / 4.0).abs() < 1e-12);
                assert!((found.excess_m - 4e-4).abs() < 6e-5, "{index}: {found:?}");
            }
            None => {
                assert_eq!((at.cell, at.bin), (at.stepping_cell, 1), "{index}");
                assert!((found.excess_m - 3.2e-4).abs() < 5e-5, "{index}: {found:?}");
            }
        }
    }
}

/// A stroke off within the limit is taken off the map; the rest of a larger one stays.
#[test]
fn a_small_deviation_of_the_stroke_is_allowed_for() {
    let mut effect_m = vec![0.0; CELLS * BINS * CELLS];
    ReferenceModel::new(&Worm::paper()).effect_of(&ALLOWANCES[0], &mut effect_m);
    let with_fraction = |fraction: f64| {
        let map = map_of(12, 3, |step, bin, cell| {
            fraction * effect_m[(step * BINS + bin) * CELLS + cell]
        });
        map.unexplained(THRESHOLD_M).expect("enough cycles")
    };
    let undisturbed = with_fraction(-0.015);
    assert!(
        undisturbed.is_within && undisturbed.excess_m.abs() < 5e-5,
        "{undisturbed:?}"
    );
    let long = with_fraction(0.06);
    // 4 % of 11.5 mm, once a cycle for each cell.
    assert!(long.is_significant && (long.excess_m - 4.6e-4).abs() < 3e-5, "{long:?}");
}

/// 40 mm a cycle are forgotten as soon as four cycles fit the model; what goes on, or comes back, is not.
#[test]
fn what_is_over_is_forgotten() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(4);
    let mut map = map_of(12, 4, |_, bin, _| if bin == 1 { 1e-2 } else { 0.0 });
    let mut add_cycle = |map: &mut ResidualMap, more_m: f64| {
        let increments_m: Vec<f64> = (0..map.size())
            .map(|_| {
                let noise: f64 = StandardNormal.sample(&mut random);
                NOISE_M * noise + more_m
            })
            .collect();
        map.add(&increments_m);
        let found = map.unexplained(THRESHOLD_M).expect("enough cycles");
        (found.is_significant, found.is_within)
    };
    for _ in 0..3 {
        assert!(!add_cycle(&mut map, 0.0).1, "three cycles are not enough");
    }
    assert_eq!(add_cycle(&mut map, 0.0), (false, true));
    // One cycle in four goes on as before: nothing is over.
    let mut map = map_of(12, 5, |_, bin, _| if bin == 1 { 1e-2 } else { 0.0 });
    for cycle in 0..24 {
        let more_m = if cycle % 4 == 3 { 2.5e-3 } else { 0.0 };
        assert!(!add_cycle(&mut map, more_m).1, "cycle {cycle}");
    }
}

/// What identified bounds leave uncertain is added to the threshold, three standard errors of it.
#[test]
fn uncertain_bounds_are_allowed_for() {
    let model = ReferenceModel::new(&Worm::paper());
    let found = |sigma_m: f64| {
        let mut map = map_of(20, 6, |_, bin, _| if bin == 1 { 1e-4 } else { 0.0 });
        map.set_uncertainty(&model, |weights| {
            sigma_m * weights.iter().map(|weight| weight * weight).sum::<f64>().sqrt()
        });
        map.unexplained(THRESHOLD_M).expect("enough cycles")
    };
    // 0.1 mm in each of four steps.
    let known = found(0.0);
    assert!(known.is_significant && !known.is_within && (known.excess_m - 4e-4).abs() < 5e-5);
    assert!((known.allowed_m - THRESHOLD_M).abs() < 1e-12);
    // With bounds off by 0.05 mm at each tip the advance of a cycle may be off by a fifth of a millimetre.
    let uncertain = found(5e-5);
    assert!(
        uncertain.is_within && !uncertain.is_significant && uncertain.allowed_m < 8e-4,
        "{uncertain:?}"
    );
}

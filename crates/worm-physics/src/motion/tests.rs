//! What must hold for every worm, on worms drawn at random.

mod brute_force;

use super::Motion;
use crate::{Contact, Ledger, Worm};
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// A fraction of the lengths, forces or energies involved that counts as rounding.
pub(crate) const ROUNDING: f64 = 1e-9;

fn any_contact() -> impl Strategy<Value = Contact> {
    (100.0..3000.0, 0.0..4e-3, 0.0..4e-3).prop_map(|(stiffness_n_per_m, forward_bound_m, backward_bound_m)| Contact {
        stiffness_n_per_m,
        forward_bound_m,
        backward_bound_m,
    })
}

/// Unequal worms, light and heavy, from straight down to straight up.
fn any_worm() -> impl Strategy<Value = Worm> {
    (2usize..=16).prop_flat_map(|cells| {
        (
            prop::collection::vec(any_contact(), cells),
            prop::collection::vec(0.0..0.1f64, cells).prop_filter("no mass", |masses| masses.iter().sum::<f64>() > 0.0),
            prop::collection::vec(prop_oneof![4 => Just(1.0), 1 => 0.0..=1.0f64], cells),
            Just((0..cells).collect::<Vec<_>>()).prop_shuffle(),
            1e-3..20e-3,
            prop_oneof![1 => Just(0.0), 4 => -FRAC_PI_2..=FRAC_PI_2],
            prop_oneof![3 => Just(0.0), 1 => -0.5..0.5],
        )
            .prop_map(
                move |(contacts, masses, scales, order, stroke_m, slope_rad, resisting_force_n)| {
                    let mut worm = Worm::uniform(cells, contacts[0], 1.0, stroke_m)
                        .and_then(|worm| worm.with_masses_kg(&masses))
                        .and_then(|worm| worm.with_step_order(&order))
                        .and_then(|worm| worm.with_slope_rad(slope_rad))
                        .and_then(|worm| worm.with_resisting_force_n(resisting_force_n))
                        .expect("drawn in range");
                    for (cell, (contact, scale)) in contacts.into_iter().zip(scales).enumerate() {
                        worm = worm
                            .with_contact(cell, contact)
                            .and_then(|worm| worm.with_stroke_scale(cell, scale))
                            .expect("drawn in range");
                    }
                    worm
                },
            )
    })
}

/// Symmetric worms, in which many tips reach their bounds at once.
fn any_even_worm() -> impl Strategy<Value = Worm> {
    (
        2usize..=16,
        0.0..4e-3,
        1e-3..20e-3,
        prop_oneof![Just(0.0), -FRAC_PI_2..=FRAC_PI_2],
    )
        .prop_map(|(cells, bound_m, stroke_m, slope_rad)| {
            Worm::uniform(cells, Contact::symmetric(980.0, bound_m), 0.08 * cells as f64, stroke_m)
                .and_then(|worm| worm.with_slope_rad(slope_rad))
                .expect("drawn in range")
        })
}

pub(crate) fn worms() -> impl Strategy<Value = Worm> {
    prop_oneof![2 => any_worm(), 1 => any_even_worm()]
}

fn at_rest(worm: &Worm) -> Motion {
    let positions_m: Vec<f64> = (0..worm.cells()).map(|cell| -0.04 * cell as f64).collect();
    Motion::at_rest(worm, &positions_m)
}

/// Largest force the contacts could exert, N.
pub(crate) fn scale_n(worm: &Worm) -> f64 {
    worm.contacts()
        .iter()
        .map(|contact| {
            contact.stiffness_n_per_m * (contact.forward_bound_m + contact.backward_bound_m + worm.stroke_m())
        })
        .sum()
}

/// Bounds, force balance and energy balance at one instant.
fn check_instant(worm: &Worm, motion: &Motion, elastic_at_start_j: f64) -> Result<(), TestCaseError> {
    for (contact, &deformation_m) in worm.contacts().iter().zip(motion.deformations_m()) {
        prop_assert!(deformation_m <= contact.forward_bound_m && deformation_m >= -contact.backward_bound_m);
    }
    prop_assert!(motion.unbalanced_force_n(worm).abs() <= ROUNDING * scale_n(worm));
    let ledger = motion.ledger();
    let elastic_j = motion.elastic_energy_j(worm) - elastic_at_start_j;
    let open_j = ledger.actuator_net_j - ledger.loss_j() - ledger.settling_loss_j - elastic_j;
    let scale_j = ledger.actuator_positive_j + scale_n(worm) * worm.stroke_m();
    prop_assert!(
        open_j.abs() <= ROUNDING * scale_j,
        "energy balance open by {open_j} J of {scale_j} J"
    );
    prop_assert!(ledger.actuator_positive_j >= ledger.actuator_net_j.max(0.0) - ROUNDING * scale_j);
    prop_assert!(ledger.sliding_loss_j.iter().all(|&loss_j| loss_j >= 0.0));
    prop_assert!(ledger.settling_loss_j >= -ROUNDING * scale_j);
    prop_assert!(motion.positions_m().iter().all(|position_m| position_m.is_finite()));
    Ok(())
}

fn largest_difference(one: &[f64], other: &[f64]) -> f64 {
    one.iter()
        .zip(other)
        .map(|(one, other)| (one - other).abs())
        .fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn forces_bounds_and_energy_balance_at_every_instant_forward_and_in_reverse(
        worm in worms(),
        increments in prop::collection::vec(prop_oneof![-0.3..0.5f64, -3.0..3.0f64, -1e-9..1e-9f64], 1..60),
    ) {
        let mut motion = at_rest(&worm);
        let elastic_at_start_j = motion.elastic_energy_j(&worm);
        for increment in increments {
            let phase = motion.phase() + increment;
            match motion.advance_to(&worm, phase) {
                Ok(()) => check_instant(&worm, &motion, elastic_at_start_j)?,
                Err(slides) => {
                    prop_assert!(worm.check_hold() == Err(slides));
                    return Ok(());
                }
            }
        }
    }

    #[test]
    fn the_increment_does_not_matter(worm in worms(), cycles in -2.5..2.5f64, increments in 1usize..700) {
        prop_assume!(worm.check_hold().is_ok());
        let (mut once, mut streamed) = (at_rest(&worm), at_rest(&worm));
        once.advance_to(&worm, cycles).expect("it holds");
        for increment in 1..=increments {
            streamed.advance_to(&worm, cycles * increment as f64 / increments as f64).expect("it holds");
        }
        prop_assert!(largest_difference(once.positions_m(), streamed.positions_m()) <= ROUNDING * worm.stroke_m());
        prop_assert!(largest_difference(once.deformations_m(), streamed.deformations_m()) <= ROUNDING * worm.stroke_m());
        let (one, other) = (once.ledger(), streamed.ledger());
        let scale_j = one.actuator_positive_j + scale_n(&worm) * worm.stroke_m();
        prop_assert!((one.loss_j() - other.loss_j()).abs() <= ROUNDING * scale_j);
        prop_assert!((one.actuator_positive_j - other.actuator_positive_j).abs() <= ROUNDING * scale_j);
        prop_assert!((one.deformation_integral_m - other.deformation_integral_m).abs() <= ROUNDING * worm.stroke_m());
    }

    #[test]
    fn relabelling_the_cells_changes_nothing(
        (worm, names) in worms().prop_flat_map(|worm| {
            let names: Vec<_> = (0..worm.cells()).collect();
            (Just(worm), Just(names).prop_shuffle())
        }),
    ) {
        prop_assume!(worm.check_hold().is_ok());
        // Cell `cell` of the worm is called `names[cell]` in the other.
        let order: Vec<_> = worm.step_order().iter().map(|&cell| names[cell]).collect();
        let mut masses = vec![0.0; worm.cells()];
        let mut renamed = Worm::uniform(worm.cells(), worm.contact(0), 1.0, worm.stroke_m())
            .and_then(|renamed| renamed.with_step_order(&order))
            .and_then(|renamed| renamed.with_slope_rad(worm.slope_rad()))
            .and_then(|renamed| renamed.with_resisting_force_n(worm.resisting_force_n()))
            .expect("as valid as the worm");
        for (cell, &name) in names.iter().enumerate() {
            masses[name] = worm.masses_kg()[cell];
            renamed = renamed
                .with_contact(name, worm.contact(cell))
                .and_then(|renamed| renamed.with_stroke_scale(name, worm.stroke_of_m(cell) / worm.stroke_m()))
                .expect("as valid as the worm");
        }
        let renamed = renamed.with_masses_kg(&masses).expect("as valid as the worm");
        let (mut one, mut other) = (at_rest(&worm), at_rest(&renamed));
        one.advance_to(&worm, 2.3).expect("it holds");
        other.advance_to(&renamed, 2.3).expect("it holds");
        for (cell, &name) in names.iter().enumerate() {
            let difference_m = one.deformation_m(cell) - other.deformation_m(name);
            prop_assert!(difference_m.abs() <= ROUNDING * worm.stroke_m());
        }
        let positive_j = |ledger: &Ledger| ledger.actuator_positive_j;
        let scale_j = scale_n(&worm) * worm.stroke_m();
        prop_assert!((positive_j(one.ledger()) - positive_j(other.ledger())).abs() <= ROUNDING * scale_j);
    }

    #[test]
    fn the_crawl_in_reverse_mirrors_the_crawl_forward(worm in worms(), cycles in 0.0..3.0f64) {
        prop_assume!(worm.check_hold().is_ok());
        let mirrored = worm.clone().mirrored();
        let (mut back, mut forward) = (at_rest(&worm), at_rest(&mirrored));
        back.advance_to(&worm, -cycles).expect("it holds");
        forward.advance_to(&mirrored, cycles).expect("it holds");
        for (one, other) in back.deformations_m().iter().zip(forward.deformations_m()) {
            prop_assert!((one + other).abs() <= ROUNDING * worm.stroke_m());
        }
    }

    #[test]
    fn a_changing_worm_stays_in_force_and_energy_balance(
        worm in worms(),
        changes in prop::collection::vec((0.0..3.0f64, 0.0..1.2f64, -1.0..1.0f64, -0.03..0.03f64), 1..12),
    ) {
        prop_assume!(worm.check_hold().is_ok());
        let mut motion = at_rest(&worm);
        let elastic_at_start_j = motion.elastic_energy_j(&worm);
        for (cycles, grip, slope_rad, fall_m) in changes {
            // Friction and slope change; the stiffness does not, or the springs would gain energy from nowhere.
            let mut changed = worm.clone().with_slope_rad(slope_rad).expect("drawn in range");
            for cell in 0..worm.cells() {
                let contact = worm.contact(cell);
                let gripping = Contact {
                    forward_bound_m: grip * contact.forward_bound_m,
                    backward_bound_m: grip * contact.backward_bound_m,
                    ..contact
                };
                changed = changed.with_contact(cell, gripping).expect("drawn in range");
            }
            if changed.check_hold().is_ok() {
                motion.rebalance(&changed).expect("it holds");
                let phase = motion.phase() + cycles;
                motion.advance_to(&changed, phase).expect("it holds");
                check_instant(&changed, &motion, elastic_at_start_j)?;
            } else {
                let before = motion.clone();
                let phase = motion.phase() + cycles;
                prop_assert!(motion.advance_to(&changed, phase).is_err());
                prop_assert_eq!(&motion, &before);
                // It falls the way it is pulled.
                let distance_m = -fall_m.abs() * changed.pull_n().signum();
                motion.translate(&changed, distance_m);
                let fallen_m = largest_difference(motion.positions_m(), before.positions_m());
                prop_assert!((fallen_m - distance_m.abs()).abs() <= ROUNDING);
                let ledger = motion.ledger();
                let elastic_j = motion.elastic_energy_j(&changed) - elastic_at_start_j;
                let open_j = ledger.actuator_net_j - ledger.loss_j() - ledger.settling_loss_j - elastic_j;
                prop_assert!(open_j.abs() <= ROUNDING * (ledger.actuator_positive_j + scale_n(&changed)));
            }
        }
    }

    #[test]
    fn a_jammed_cell_lags_and_resumes_from_where_it_was(cell in 0usize..4) {
        let jammed = Worm::paper().with_stroke_scale(cell, 0.0).expect("in range");
        let mut motion = at_rest(&jammed);
        let offset_m = |motion: &Motion| motion.positions_m()[cell] - motion.positions_m()[(cell + 1) % 4];
        let before_m = offset_m(&motion);
        motion.advance_to(&jammed, 1.0).expect("it holds");
        let lagging_m = offset_m(&motion);
        prop_assert!((before_m - lagging_m - 11.5e-3).abs() < 1e-12);
        motion.advance_to(&Worm::paper(), 3.0).expect("it holds");
        prop_assert!((offset_m(&motion) - lagging_m).abs() < 1e-12);
    }
}

#[test]
fn streaming_allocates_nothing() {
    let worm = Worm::paper();
    let mut motion = at_rest(&worm);
    let allocated = allocation_counter::measure(|| {
        for tick in 1..=5000 {
            motion.advance_to(&worm, f64::from(tick) / 2500.0).expect("it holds");
        }
        motion.rebalance(&worm).expect("it holds");
        motion.translate(&worm, -1e-3);
    });
    assert_eq!(allocated.count_total, 0);
}

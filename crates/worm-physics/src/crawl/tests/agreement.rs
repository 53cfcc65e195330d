//! Wherever both motions apply they are the same motion.

use super::{effect, of_cell};
use crate::effect::Setting;
use crate::{Contact, Crawl, Ledger, Mechanics, Motion, Physics, Worm};
use proptest::prelude::*;

/// Positions, deformations and slides, m.
const SAME_M: f64 = 1e-9;
/// Energies, as a share of the largest: work is booked in straight lines, so the incremental motion goes in small parts.
const SAME_FRACTION: f64 = 1e-4;
const PARTS_OF_STEP: usize = 1000;

/// Unequal worms on any slope that they hold on, with whatever the exact motion knows.
fn physics() -> impl Strategy<Value = Physics> {
    let cells = 2usize..7;
    let worm = cells.prop_flat_map(|cells| {
        let contacts = prop::collection::vec((300.0..2000.0, 2e-4..2.5e-3), cells);
        let order = Just((0..cells).collect::<Vec<_>>()).prop_shuffle();
        (contacts, order, -40.0..40.0f64).prop_map(|(contacts, order, slope_deg)| {
            let contact = |(stiffness, bound_m): (f64, f64)| Contact::symmetric(stiffness, bound_m);
            let mass_kg = 0.08 * contacts.len() as f64;
            let mut worm = Worm::uniform(contacts.len(), contact(contacts[0]), mass_kg, 11.5e-3).expect("a worm");
            for (cell, &values) in contacts.iter().enumerate() {
                worm = worm.with_contact(cell, contact(values)).expect("a contact");
            }
            let worm = worm.with_step_order(&order).expect("an order");
            worm.with_slope_rad(slope_deg.to_radians()).expect("a slope")
        })
    });
    let effects = (
        0.5..1.5,
        0.5..1.5,
        0.6..1.4,
        -0.3..0.3,
        -0.05..0.1,
        -0.2..0.5,
        -0.3..0.3,
        0usize..2,
    );
    (worm, effects).prop_map(|(worm, (clamp, stiff, back, drag, mass, lost, slope, cell))| {
        let effects: [Setting; 7] = [
            of_cell("unequal-clamping", Some(cell), &[clamp]),
            of_cell("unequal-stiffness", Some(1 - cell), &[stiff]),
            effect("directional-friction", &[back]),
            effect("constant-drag", &[drag]),
            effect("payload", &[mass]),
            of_cell("lost-stroke", Some(cell), &[lost]),
            effect("slope-clamping", &[slope]),
        ];
        Physics::of(worm).with(&effects)
    })
}

fn energies(ledger: &Ledger) -> [f64; 5] {
    [
        ledger.sliding_loss_j.iter().sum(),
        ledger.weight_work_j,
        ledger.resisting_work_j,
        ledger.actuator_net_j,
        ledger.actuator_positive_j,
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn exact_and_incremental_motion_are_the_same(physics in physics(), backward in any::<bool>()) {
        let worm = physics.clamped_worm();
        prop_assume!(worm.check_hold().is_ok());
        prop_assert!(physics.is_piecewise_linear());
        let (cells, mechanics) = (worm.cells(), Mechanics::new(&physics));
        let first_m = vec![0.0; cells];
        let mut exact = Motion::at_rest(&worm, &first_m);
        let mut crawl = Crawl::at_rest(&mechanics, 0.0, &first_m, None).expect("it holds");
        let sign = if backward { -1.0 } else { 1.0 };
        for part in 1..=2 * cells * PARTS_OF_STEP {
            let phase = sign * part as f64 / (cells * PARTS_OF_STEP) as f64;
            exact.advance_to(&worm, phase).expect("it holds");
            crawl.advance_to(&mechanics, phase, 1e-3).expect("it holds");
            if part % (PARTS_OF_STEP / 4) != 0 {
                continue;
            }
            for cell in 0..cells {
                let figures = [
                    ("position", exact.positions_m()[cell], crawl.positions_m()[cell]),
                    ("deformation", exact.deformation_m(cell), crawl.deformation_m(cell)),
                    ("forward slide", exact.ledger().forward_slide_m[cell], crawl.ledger().forward_slide_m[cell]),
                    ("backward slide", exact.ledger().backward_slide_m[cell], crawl.ledger().backward_slide_m[cell]),
                ];
                for (what, exact_m, crawl_m) in figures {
                    prop_assert!((exact_m - crawl_m).abs() < SAME_M, "{what} of cell {cell} at {phase}: {exact_m} {crawl_m}");
                }
            }
        }
        let (exact_j, crawl_j) = (energies(exact.ledger()), energies(crawl.ledger()));
        let largest_j = exact_j.iter().fold(0.0, |max: f64, energy_j| max.max(energy_j.abs()));
        for (exact, crawl) in exact_j.iter().zip(&crawl_j) {
            prop_assert!((exact - crawl).abs() < SAME_FRACTION * largest_j, "{exact_j:?} {crawl_j:?}");
        }
    }
}

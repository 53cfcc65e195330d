//! The exact motion against a brute-force simulation.

use super::{ROUNDING, largest_difference};
use crate::{Contact, Motion, Worm};
use proptest::prelude::*;

/// A brute-force worm that shares no code with the model: tips as points that are dragged, and after each small extension
/// a search for the translation at which the body rests.
///
/// The tips are dragged only once the body has come to rest. Extending a cell against a body held still and dragging at
/// once would be a jerky drive: where the stepping cell comes to its bound within less than a jerk but the other cells
/// give way just before, each jerk drags its tip along, though in a slow motion it never slides.
struct Brute<'a> {
    contacts: &'a [Contact],
    pull_n: f64,
    positions_m: Vec<f64>,
    tips_m: Vec<f64>,
}

impl<'a> Brute<'a> {
    /// Laid down unloaded at 0, which the cells still have as their positions after they gave way.
    fn at_rest(contacts: &'a [Contact], pull_n: f64) -> Self {
        let unloaded = vec![0.0; contacts.len()];
        let mut brute = Self {
            contacts,
            pull_n,
            positions_m: unloaded.clone(),
            tips_m: unloaded,
        };
        let farthest_m = contacts.iter().fold(0.0, |farthest_m: f64, contact| {
            farthest_m.max(contact.forward_bound_m).max(contact.backward_bound_m)
        });
        brute.come_to_rest(farthest_m);
        for (position_m, tip_m) in brute.positions_m.iter_mut().zip(&mut brute.tips_m) {
            *tip_m -= *position_m;
            *position_m = 0.0;
        }
        brute
    }

    fn extend(&mut self, cell: usize, extension_m: f64) {
        self.positions_m[cell] += extension_m;
        self.come_to_rest(extension_m.abs());
    }

    /// Translates the body by at most `reach_m` to where the forces balance; they never fall as the body moves up.
    fn come_to_rest(&mut self, reach_m: f64) {
        let (mut low_m, mut high_m) = (-reach_m, reach_m);
        for _ in 0..60 {
            let middle_m = 0.5 * (low_m + high_m);
            if self.force_n(middle_m) > 0.0 {
                high_m = middle_m;
            } else {
                low_m = middle_m;
            }
        }
        for (cell, contact) in self.contacts.iter().enumerate() {
            self.positions_m[cell] += 0.5 * (low_m + high_m);
            let (rearmost_m, foremost_m) = (
                self.positions_m[cell] - contact.forward_bound_m,
                self.positions_m[cell] + contact.backward_bound_m,
            );
            self.tips_m[cell] = self.tips_m[cell].clamp(rearmost_m, foremost_m);
        }
    }

    /// The pull and the forces of the tips, were the body translated from where it is.
    fn force_n(&self, translation_m: f64) -> f64 {
        let tips = self.contacts.iter().zip(&self.positions_m).zip(&self.tips_m);
        tips.map(|((contact, position_m), tip_m)| {
            let stretch_m = position_m + translation_m - tip_m;
            contact.stiffness_n_per_m * stretch_m.clamp(-contact.backward_bound_m, contact.forward_bound_m)
        })
        .sum::<f64>()
            + self.pull_n
    }
}

/// A pull on a worm of symmetric contacts that steps in the given sense.
#[derive(Debug, Clone)]
enum Pull {
    /// This share of what the tips hold at most.
    Share(f64),
    /// So much more, N, than the pull at which the others just hold against this cell sliding in its step.
    FromLimit(prop::sample::Index, f64),
}

fn any_pull() -> impl Strategy<Value = Pull> {
    prop_oneof![
        1 => (-0.9..0.9f64).prop_map(Pull::Share),
        1 => (any::<prop::sample::Index>(), -7.0..-1.0f64, any::<bool>()).prop_map(|(cell, magnitude, above)| {
            let excess_n = 10f64.powf(magnitude);
            Pull::FromLimit(cell, if above { excess_n } else { -excess_n })
        }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn a_brute_force_simulation_agrees(
        cells in prop::collection::vec((300.0..2000.0f64, 0.5e-3..3e-3f64), 3..7),
        stroke_m in 4e-3..15e-3,
        pull in any_pull(),
        reverse in any::<bool>(),
    ) {
        let n = cells.len();
        let sign = if reverse { -1.0 } else { 1.0 };
        let friction_n: Vec<f64> = cells.iter().map(|(stiffness_n_per_m, bound_m)| stiffness_n_per_m * bound_m).collect();
        let hold_n: f64 = friction_n.iter().sum();
        // With this pull all tips can slide at once, the stepping cell's one way and the others' the other way.
        let limit_n = |cell: usize| sign * (hold_n - 2.0 * friction_n[cell]);
        let pull_n = match pull {
            Pull::Share(fraction) => fraction * hold_n,
            Pull::FromLimit(cell, excess_n) => limit_n(cell.index(n)) + excess_n,
        };
        // Just there the motion jumps from the cell sliding to the others giving way, and anything between is a balance.
        prop_assume!((0..n).all(|cell| (pull_n - limit_n(cell)).abs() > ROUNDING * hold_n));
        let worm = Worm::uniform(n, Contact::symmetric(500.0, 1e-3), 0.1, stroke_m).expect("valid");
        let worm = (0..n)
            .try_fold(worm, |worm, cell| worm.with_contact(cell, Contact::symmetric(cells[cell].0, cells[cell].1)))
            .and_then(|worm| worm.with_resisting_force_n(pull_n))
            .expect("valid");

        let mut motion = Motion::at_rest(&worm, &vec![0.0; n]);
        let mut brute = Brute::at_rest(worm.contacts(), pull_n);
        let small_steps = 100;
        for step in 0..2 * n {
            let stepping = if reverse { n - 1 - step % n } else { step % n };
            for _ in 0..small_steps {
                brute.extend(stepping, sign * stroke_m / f64::from(small_steps));
            }
            motion.advance_to(&worm, sign * (step + 1) as f64 / n as f64).expect("it holds");
            let difference_m = largest_difference(motion.positions_m(), &brute.positions_m);
            prop_assert!(difference_m <= ROUNDING * stroke_m, "{difference_m} m after step {step}");
        }
    }
}

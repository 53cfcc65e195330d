//! What must hold for every worm, on worms drawn at random, and the model against a brute-force simulation.

use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;
use worm_physics::{Contact, Ledger, Motion, Outcome, Worm, steady_cycle};

/// A share of the lengths, forces or energies at play that counts as rounding.
const ROUNDING: f64 = 1e-9;

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

fn worms() -> impl Strategy<Value = Worm> {
    prop_oneof![2 => any_worm(), 1 => any_even_worm()]
}

fn at_rest(worm: &Worm) -> Motion {
    let positions_m: Vec<f64> = (0..worm.cells()).map(|cell| -0.04 * cell as f64).collect();
    Motion::at_rest(worm, &positions_m)
}

/// Cycles that the slowest loading can take before the crawl is periodic. A cell whose stroke is a little shorter than
/// another's lags behind it by that little in each cycle, and both load until one of their tips slides.
fn cycles_of_loading(worm: &Worm) -> f64 {
    let range_m = |cell: usize| worm.contact(cell).forward_bound_m + worm.contact(cell).backward_bound_m;
    let pairs = (0..worm.cells()).flat_map(|one| (0..one).map(move |other| (one, other)));
    pairs
        .map(|(one, other)| {
            (
                range_m(one) + range_m(other),
                worm.stroke_of_m(one) - worm.stroke_of_m(other),
            )
        })
        .filter(|&(_, lag_m)| lag_m != 0.0)
        .map(|(range_m, lag_m)| range_m / lag_m.abs())
        .fold(0.0, f64::max)
}

/// Largest force the contacts could exert, N.
fn scale_n(worm: &Worm) -> f64 {
    worm.contacts()
        .iter()
        .map(|contact| {
            contact.stiffness_n_per_m * (contact.forward_bound_m + contact.backward_bound_m + worm.stroke_m())
        })
        .sum()
}

/// Bounds, balance and the closing of the account, at one instant.
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
        "account open by {open_j} J of {scale_j} J"
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
    fn balance_bounds_and_account_hold_at_every_instant_forward_and_in_reverse(
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
    fn losses_equal_net_actuator_work_over_a_steady_cycle(worm in worms()) {
        // The search for the periodic crawl ends after 10 000 cycles, by design also where the tips still load.
        prop_assume!(cycles_of_loading(&worm) < 10_000.0);
        let outcome = steady_cycle(&worm);
        let Outcome::Steady(cycle) = &outcome else {
            prop_assert!(worm.check_hold().is_err());
            return Ok(());
        };
        prop_assert!(cycle.closure_m <= 1e-11 * worm.stroke_m(), "{} after {}", cycle.closure_m, cycle.cycles_to_steady);
        let scale_j = scale_n(&worm) * worm.stroke_m();
        prop_assert!((cycle.energy_loss_j - cycle.energy_actuator_net_j).abs() <= ROUNDING * scale_j);
        prop_assert!(cycle.progresses == (cycle.advance_m > 1e-9 * worm.stroke_m()));
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
    fn a_changing_worm_keeps_balance_and_account(
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

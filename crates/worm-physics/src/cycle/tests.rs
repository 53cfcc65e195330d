use super::{Outcome, steady_cycle};
use crate::Worm;
use crate::motion::tests::{ROUNDING, scale_n, worms};
use proptest::prelude::*;

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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

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
}

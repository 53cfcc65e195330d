//! Invariants of the monitor for any input.

use super::super::{AlarmMonitor, Observation};
use super::worm::{Bench, blank_cycle, blank_estimate};
use crate::config::{Battery, Config};
use crate::message::{AlarmKind, State};
use proptest::prelude::*;

/// Any number, the awkward ones often.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0_f64,
        1 => any::<f64>(),
        1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, f64::MAX]),
    ]
}

type Tick = (Vec<f64>, [u32; 7], u64, u64, bool, bool);

fn tick() -> impl Strategy<Value = Tick> {
    (
        prop::collection::vec(number(), 24),
        [0..8_u32, 0..12, 0..2, 0..2, 0..256, 0..u32::MAX, 0..3],
        prop_oneof![8 => 0..20_000_000_u64, 1 => any::<u64>()],
        prop_oneof![8 => 0..3_u64, 1 => any::<u64>()],
        any::<bool>(),
        any::<bool>(),
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn invariants_hold_for_any_input(ticks in prop::collection::vec(tick(), 1..120), cells in 2..=16_usize) {
        let mut config = Config::default();
        config.worm.cells = cells;
        config.worm.step_order = (1..=cells).collect();
        config.estimator.calibration_cycles = 1;
        config.battery = Some(Battery {
            capacity_j: 100.0,
            ..Battery::default()
        });
        let mut monitor = AlarmMonitor::new(&config);
        let mut state = State::unknown(cells);
        let (mut numbered, mut mask) = (0, 0);
        for (numbers, codes, time_ns, count, sampled, ended) in ticks {
            state.time_ns = state.time_ns.wrapping_add(time_ns);
            state.sequence = state.sequence.wrapping_add(count);
            state.sample = state.sample.wrapping_add(count);
            state.link_failures = state.link_failures.wrapping_add(count);
            [state.phase, state.goal_velocity_rad_s, state.motor_current_a, state.motor_duty] =
                [numbers[0], numbers[1], numbers[2], numbers[3]];
            [state.bus_voltage_v, state.motor_temperature_c] = [numbers[4], numbers[5]];
            state.position_m.copy_from_slice(&numbers[6..22]);
            [state.mode, state.fault, state.motor_is_new, state.sample_is_new] = [codes[0], codes[1], codes[2], codes[3]];
            [state.hardware_error, state.valid_mask] = [codes[4] & codes[6], codes[5]];
            let mut estimate = blank_estimate(cells);
            estimate.position_m.copy_from_slice(&numbers[6..22]);
            let mut cycle = blank_cycle(cells);
            [cycle.duration_s, cycle.energy_electrical_j, cycle.energy_loss_j] = [numbers[22], numbers[23], numbers[7]];
            [cycle.predicted_energy_loss_j, cycle.predicted_advance_m, cycle.advance_m] = [numbers[8], numbers[9], numbers[10]];
            let changes = monitor.update(&Observation {
                state: &state,
                estimate: sampled.then_some(&estimate),
                cycle: ended.then_some(&cycle),
                residuals: None,
                inferred: None,
            });
            for alarm in &changes {
                prop_assert_eq!(alarm.sequence, numbered);
                numbered += 1;
                prop_assert!(alarm.value.is_finite() && alarm.threshold.is_finite());
                prop_assert!(alarm.since_ns <= alarm.time_ns || alarm.raised == 0);
                let bit = 1 << alarm.kind;
                prop_assert_eq!(mask & bit == 0, alarm.raised == 1, "raised and cleared take turns");
                mask ^= bit;
            }
            prop_assert_eq!(mask, monitor.raised_mask());
            let fraction = monitor.battery_fraction();
            prop_assert!(fraction.is_nan() || (0.0..=1.0).contains(&fraction));
        }
    }
}

#[test]
fn an_update_allocates_nothing() {
    let mut bench = Bench::new(Config::default(), 1);
    bench.crawl_cycles(5.0);
    bench.changes.reserve(100);
    let counted = allocation_counter::measure(|| {
        bench.trouble.jammed = Some(1);
        bench.run(5.0);
        bench.restart_controller();
        bench.run(1.0);
    });
    assert_eq!(counted.count_total, 0);
    assert!(
        bench
            .changes
            .iter()
            .any(|alarm| alarm.kind == AlarmKind::JammedCell.code())
    );
}

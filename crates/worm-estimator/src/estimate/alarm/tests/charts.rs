//! The energy chart's false alarms and power, over many charts, each calibrated on three values.

use super::super::cusum::CusumChart;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

fn scattered(random: &mut Xoshiro256PlusPlus, mean: f64, scatter: f64) -> f64 {
    let normal: f64 = StandardNormal.sample(random);
    mean * (1.0 + scatter * normal)
}

#[test]
fn three_values_of_calibration_give_no_false_alarm_in_thousands() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    for scatter in [0.005, 0.01, 0.03, 0.05] {
        let mut alarms = 0;
        for _ in 0..200 {
            let mut chart = CusumChart::new(0.2, 3);
            let told = (0..2000).any(|_| {
                let value = scattered(&mut random, 1.5, scatter);
                chart.add(value, 0.0, 0.0, 0).is_some_and(|level| level.beyond)
            });
            alarms += u32::from(told);
        }
        println!("scatter {scatter}: {alarms} of 200 charts alarmed in 2000 cycles each");
        assert!(alarms <= 2, "scatter {scatter}: {alarms} of 200 charts");
    }
}

#[test]
fn the_configured_shift_is_told_within_few_cycles() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(6);
    for (scatter, shift, max) in [(0.01, 1.2, 3.5), (0.03, 1.2, 5.0), (0.01, 1.4, 2.5), (0.03, 1.4, 2.5)] {
        let mut cycles = 0;
        for _ in 0..500 {
            let mut chart = CusumChart::new(0.2, 3);
            for _ in 0..15 {
                chart.add(scattered(&mut random, 1.0, scatter), 0.0, 0.0, 0);
            }
            cycles += (1..200)
                .find(|_| {
                    let value = scattered(&mut random, shift, scatter);
                    chart.add(value, 0.0, 0.0, 0).is_some_and(|level| level.beyond)
                })
                .unwrap_or(200);
        }
        let mean = f64::from(cycles) / 500.0;
        println!("scatter {scatter}, {shift} × usual: {mean:.2} cycles");
        assert!(mean <= max, "scatter {scatter}, {shift} × usual: {mean} cycles");
    }
}

/// One outlier does nothing, neither among the calibration nor later, however large.
#[test]
fn one_outlier_is_no_shift() {
    for outlier_at in 0..20 {
        let mut chart = CusumChart::new(0.2, 3);
        for index in 0..40 {
            let value = if index == outlier_at {
                9.0
            } else {
                1.0 + 0.01 * f64::from(index % 3)
            };
            let level = chart.add(value, 0.0, 0.0, 0);
            assert!(
                level.is_none_or(|level| !level.beyond),
                "outlier at {outlier_at}, alarm at {index}"
            );
        }
        assert!(chart.is_calibrated());
    }
}

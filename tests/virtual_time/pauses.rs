//! A computer that pauses: the whole of it, or one of the worm's processes. Through the packet codec at 1 kHz.
//!
//! A pause does not count as silence: no fault, no alarm, and the energies of each cycle stay right, because no time passed for the
//! worm. Real faults are still reported.

use super::accuracy::{QUANTITIES, percent};
use super::harness::{Obeying, config, crawling, wired};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_estimator::message::{AlarmKind, CommandKind, Fault, Mode};
use wormd::link::virtual_worm::Options;
use wormd::soak::{Machine, Paused, Session, Wired};

/// How near the energies of a settled cycle come to the virtual worm's own ledger, %.
const NEAR_PERCENT: f64 = 3.0;
const CYCLES: f64 = 8.0;

/// Crawls with a pause about once a second, drawn from `who` and from so many milliseconds.
fn crawl_with_pauses(seed: u64, who: &[(Paused, std::ops::Range<u64>)]) -> Session<Wired> {
    let config = config(&format!("virtual_worm.seed = {seed}\n"));
    let wired = wired(&config, &Options::default());
    let mut session = crawling(&config, wired, 1000.0);
    session.cycles = Some(Vec::new());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    while session.machine.plant().ledger().cycles().len() < CYCLES as usize {
        session.run_s(rng.random_range(0.2..1.4), |_| {});
        let (paused, ms) = &who[rng.random_range(0..who.len())];
        session.pause(*paused, rng.random_range(ms.clone()));
    }
    session.run_s(0.5, |_| {});
    session
}

#[test]
fn pauses_cost_no_cycle_its_energies_and_raise_nothing() {
    let whole = (Paused::Computer, 20..300);
    let parts = [Paused::Controller, Paused::Worm, Paused::Estimator].map(|part| (part, 20..60));
    let all = [&[whole.clone()][..], &parts].concat();
    let table = [
        ("the whole computer", &[whole][..]),
        ("one process at a time", &parts),
        ("both", &all),
    ];
    for (what, who) in table {
        for seed in 1..=3 {
            let mut session = crawl_with_pauses(seed, who);
            let name = format!("{what}, seed {seed}");
            assert_eq!(
                (session.mode(), session.fault(), session.raised_kinds()),
                (Mode::Crawling, Fault::None, vec![]),
                "{name}"
            );
            let cycles = session.cycles.take().expect("they were asked for");
            let truth = session
                .machine
                .plant()
                .ledger()
                .cycles()
                .iter()
                .cloned()
                .collect::<Vec<_>>();
            let mut settled = 0;
            for cycle in cycles.iter().filter(|cycle| cycle.settled == 1) {
                settled += 1;
                for (quantity, measured, true_value) in &QUANTITIES[..5] {
                    let error = percent(measured(cycle), true_value(&truth[cycle.index as usize]));
                    assert!(
                        error.abs() < NEAR_PERCENT,
                        "{name}, cycle {}: {quantity} {error:+.1} %",
                        cycle.index
                    );
                }
            }
            assert!(settled >= CYCLES as usize - 2, "{name}: {settled} settled cycles");
            let paused_s: f64 = cycles.iter().map(|cycle| cycle.host_paused_s).sum();
            assert!(
                paused_s > 0.1,
                "{name}: cycles with pauses are marked, {paused_s} s in all"
            );
        }
    }
}

#[test]
fn a_stall_in_the_middle_of_pauses_is_told_as_ever() {
    let config = config("");
    for pause in [None, Some(Paused::Computer), Some(Paused::Estimator)] {
        let options = Options {
            faults: vec!["stall@2".parse().expect("a fault")],
            ..Options::default()
        };
        let mut session = crawling(&config, wired(&config, &options), 1000.0);
        session.run_s(1.9, |_| {});
        let began_s = session.machine.crawl_began_s().expect("it crawls");
        let blocked_s = began_s + 2.0;
        if let Some(paused) = pause {
            session.pause(paused, 60);
        }
        let mut stopped_s = f64::NAN;
        session.run_s(0.5, |tick| {
            if stopped_s.is_nan() && tick.state.mode == Mode::Fault.code() {
                stopped_s = tick.state.time_ns as f64 * 1e-9;
            }
        });
        assert_eq!(session.raised_kinds(), [AlarmKind::MotorStall], "{pause:?}");
        // The worm's own time: what the computer paused, the cam stood.
        let paused_s = if pause == Some(Paused::Computer) { 0.060 } else { 0.0 };
        let delay_ms = 1e3 * (stopped_s - paused_s - blocked_s);
        assert!((10.0..100.0).contains(&delay_ms), "{pause:?}: {delay_ms} ms");
    }
}

#[test]
fn a_controller_that_pauses_for_longer_than_the_watchdog_waits_says_so_and_may_crawl_on() {
    for (toml, mode, fault) in [
        ("", Mode::Fault, Fault::HostPaused),
        ("control.resume_after_pause = true\n", Mode::Crawling, Fault::None),
    ] {
        let config = config(toml);
        let mut session = crawling(&config, wired(&config, &Options::default()), 1000.0);
        session.run_s(2.0, |_| {});
        session.pause(Paused::Controller, 150);
        session.run_s(0.2, |_| {});
        assert_eq!(
            session.fault(),
            Fault::HostPaused,
            "the motor was stopped, by the servo"
        );
        session.run_s(4.0, |_| {});
        assert_eq!((session.mode(), session.fault()), (mode, fault), "{toml}");
        assert_eq!(session.raised_kinds(), [], "{toml}");
    }
    // Silence of the line is still the line's.
    let config = config("");
    let mut session = crawling(&config, wired(&config, &Options::default()), 1000.0);
    session.run_s(2.0, |_| {});
    session.pause(Paused::Worm, 1000);
    session.run_s(0.105, |_| {});
    assert_eq!(
        session.fault(),
        Fault::LinkLost,
        "a silent servo is reported within link_timeout_s"
    );
    session.run_s(2.0, |_| {});
    session.command(CommandKind::Reset, 0.0);
}

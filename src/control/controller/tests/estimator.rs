//! Crawling needs an estimator that is alive and keeps up.

use super::*;

#[test]
fn an_estimator_that_has_gone_or_is_stuck_forbids_to_crawl() {
    type Trouble = fn(&mut Rig);
    let table: [(&str, Trouble); 3] = [
        ("killed", |rig| rig.estimator_runs = false),
        ("sends heartbeats, and receives no states", |rig| {
            rig.estimator_stuck_at = Some(rig.state().sequence);
        }),
        ("still has the states of an earlier controller", |rig| {
            rig.estimator_stuck_at = Some(1_000_000);
        }),
    ];
    for (what, trouble) in table {
        let mut rig = Rig::armed("");
        rig.run(100);
        trouble(&mut rig);
        rig.run(3000);
        assert_eq!(
            rig.command(CommandKind::Crawl, 0.0),
            CommandOutcome::NoEstimator,
            "{what}"
        );
        rig.estimator_runs = true;
        rig.estimator_stuck_at = None;
        rig.run(20);
        assert_eq!(
            rig.command(CommandKind::Crawl, 0.0),
            CommandOutcome::Accepted,
            "{what}, and back"
        );

        let mut rig = Rig::crawling("");
        trouble(&mut rig);
        rig.run(490);
        assert_eq!(rig.mode(), Mode::Crawling, "{what}: not yet");
        rig.run(20);
        assert_eq!(rig.controller.fault(), Fault::EstimatorSilent, "{what}");
    }
}

#[test]
fn an_estimator_far_behind_counts_as_silent_and_one_that_lags_a_little_does_not() {
    for (lag_ticks, crawls) in [(100, true), (450, true), (700, false)] {
        let mut rig = Rig::armed("");
        rig.run(1000);
        let mut outcomes = Vec::new();
        for _ in 0..2000 {
            rig.estimator_stuck_at = Some(rig.state().sequence.saturating_sub(lag_ticks));
            outcomes.push(rig.command(CommandKind::Crawl, 0.0));
        }
        let last = &outcomes[1000..];
        let expected = if crawls {
            CommandOutcome::Accepted
        } else {
            CommandOutcome::NoEstimator
        };
        // A crawl that was accepted before the lag showed ends in a fault.
        let faulted = rig.controller.fault() == Fault::EstimatorSilent;
        assert!(
            last.iter().all(|outcome| *outcome == expected) || (!crawls && faulted),
            "{lag_ticks} ticks behind: {:?}",
            rig.mode()
        );
    }
}

#[test]
fn neither_a_silent_tracker_nor_a_pause_of_the_computer_is_the_estimator_s_lag() {
    let mut rig = Rig::crawling("[control]\ntracker_timeout_s = 2.0\n");
    rig.tracker_runs = false;
    rig.run(1500);
    assert_eq!(rig.mode(), Mode::Crawling, "it has nothing to answer");
    rig.tracker_runs = true;
    rig.run(20);
    // It answers after the pause what came before it.
    rig.estimator_stuck_at = Some(rig.state().sequence);
    for _ in 0..5 {
        rig.run(50);
        rig.pause(2000);
    }
    assert_eq!(rig.mode(), Mode::Crawling);
}

//! A trip against a controller that does as it is told, or does not.

use super::*;
use std::path::Path;
use worm_estimator::config::{Battery, OnLinkBack};
use worm_estimator::message::{Command, Fault, FieldAccess, HoldReason, Mode, Reply};

const STEP_NS: u64 = 100_000_000;
const ADVANCE_M: f64 = 6.8e-3;

/// A controller and a worm that goes as far as the model says.
struct Bench {
    guide: Guide,
    now_ns: u64,
    state: State,
    until_ns: u64,
    done: f64,
    cycles_per_s: f64,
    index: u64,
    link: bool,
    /// What the controller says to arm and crawl.
    outcome: CommandOutcome,
    advance_m: f64,
    actions: Vec<Action>,
    commands: u64,
}

impl Bench {
    fn new(trip: Trip, return_home: bool) -> Self {
        let config = Config {
            trip,
            battery: Some(Battery::default()),
            ..Config::default()
        };
        let bench = Workbench::new(&config).expect("the paper's worm");
        let route = Route::from_csv("length_m,slope_deg\n0.05,0\n0.05,0\n", Path::new("route.csv"));
        Self {
            guide: Guide::new(&bench, &config, &route.expect("a route"), return_home, 0).expect("it can be crawled"),
            now_ns: 0,
            state: State::unknown(4),
            until_ns: 0,
            done: 0.0,
            cycles_per_s: 0.0,
            index: 0,
            link: true,
            outcome: CommandOutcome::Accepted,
            advance_m: ADVANCE_M,
            actions: Vec::new(),
            commands: 0,
        }
    }

    fn run(&mut self, seconds: f64) -> &mut Self {
        for _ in 0..(seconds * 10.0) as usize {
            self.step();
        }
        self
    }

    fn step(&mut self) {
        self.now_ns += STEP_NS;
        self.state.sequence += 1;
        self.state.time_ns = self.now_ns;
        let mut is_crawling = self.state.mode == Mode::Crawling.code();
        if is_crawling && self.now_ns > self.until_ns {
            self.rest(HoldReason::TimeLimit);
            is_crawling = false;
        }
        if is_crawling {
            self.done += self.cycles_per_s.abs() * 0.1;
        }
        if self.done >= 1.0 {
            self.done = 0.0;
            self.index += 1;
            let sign = self.cycles_per_s.signum();
            let cycle = Cycle {
                index: self.index,
                end_ns: self.now_ns,
                duration_s: 2.5,
                host_paused_s: 0.0,
                advance_m: sign * self.advance_m,
                advance_sigma_m: 1e-5,
                energy_electrical_j: 0.65,
                settled: 1,
                direction: sign as i32,
                ..Cycle::empty()
            };
            self.guide.note_cycle(&cycle, self.now_ns);
        }
        if self.link {
            self.guide.note_link(self.now_ns);
        }
        self.guide.note_state(&self.state, self.now_ns);
        if let Some(action) = self.guide.next(self.now_ns) {
            self.obey(action);
        }
    }

    fn obey(&mut self, action: Action) {
        self.actions.push(action);
        let until_ns = self.now_ns + (LIMIT_S * 1e9) as u64;
        let mut outcome = CommandOutcome::Accepted;
        match action {
            Action::Arm | Action::Crawl(_) if self.outcome != CommandOutcome::Accepted => outcome = self.outcome,
            Action::Arm => self.state.mode = Mode::Armed.code(),
            Action::Crawl(cycles_per_s) => {
                (self.cycles_per_s, self.until_ns) = (cycles_per_s, until_ns);
                self.state.mode = Mode::Crawling.code();
            }
            Action::Renew if self.state.mode == Mode::Crawling.code() => self.until_ns = until_ns,
            Action::Renew => outcome = CommandOutcome::WrongMode,
            Action::Hold => self.rest(HoldReason::Command),
        }
        self.guide
            .answered(action, Some((outcome, self.state.sequence)), self.now_ns);
    }

    fn rest(&mut self, reason: HoldReason) {
        (self.state.mode, self.state.hold_reason) = (Mode::Holding.code(), reason.code());
    }

    /// Somebody else gives a command.
    fn command(&mut self, kind: CommandKind) -> &mut Self {
        self.give(&Command::new(kind))
    }

    /// Somebody says where along the canal the worm is.
    fn mark(&mut self, position_m: f64, position_sigma_m: f64) -> &mut Self {
        self.give(&Command {
            position_m,
            position_sigma_m,
            ..Command::new(CommandKind::Mark)
        })
    }

    /// What is inferred of a cycle that has just ended, with where dead reckoning has the worm.
    fn infer(&mut self, advance_m: f64, position_m: f64) -> &mut Self {
        self.guide.note_inferred(&Inferred {
            end_ns: self.now_ns,
            phase: self.state.phase,
            cycles: 4.0,
            advance_m,
            advance_sigma_m: 1e-5,
            position_m,
            position_sigma_m: 0.0,
            ..Inferred::empty()
        });
        self
    }

    fn give(&mut self, command: &Command) -> &mut Self {
        self.commands += 1;
        let command = Command {
            sender: ShortText::new("ann"),
            ..*command
        };
        let reply = Reply {
            sequence: self.state.sequence,
            verdict: CommandOutcome::Accepted.code(),
            mode: self.state.mode,
            fault: Fault::None.code(),
            alarm_mask: 0,
        };
        let record = CommandRecord::new(self.commands, (self.now_ns, self.state.phase), false, &command, &reply);
        match CommandKind::try_from(command.kind).expect("a known kind") {
            CommandKind::Hold => self.rest(HoldReason::Command),
            CommandKind::Stop => self.state.mode = Mode::Disarmed.code(),
            CommandKind::Crawl => self.until_ns = u64::MAX,
            _ => {}
        }
        self.guide.note_command(&record, self.now_ns);
        self
    }

    fn order(&mut self, order: Order) -> Result<(), String> {
        self.guide.order(order, ShortText::new("ben"), self.now_ns)
    }

    #[track_caller]
    fn is(&mut self, phase: TripPhase, reason: TripReason) -> &mut Self {
        let status = self.guide.status(self.now_ns);
        assert_eq!(
            (TripPhase::try_from(status.phase), TripReason::try_from(status.reason)),
            (Ok(phase), Ok(reason)),
            "{status:?}"
        );
        self
    }
}

fn trip(link_loss: OnLinkLoss, on_link_back: OnLinkBack) -> Trip {
    Trip {
        link_loss,
        on_link_back,
        link_timeout_s: 2.0,
        ..Trip::default()
    }
}

#[test]
fn out_and_home_by_itself() {
    use TripPhase::{Done, Outbound, Returning};
    let mut bench = Bench::new(Trip::default(), true);
    bench.run(10.0).is(Outbound, TripReason::Started);
    assert_eq!(bench.actions[..2], [Action::Arm, Action::Crawl(0.4)]);
    bench.run(30.0).is(Returning, TripReason::EndOfRoute);
    bench.run(60.0).is(Done, TripReason::Home);
    assert!(bench.guide.is_over() && bench.actions.contains(&Action::Crawl(-0.4)));
    assert_eq!(bench.actions.last(), Some(&Action::Hold));
    assert!(bench.guide.place.m.abs() < ADVANCE_M);

    let mut one_way = Bench::new(Trip::default(), false);
    one_way.run(60.0).is(Done, TripReason::EndOfRoute);
}

#[test]
fn a_lost_link_does_what_is_configured_and_one_that_is_back_no_more() {
    use TripPhase::{Holding, Outbound, Returning};
    for (link_loss, on_link_back, lost, back) in [
        (
            OnLinkLoss::Hold,
            OnLinkBack::Wait,
            (Holding, TripReason::LinkLost),
            (Holding, TripReason::LinkBack),
        ),
        (
            OnLinkLoss::Hold,
            OnLinkBack::GoOn,
            (Holding, TripReason::LinkLost),
            (Outbound, TripReason::LinkBack),
        ),
        (
            OnLinkLoss::Return,
            OnLinkBack::GoOn,
            (Returning, TripReason::LinkLost),
            (Returning, TripReason::LinkLost),
        ),
        (
            OnLinkLoss::Continue,
            OnLinkBack::Wait,
            (Outbound, TripReason::Started),
            (Outbound, TripReason::Started),
        ),
    ] {
        let mut bench = Bench::new(trip(link_loss, on_link_back), true);
        bench.run(12.0).link = false;
        bench.run(1.5).is(Outbound, TripReason::Started);
        bench.run(1.0).is(lost.0, lost.1);
        assert_eq!(bench.guide.status(bench.now_ns).link_is_lost, 1);
        bench.link = true;
        bench.run(1.0).is(back.0, back.1);
    }
}

#[test]
fn whoever_else_commands_makes_it_wait_for_an_operator() {
    use TripPhase::{Holding, Outbound, Returning};
    for (kind, reason) in [
        (CommandKind::Hold, TripReason::HoldCommanded),
        (CommandKind::Stop, TripReason::StopCommanded),
        (CommandKind::Crawl, TripReason::OtherDriver),
    ] {
        let mut bench = Bench::new(Trip::default(), true);
        bench.run(10.0).command(kind).run(5.0).is(Holding, reason);
        let held = bench.actions.len();
        bench.run(5.0);
        assert_eq!(bench.actions.len(), held, "{kind}: it commands nothing");
        let status = bench.guide.status(bench.now_ns);
        assert_eq!((status.needs_operator, status.by.as_str()), (1, "ann"));
        bench.order(Order::Resume).expect("it waits");
        bench.run(1.0).is(Outbound, TripReason::Operator);
        assert!(bench.order(Order::Resume).is_err(), "it does not wait");
        bench.order(Order::Return).expect("there is a way home");
        bench.run(1.0).is(Returning, TripReason::Operator);
    }
    let mut bench = Bench::new(Trip::default(), true);
    bench
        .run(10.0)
        .command(CommandKind::Acknowledge)
        .run(1.0)
        .is(Outbound, TripReason::Started);
}

#[test]
fn alarms_turn_it_back_and_faults_end_it() {
    use TripPhase::{Aborted, Holding, Returning};
    let mut bench = Bench::new(Trip::default(), true);
    bench.run(10.0).rest(HoldReason::Alarm);
    bench.outcome = CommandOutcome::AlarmStands;
    bench.run(3.0).is(Holding, TripReason::Alarm);
    bench.outcome = CommandOutcome::Accepted;
    bench.run(2.0).is(Returning, TripReason::Alarm);
    // On the way home there is nowhere to turn to.
    bench.rest(HoldReason::Alarm);
    bench.run(40.0).is(Holding, TripReason::Alarm);
    assert_eq!(bench.guide.status(bench.now_ns).needs_operator, 1);
    bench.state.mode = Mode::Fault.code();
    bench.run(1.0).is(Aborted, TripReason::Fault);
}

#[test]
fn a_worm_that_does_not_get_ahead_turns_back_or_holds() {
    for (on_stuck, phase) in [
        (OnStuck::Return, TripPhase::Returning),
        (OnStuck::Hold, TripPhase::Holding),
    ] {
        let mut bench = Bench::new(
            Trip {
                on_stuck,
                ..Trip::default()
            },
            true,
        );
        bench.run(10.0).advance_m = 0.5e-3;
        bench.run(15.0).is(phase, TripReason::Stuck);
    }
}

#[test]
fn what_is_refused_suspended_or_gone_ends_or_waits() {
    let mut refused = Bench::new(Trip::default(), true);
    refused.outcome = CommandOutcome::NoEstimator;
    refused.run(20.0).is(TripPhase::Holding, TripReason::Refused);
    refused.run(20.0).is(TripPhase::Aborted, TripReason::Refused);

    // Not called for five seconds, while the controller ran: the crawl has lapsed.
    let mut suspended = Bench::new(Trip::default(), true);
    suspended.run(10.0);
    suspended.now_ns += 5_000_000_000;
    suspended.run(1.0).is(TripPhase::Holding, TripReason::Suspended);

    // As long, but the whole computer paused.
    let mut paused = Bench::new(Trip::default(), true);
    paused.run(10.0);
    paused.now_ns += 5_000_000_000;
    paused.state.host_paused_ns += 5_000_000_000;
    paused.run(1.0).is(TripPhase::Outbound, TripReason::Started);

    let mut gone = Bench::new(Trip::default(), true);
    gone.run(10.0);
    gone.now_ns += 2_500_000_000;
    let action = gone.guide.next(gone.now_ns);
    assert_eq!(action, None);
    gone.is(TripPhase::Aborted, TripReason::ControllerGone);
}

/// Less in the battery never lets it go further.
#[test]
fn energy_decisions_are_monotone() {
    let mut bench = Bench::new(Trip::default(), true);
    bench.run(20.0);
    let range = |share: f64| Range {
        end_ns: bench.now_ns,
        charge_share: share,
        charge_sigma_share: 0.02,
        energy_left_j: (share - 0.1) * 9000.0,
        energy_left_low_j: (share - 0.12) * 9000.0,
        energy_left_high_j: (share - 0.08) * 9000.0,
        ..Range::empty()
    };
    let mut was_due = true;
    for percent in 0..100 {
        let mut guide = bench.guide.clone();
        guide.note_range(&range(f64::from(percent) * 0.01));
        let is_due = guide.is_energy_due(bench.now_ns);
        assert!(was_due || !is_due, "{percent} %");
        was_due = is_due;
    }
    assert!(!was_due);
    let mut empty = bench.guide.clone();
    empty.note_range(&range(0.11));
    assert!(
        empty
            .next(bench.now_ns)
            .is_some_and(|action| action == Action::Crawl(-0.4))
    );
    assert_eq!(empty.phase(), TripPhase::Returning);
    assert!(empty.order(Order::Outbound, ShortText::EMPTY, bench.now_ns).is_err());
}

proptest::proptest! {
    /// Whatever happens: it never crawls once it is over, never leaves its way home by itself, and crawls only on a word of its own.
    #[test]
    fn any_events_keep_the_rules(events in proptest::collection::vec(0..12_u8, 1..120)) {
        let mut bench = Bench::new(trip(OnLinkLoss::Return, OnLinkBack::GoOn), true);
        let mut was_home = false;
        for event in events {
            let mut is_told = false;
            match event {
                0 => drop(bench.command(CommandKind::Hold)),
                1 => drop(bench.command(CommandKind::Crawl)),
                2 => bench.link = !bench.link,
                3 => bench.rest(HoldReason::Alarm),
                4 => bench.rest(HoldReason::TimeLimit),
                5 => bench.outcome = CommandOutcome::AlarmStands,
                6 => bench.outcome = CommandOutcome::Accepted,
                7 => is_told = bench.order(Order::Resume).is_ok(),
                8 => is_told = bench.order(Order::Outbound).is_ok(),
                9 => bench.advance_m = if bench.advance_m < 1e-3 { ADVANCE_M } else { 1e-4 },
                _ => {}
            }
            let waits = bench.guide.wait == Some(Wait::Operator);
            let was_over = bench.guide.over.is_some();
            let given = bench.actions.len();
            bench.run(2.0);
            let crawls = bench.actions[given..].iter().any(|action| matches!(action, Action::Crawl(_) | Action::Renew));
            proptest::prop_assert!(!(crawls && (was_over || waits)), "it crawls after {event}");
            let is_home = bench.guide.heading == Heading::Home;
            proptest::prop_assert!(is_home || !was_home || is_told, "it left its way home after {event}");
            was_home = is_home;
        }
    }
}

/// A bench whose worm nobody sees, and which stands at a whole gait phase.
fn unseen() -> Bench {
    let mut bench = Bench::new(Trip::default(), true);
    (bench.advance_m, bench.state.phase) = (f64::NAN, 0.0);
    bench
}

#[test]
fn a_worm_that_nobody_sees_goes_as_far_as_its_current_says_and_a_mark_knows_better() {
    let mut bench = unseen();
    bench.infer(f64::NAN, 1.0).run(7.8);
    let model_m = bench.guide.place.m / 3.0;
    assert!((model_m - ADVANCE_M).abs() < 1e-4, "by the model alone: {model_m} m");
    // A tenth less than the model's, from here on.
    let halfway_m = bench.guide.place.m;
    bench.infer(0.9 * model_m, 1.02).run(5.0);
    let (place_m, sigma_m) = (bench.guide.place.m, bench.guide.place.sigma_m());
    // The cycle that shows it is still counted as before.
    let expected_m = halfway_m + 1.9 * model_m;
    assert!((place_m - expected_m).abs() < 1e-5, "{place_m}, {expected_m}");
    assert!((0.001..0.01).contains(&sigma_m), "{sigma_m}");
    bench.mark(1.040, 1e-5);
    assert!((bench.guide.place.m - 0.040).abs() < 1e-6);
    assert!(bench.guide.place.sigma_m() <= 1e-5);
    // A mark that is no better than what is known hardly moves it.
    bench.mark(1.060, 10.0);
    assert!((bench.guide.place.m - 0.040).abs() < 1e-6);
    bench.run(100.0).is(TripPhase::Done, TripReason::Home);
}

#[test]
fn a_mark_at_home_says_where_home_is_and_a_worm_that_is_seen_needs_none() {
    let mut bench = unseen();
    bench.infer(ADVANCE_M, 1.0).run(0.2);
    bench.mark(7.0, 1e-5).run(7.6);
    assert!((bench.guide.place.m - 3.0 * ADVANCE_M).abs() < 1e-3);
    bench.mark(7.018, 1e-5);
    assert!((bench.guide.place.m - 0.018).abs() < 1e-4);
    // The tracker is back.
    bench.advance_m = ADVANCE_M;
    bench.run(2.5);
    let place_m = bench.guide.place.m;
    bench.mark(7.0, 1e-5);
    assert_eq!(bench.guide.place.m, place_m);
}

/// Whoever reads the topic counts the gaps in these numbers as lost messages.
#[test]
fn only_what_is_published_has_a_number_of_its_own() {
    let mut bench = Bench::new(Trip::default(), true);
    let numbers: Vec<u64> = (0..9)
        .map(|look| {
            let status = bench.guide.status(bench.now_ns);
            if look % 3 == 2 {
                bench.guide.note_published();
            }
            status.sequence
        })
        .collect();
    assert_eq!(numbers, [1, 1, 1, 2, 2, 2, 3, 3, 3]);
}

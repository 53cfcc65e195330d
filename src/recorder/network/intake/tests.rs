use super::*;
use crate::relay::source::{Seen, Worm};
use crate::relay::wire::Subject;
use std::time::{Duration, UNIX_EPOCH};
use worm_estimator::config::Config;
use worm_estimator::message::{Alarm, Cycle, State};

const S: u64 = 1_000_000_000;
/// This computer's clock is behind the robot's by so much, ns.
const BEHIND_NS: u64 = 70 * S;
const WALL_OFFSET_NS: i64 = 1_700_000_000_000_000_000;

/// A robot's relay, as a laptop hears it: 20 frames a second, a cycle every two seconds, and an alarm with each.
struct Robot {
    worm: Worm,
    boot_id: &'static str,
    pid: u32,
    config: Option<&'static str>,
    frames: u64,
    time_ns: u64,
    /// What this laptop has seen of it.
    seen: Seen,
}

impl Robot {
    fn new(boot_id: &'static str, pid: u32, time_ns: u64) -> Self {
        Self {
            worm: Worm::new(Subject::of(&Config::default())),
            boot_id,
            pid,
            config: Some("[worm]\n"),
            frames: 0,
            time_ns,
            seen: Seen::default(),
        }
    }

    fn hello(&self) -> Line {
        let mut hello = self.worm.hello(self.time_ns);
        (hello.boot_id, hello.pid) = (self.boot_id.to_owned(), self.pid);
        hello.robot = Some("robot1".to_owned());
        hello.config = self.config.map(str::to_owned);
        Line::Hello(Box::new(hello))
    }

    /// Lives for the time between two frames.
    fn live(&mut self) {
        self.frames += 1;
        self.time_ns += FRAME_NS;
        let tick = self.frames * 50;
        self.worm.telemetry.take_state(&State {
            sequence: tick,
            time_ns: self.time_ns - 1,
            ..State::unknown(4)
        });
        if self.frames.is_multiple_of(40) {
            let index = self.frames / 40 - 1;
            self.worm.telemetry.take_cycle(&cycle(index, self.time_ns - 1000));
            self.worm.telemetry.take_alarm(&Alarm {
                sequence: index,
                time_ns: self.time_ns - 1000,
                ..Alarm::NONE
            });
        }
    }

    /// The newest frame, with what this laptop has not seen.
    fn frame(&mut self) -> Line {
        let mut frame = self.worm.frame(self.frames, self.time_ns, self.seen, 1, None);
        frame.network = Some(Network {
            robot: "robot1".to_owned(),
            may_drive: false,
            frames_lost: 0,
            round_trip_ms: Some(3),
            boot_id: self.boot_id.to_owned(),
            synchronised: Some(true),
            wall_offset_ns: WALL_OFFSET_NS,
        });
        self.seen = self.worm.seen();
        Line::Frame(Box::new(frame))
    }
}

/// As [`State::unknown`] for cycles: only what counts here.
fn cycle(index: u64, end_ns: u64) -> Cycle {
    Cycle {
        index,
        end_ns,
        ..<Cycle as worm_estimator::message::FieldAccess>::empty()
    }
}

/// What an intake said, gathered as files are.
#[derive(Default)]
struct Recorded {
    files: Vec<(LogHead, Batch, Vec<Note>)>,
    end: Option<String>,
}

impl Recorded {
    fn take(&mut self, intake: &mut Intake, line: Line, robot_ns: u64) {
        for step in intake.take(line, robot_ns - BEHIND_NS, UNIX_EPOCH) {
            match (step, self.files.last_mut()) {
                (Step::Begin(head), _) => self.files.push((*head, Batch::default(), Vec::new())),
                (Step::Write(new), Some((_, all, _))) => {
                    all.states.extend(new.states);
                    all.cycles.extend(new.cycles);
                    all.alarms.extend(new.alarms);
                }
                (Step::Note(note), Some((_, _, notes))) => notes.push(note),
                (Step::End(reason), _) => self.end = Some(reason),
                (Step::Write(_) | Step::Note(_), None) => panic!("written before there is a file"),
            }
        }
    }
}

fn intake() -> Intake {
    Intake::new(Channel::ALL, None)
}

fn indices(batch: &Batch) -> Vec<u64> {
    batch.cycles.iter().map(|cycle| cycle.index).collect()
}

#[test]
fn each_message_is_recorded_once_whatever_is_told_again() {
    let (mut intake, mut recorded) = (intake(), Recorded::default());
    let mut robot = Robot::new("boot", 7, 1000 * S);
    // Five cycles before the recording begins.
    (0..200).for_each(|_| robot.live());
    recorded.take(&mut intake, robot.hello(), robot.time_ns);
    robot.seen = robot.worm.seen();
    let begun_ns = robot.time_ns;
    for tick in 0..200 {
        robot.live();
        if tick % 30 == 0 {
            // The bridge begins anew: the whole history, and then a frame.
            recorded.take(&mut intake, robot.hello(), robot.time_ns);
        }
        let frame = robot.frame();
        recorded.take(&mut intake, frame.clone(), robot.time_ns);
        recorded.take(&mut intake, frame, robot.time_ns);
    }
    let [(head, batch, notes)] = &recorded.files[..] else {
        panic!("one file")
    };
    assert_eq!(indices(batch), [5, 6, 7, 8, 9]);
    assert_eq!((batch.states.len(), batch.alarms.len()), (200, 5));
    assert!(notes.is_empty() && intake.frames_lost() == 0);
    assert_eq!(
        (intake.lost(Channel::Cycle), intake.lost(Channel::State)),
        (Some(0), None)
    );

    // The head has the robot's clocks, and what is special.
    let (origin, time_ns) = (&head.origin, begun_ns + FRAME_NS);
    assert_eq!((origin.config.as_deref(), origin.begun_ns), (Some("[worm]\n"), time_ns));
    assert_eq!(
        origin.begun,
        UNIX_EPOCH + Duration::from_nanos(time_ns + WALL_OFFSET_NS as u64)
    );
    let ahead_ns = BEHIND_NS as i64;
    let wall_offset_ns = WALL_OFFSET_NS;
    assert_eq!(
        head.clock,
        LogClock::Robot {
            ahead_ns,
            wall_offset_ns
        }
    );
    let note = &head.notes[0];
    assert!(note.text.contains("at most 20 of 1000 ticks a second"), "{}", note.text);
    assert_eq!(
        (note.values["robot"].as_str(), note.values["boot_id"].as_str()),
        ("robot1", "boot")
    );
}

#[test]
fn an_outage_costs_states_and_no_cycle_and_is_noted() {
    let (mut intake, mut recorded) = (intake(), Recorded::default());
    let mut robot = Robot::new("boot", 7, 1000 * S);
    recorded.take(&mut intake, robot.hello(), robot.time_ns);
    for tick in 0..400 {
        robot.live();
        // Frames 101 to 300, ten seconds, are lost, and frames 351 and 352, which only count.
        if !(100..300).contains(&tick) && !(350..352).contains(&tick) {
            let frame = robot.frame();
            recorded.take(&mut intake, frame, robot.time_ns);
        }
    }
    let (_, batch, notes) = &recorded.files[0];
    assert_eq!(indices(batch), (0..10).collect::<Vec<_>>());
    assert_eq!((batch.states.len(), intake.frames_lost()), (198, 202));
    let [note] = &notes[..] else { panic!("{notes:?}") };
    assert!(
        note.text.contains("from t = 1005.000 s to 1015.050 s")
            && note
                .text
                .contains("no cycle and no change of an alarm of it is missing"),
        "{}",
        note.text
    );
    assert_eq!(
        (note.values["frames_lost"].as_str(), note.values["cycles_lost"].as_str()),
        ("200", "0")
    );

    // One in which more happened than anybody keeps.
    (0..400).for_each(|_| robot.live());
    robot.seen = Seen {
        cycles: robot.worm.seen().cycles - 3,
        ..robot.worm.seen()
    };
    let frame = robot.frame();
    recorded.take(&mut intake, frame, robot.time_ns);
    let note = recorded.files[0].2.last().expect("noted");
    assert!(note.text.contains("7 cycles"), "{}", note.text);
    assert_eq!(intake.lost(Channel::Cycle), Some(7));
}

#[test]
fn clocks_and_configurations_are_never_mixed_in_one_file() {
    let (mut intake, mut recorded) = (intake(), Recorded::default());
    let mut robot = Robot::new("first", 7, 1000 * S);
    let mut record = |robot: &mut Robot, intake: &mut Intake, hello: bool, frames: u64| {
        if hello {
            recorded.take(intake, robot.hello(), robot.time_ns);
        }
        for _ in 0..frames {
            robot.live();
            let frame = robot.frame();
            recorded.take(intake, frame, robot.time_ns);
        }
    };
    record(&mut robot, &mut intake, true, 80);
    // A relay that knows no configuration, or the same one, changes nothing.
    (robot.pid, robot.config) = (8, None);
    record(&mut robot, &mut intake, true, 80);
    // Frames of a robot that has not said hello since it was started anew are of nobody knows which clock.
    let mut again = Robot::new("second", 7, 90 * S);
    // What it did before it was heard of again belongs to the recording.
    (0..40).for_each(|_| again.live());
    record(&mut again, &mut intake, false, 1);
    again.seen = Seen::default();
    record(&mut again, &mut intake, true, 79);
    again.config = Some("[worm]\nmass_kg = 1.0\n");
    record(&mut again, &mut intake, true, 80);

    let files: Vec<_> = recorded
        .files
        .iter()
        .map(|(head, batch, _)| {
            let time_s: Vec<_> = batch.states.iter().map(|state| state.time_ns / S).collect();
            let (first, last) = (time_s[0], time_s[time_s.len() - 1]);
            (head.origin.begun_ns / S, first, last, indices(batch))
        })
        .collect();
    assert_eq!(
        files,
        [
            (1000, 1000, 1007, vec![0, 1, 2, 3]),
            (92, 92, 95, vec![0, 1, 2]),
            (96, 96, 99, vec![3, 4])
        ]
    );
    let notes: Vec<_> = recorded.files.iter().map(|(head, ..)| &head.notes[0].text).collect();
    assert!(
        notes[1].contains("computer was started anew") && notes[2].contains("configuration is another one"),
        "{notes:?}"
    );
}

#[test]
fn only_the_wanted_topics_are_taken_and_a_worm_of_this_computer_ends_the_recording() {
    let mut intake = Intake::new(&[Channel::Cycle], Some("# given\n".to_owned()));
    let mut recorded = Recorded::default();
    let mut robot = Robot::new("boot", 7, 1000 * S);
    robot.config = None;
    recorded.take(&mut intake, robot.hello(), robot.time_ns);
    for _ in 0..80 {
        robot.live();
        let frame = robot.frame();
        recorded.take(&mut intake, frame, robot.time_ns);
    }
    let (head, batch, _) = &recorded.files[0];
    assert_eq!((batch.states.len(), batch.cycles.len(), batch.alarms.len()), (0, 2, 0));
    assert_eq!(intake.lost(Channel::Alarm), None);
    assert_eq!(head.origin.config.as_deref(), Some("# given\n"), "that of the user");
    let own = robot.worm.hello(robot.time_ns);
    recorded.take(&mut intake, Line::Hello(Box::new(own)), robot.time_ns);
    assert!(
        recorded
            .end
            .is_some_and(|reason| reason.contains("runs on this computer now"))
    );
}

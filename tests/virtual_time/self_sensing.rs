//! Self-sensing on the virtual worm: through the servo's registers and the controller, with tips and a slope that it is not told.

use super::harness::{Obeying, config, crawling, session, wired};
use worm_estimator::config::Config;
use worm_estimator::estimate::{Inference, Observer};
use worm_estimator::message::{AlarmKind, CommandKind, CommandRecord, FieldAccess, Inferred, JsonMessage, State};
use worm_estimator::self_sensing::calibration::{LiftedTurns, lifted, touches};
use worm_estimator::self_sensing::{MotorSample, SelfSensed, SelfSensing};
use worm_physics::Worm;
use wormd::link::virtual_worm::{Options, PlantLedger};
use wormd::soak::Machine;

const DEFORMATIONS_M: [f64; 4] = [0.0020, 0.0011, 0.00175, 0.00215];
const CYCLES: usize = 12;

/// What is inferred after some cycles, with the position, and what was true.
fn infer(slope_deg: f64, seed: u64) -> (SelfSensed, f64, Vec<PlantLedger>) {
    let hidden = config(&format!(
        "worm.max_deformation_m = {DEFORMATIONS_M:?}\ncanal.slope_deg = {slope_deg}\nvirtual_worm.seed = {seed}\n"
    ));
    let told = Config::default();
    let worm = Worm::try_from(&told).expect("the worm of the paper");
    let mut sensing = SelfSensing::new(&worm, &told.self_sensing());
    let mut session = crawling(&hidden, wired(&hidden, &Options::default()), 1000.0);
    session.run_s(hidden.gait.cycle_s * (CYCLES as f64 + 0.5), |tick| {
        if tick.state.motor_is_new == 1 {
            sensing.update(&MotorSample::from(&tick.state));
        }
    });
    let sensed = *sensing.sensed().expect("cycles were seen");
    let truth = session.machine.plant().ledger().cycles().iter().cloned().collect();
    (sensed, sensing.reckoned().position_m, truth)
}

#[test]
fn the_virtual_worm_is_known_by_its_current() {
    for slope_deg in [0.0, 20.0] {
        for seed in 1..=2 {
            let (sensed, position_m, truth) = infer(slope_deg, seed);
            let off = |inferred: f64, of: fn(&PlantLedger) -> f64| {
                let mean = truth[1..].iter().map(of).sum::<f64>() / truth[1..].len() as f64;
                100.0 * (inferred / mean - 1.0)
            };
            let advance = off(sensed.figures.advance_m, |cycle| cycle.advance_m);
            let loss = off(sensed.figures.energy_loss_j, |cycle| cycle.loss_j);
            let electrical = off(sensed.electrical_j, |cycle| cycle.electrical_j);
            let slope = sensed.slope_rad.to_degrees() - slope_deg;
            let cells: Vec<f64> = (0..4)
                .map(|cell| 100.0 * (sensed.friction_n[cell] / (980.0 * DEFORMATIONS_M[cell]) - 1.0))
                .collect();
            println!(
                "{slope_deg}°, seed {seed}: friction {cells:.1?} %, slope {slope:+.1}°, advance {advance:+.1} %, losses {loss:+.1} %, electrical {electrical:+.1} %"
            );
            assert!(cells.iter().all(|error| error.abs() < 10.0));
            assert!(slope.abs() < 5.0 && advance.abs() < 10.0 && loss.abs() < 10.0 && electrical.abs() < 2.0);
            let travelled_m: f64 = truth.iter().map(|cycle| cycle.advance_m).sum();
            assert!(
                (position_m / travelled_m - 1.0).abs() < 0.15,
                "{position_m} m of {travelled_m}"
            );
        }
    }
}

/// A cam that turns so slowly that most ticks see it at the same count of the encoder takes as much energy as it does.
#[test]
fn no_tick_of_a_slow_cycle_loses_its_electrical_energy() {
    for cycle_s in [5.0, 10.0] {
        let config = config(&format!("gait.cycle_s = {cycle_s}\n"));
        let worm = Worm::try_from(&config).expect("the worm of the paper");
        let mut sensing = SelfSensing::new(&worm, &config.self_sensing());
        let mut session = crawling(&config, wired(&config, &Options::default()), 1000.0);
        session.run_s(4.5 * cycle_s, |tick| {
            if tick.state.motor_is_new == 1 {
                sensing.update(&MotorSample::from(&tick.state));
            }
        });
        let truth_j = session
            .machine
            .plant()
            .ledger()
            .cycles()
            .back()
            .map(|cycle| cycle.electrical_j);
        let truth_j = truth_j.expect("cycles were seen");
        let inferred_j = sensing.sensed().expect("cycles were fitted").electrical_j;
        println!("{cycle_s} s: {inferred_j:.4} of {truth_j:.4} J");
        assert!(
            (inferred_j / truth_j - 1.0).abs() < 0.02,
            "{cycle_s} s: {inferred_j} of {truth_j} J"
        );
    }
}

/// Cycles backward are not fitted, and the worm's place goes back with them all the same.
#[test]
fn a_worm_that_crawls_backward_is_not_where_it_began() {
    let config = config("gait.direction = \"backward\"\n");
    let mut session = crawling(&config, wired(&config, &Options::default()), 1000.0);
    let mut inference = Inference::by_current_alone(&config).expect("a valid configuration");
    let mut messages = Vec::new();
    session.run_s(8.5 * config.gait.cycle_s, |tick| {
        messages.extend(inference.update(&tick.state).copied());
    });
    let cycles = session.machine.plant().ledger().cycles();
    let crawled_m: f64 = cycles.iter().map(|cycle| cycle.advance_m).sum();
    let last = messages.last().expect("messages");
    println!(
        "{} messages; at {:.4} ± {:.4} m, {crawled_m:.4} m after {} cycles",
        messages.len(),
        last.position_m,
        last.position_sigma_m,
        cycles.len()
    );
    assert!(messages.len() >= 8 && crawled_m.abs() > 0.04);
    assert!(last.position_m < 0.0 && last.advance_m.is_nan());
    let off_m = last.position_m.abs() - crawled_m.abs();
    assert!(off_m.abs() < 1.645 * last.position_sigma_m.max(0.01), "{off_m} m off");
    assert!(last.position_sigma_m > 1e-3);
}

/// Nothing is 0 before it is known, and what is left at the end of a recording is known where the recording ends.
#[test]
fn what_is_not_known_yet_is_no_number_and_the_last_message_is_of_the_last_state() {
    let config = config("");
    let mut session = crawling(&config, wired(&config, &Options::default()), 1000.0);
    let mut inference = Inference::by_current_alone(&config).expect("a valid configuration");
    let (mut before, mut last) = (None, None);
    // The end of the sixth cycle is the last that is seen, and it is not fitted yet.
    session.run_s(60.0, |tick| {
        let is_over = last.is_some_and(|state: State| state.phase >= 6.0);
        if !is_over {
            let message = inference.update(&tick.state).copied();
            before = before.or(message);
            last = Some(tick.state);
        }
    });
    let before = before.expect("a message with the first state");
    for value in [
        before.advance_m,
        before.advance_sigma_m,
        before.pull_n,
        before.energy_loss_j,
        before.energy_electrical_j,
        before.energy_electrical_sigma_j,
        before.friction_loss_share,
    ] {
        assert!(value.is_nan(), "{before:?}");
    }
    let (last, earlier) = (last.expect("states"), *inference.latest());
    let message = *inference.finish().expect("a cycle was waiting");
    assert!(message.end_phase > earlier.end_phase);
    assert_eq!(
        (message.phase, message.time_ns, message.state_sequence, message.sequence),
        (last.phase, last.time_ns, last.sequence, earlier.sequence + 1)
    );
}

/// The estimator beside its positions says the same of the worm as self-sensing without them, to the last bit; and the same again from the
/// same states and commands.
#[test]
fn the_running_estimator_infers_what_the_current_alone_says() {
    let config = config("");
    let mut session = crawling(&config, wired(&config, &Options::default()), 1000.0);
    let mut states = Vec::new();
    session.run_s(16.0, |tick| states.push(tick.state));
    let mark = CommandRecord {
        state_sequence: states[9_000].sequence,
        time_ns: states[9_000].time_ns,
        phase: states[9_000].phase,
        kind: CommandKind::Mark.code(),
        position_m: 0.7,
        position_sigma_m: 1e-3,
        ..CommandRecord::empty()
    };
    // A record may be late, by as much as a record can be.
    let observe = |late: usize| {
        let mut observer = Observer::new(&config).expect("a valid configuration");
        let mut inferred = Vec::new();
        for (tick, state) in states.iter().enumerate() {
            if tick == 9_000 + late {
                observer.note_command(&mark);
            }
            inferred.extend(observer.update(state).inferred);
        }
        inferred
    };
    let live = observe(0);
    assert_eq!(text(&live), text(&observe(90)));
    // Once the model's prediction is made, nothing of it allocates: not the search of the third cycle either.
    let mut observer = Observer::new(&config).expect("a valid configuration");
    let (before, after) = states.split_at(6_000);
    for state in before {
        observer.update(state);
    }
    let mut messages = 0;
    let allocated = allocation_counter::measure(|| {
        for state in after {
            messages += usize::from(observer.update(state).inferred.is_some());
        }
    });
    assert_eq!(allocated.count_total, 0);
    assert!(messages >= 3, "{messages} messages");

    let unseen = |state: &State| State {
        sample_is_new: 0,
        position_m: [f64::NAN; worm_physics::MAX_CELLS],
        ..*state
    };
    let mut alone = Inference::by_current_alone(&config).expect("a valid configuration");
    let mut marked = Inference::by_current_alone(&config).expect("a valid configuration");
    let (mut blind, mut with_marks) = (Vec::new(), Vec::new());
    for (tick, state) in states.iter().enumerate() {
        blind.extend(alone.update(&unseen(state)).copied());
        if let Some(place) = [9_000, 12_000].iter().position(|&at| at == tick) {
            marked.note_command(&CommandRecord {
                state_sequence: state.sequence,
                time_ns: state.time_ns,
                phase: state.phase,
                position_m: [0.7, 0.9][place],
                ..mark
            });
        }
        with_marks.extend(marked.update(&unseen(state)).copied());
    }
    // Nothing said where it began before the first mark, so that contradicts nothing; the second one is some 0.2 m off.
    let last = with_marks.last().expect("messages");
    assert_eq!((last.marks, last.contradicting_marks), (2, 1));
    assert!((0.15..0.2).contains(&last.mark_off_m), "{last:?}");
    let ends = |messages: &[Inferred]| -> Vec<Inferred> {
        let mut last_ns = 0;
        let fitted = messages
            .iter()
            .filter(|message| message.end_ns != std::mem::replace(&mut last_ns, message.end_ns));
        fitted
            .map(|message| Inferred {
                sequence: 0,
                position_m: 0.0,
                position_sigma_m: 0.0,
                marks: 0,
                contradicting_marks: 0,
                mark_off_m: 0.0,
                mark_off_sigma_m: 0.0,
                tracker_marks: 0,
                ..*message
            })
            .collect()
    };
    assert!(ends(&live).len() >= 4, "{} cycles", ends(&live).len());
    assert_eq!(text(&ends(&live)), text(&ends(&blind)));
    let (last, unseen) = (live.last().expect("messages"), blind.last().expect("messages"));
    assert_eq!((last.marks, unseen.marks), (1, 0));
    // The mark was far from where the tracker has the worm, and that is told.
    let off_m = 0.7 - states[9_000].position_m[..4].iter().sum::<f64>() / 4.0;
    assert_eq!((last.contradicting_marks, unseen.contradicting_marks), (1, 0));
    assert!(
        (last.mark_off_m - off_m).abs() < 0.01 && last.mark_off_sigma_m < 0.01,
        "{off_m} m: {last:?}"
    );
    println!(
        "at {:.4} ± {:.4} m with tracker and mark, {:.4} ± {:.4} m without",
        last.position_m, last.position_sigma_m, unseen.position_m, unseen.position_sigma_m
    );
    assert!(last.position_sigma_m < 1e-3 && last.position_sigma_m < 0.5 * unseen.position_sigma_m);
    let travelled_m: f64 = session
        .machine
        .plant()
        .ledger()
        .cycles()
        .iter()
        .map(|cycle| cycle.advance_m)
        .sum();
    assert!(
        (unseen.position_at_m(last.end_phase) / travelled_m - 1.0).abs() < 0.1,
        "of {travelled_m} m"
    );
}

fn text(messages: &[Inferred]) -> Vec<u8> {
    let mut text = Vec::new();
    messages
        .iter()
        .for_each(|message| message.write_json(&mut text).expect("it can be written"));
    text
}

/// Friction that one cell loses raises the alarm with that cell, within three cycles of the loss; nothing is raised before.
#[test]
fn lost_friction_raises_its_alarm() {
    for (cell, slope_deg) in [(1, 0.0), (2, 15.0), (4, 15.0)] {
        let config = config(&format!("canal.slope_deg = {slope_deg}\n"));
        let mut session = crawling(&config, wired(&config, &Options::default()), 1000.0);
        session.run_s(26.0, |_| {});
        assert_eq!(session.raised_kinds(), []);
        let fault = format!("slip:friction=0.65,cell={cell}").parse().expect("a fault");
        session.machine.switch_on(fault).expect("it can be switched on");
        let from_s = session.now_s();
        // Three cycles; one more where the cell had already stepped when it lost its friction.
        session.run_s(4.0 * config.gait.cycle_s, |_| {});
        let alarm = session
            .raised
            .iter()
            .find(|alarm| alarm.kind == AlarmKind::FrictionLoss.code());
        let alarm = alarm.unwrap_or_else(|| panic!("cell {cell}, {slope_deg}°: {:?}", session.raised));
        let cycles = (alarm.time_ns as f64 * 1e-9 - from_s) / config.gait.cycle_s;
        println!(
            "cell {cell}, {slope_deg}°: {cycles:.1} cycles after the loss, share {:.2}",
            alarm.value
        );
        assert!(cycles < 3.2);
        assert_eq!(alarm.cell + 1, cell);
    }
}

/// A servo that reports the duty of its bridge as its current, and an estimator that is told so: what the motor takes is what it takes, in
/// self-sensing and in the account of every cycle.
#[test]
fn a_servo_that_reports_its_duty_takes_as_much_energy_as_it_does() {
    let config = config(
        "worm.cells = 5\nworm.step_order = [1, 2, 3, 4, 5]\ngait.cycle_s = 2.0\ncanal.slope_deg = 20.0\n\
         virtual_worm.present_current = \"duty\"\nself_sensing.current = \"duty\"\n",
    );
    let worm = Worm::try_from(&config).expect("a worm of five cells");
    let mut sensing = SelfSensing::new(&worm, &config.self_sensing());
    let mut session = crawling(&config, wired(&config, &Options::default()), 1000.0);
    session.cycles = Some(Vec::new());
    session.run_s(6.5 * config.gait.cycle_s, |tick| {
        if tick.state.motor_is_new == 1 {
            sensing.update(&MotorSample::from(&tick.state));
        }
    });
    let truth = session.machine.plant().ledger().cycles().back().expect("cycles");
    let cycle = session.cycles.iter().flatten().last().expect("cycles");
    let sensed = sensing.sensed().expect("cycles were fitted");
    for (what, joules, sigma_j, truth_j) in [
        (
            "electrical",
            cycle.energy_electrical_j,
            cycle.energy_electrical_sigma_j,
            truth.electrical_j,
        ),
        (
            "inferred electrical",
            sensed.electrical_j,
            sensed.electrical_sigma_j,
            truth.electrical_j,
        ),
        ("copper", cycle.energy_copper_j, 0.1 * truth.copper_j, truth.copper_j),
    ] {
        println!("{what}: {joules:.4} ± {sigma_j:.4} J of {truth_j:.4}");
        assert!(
            (joules - truth_j).abs() < 2.0 * sigma_j && sigma_j < 0.12 * truth_j,
            "{what}: {joules} ± {sigma_j} of {truth_j} J"
        );
    }
}

/// The turns of `wormd calibrate --lifted` on a worm that is like this, as the estimator knows a worm of the paper.
fn lifted_turns(toml: &str, seed: u64) -> Vec<LiftedTurns> {
    let config = config(&format!("gait.cycle_s = 1.25\n[virtual_worm]\nseed = {seed}\n{toml}"));
    let gear = Config::default().self_sensing().gear;
    let mut session = session(&config, wired(&config, &Options::default()), 1000.0);
    session.begin();
    let speeds = [0.25, 0.5, 1.0].map(|speed| [speed / 1.25, -speed / 1.25]);
    let turns = speeds.concat().into_iter().map(|cycles_per_s| {
        session.command(CommandKind::Crawl, cycles_per_s);
        let mut samples = Vec::new();
        session.run_s(1.4 / cycles_per_s.abs() + 1.0, |tick| {
            if tick.state.motor_is_new == 1 && tick.state.motor_velocity_rad_s * cycles_per_s > 0.0 {
                samples.push(MotorSample::from(&tick.state));
            }
        });
        lifted(&samples, &gear, 4).expect("a whole turn")
    });
    turns.collect()
}

/// `wormd calibrate --lifted` on a worm that lies in its canal gives the tips' friction as the gears'. That is seen, whatever the slope; gears
/// with a ripple, and gears that are worn, are not taken for tips.
#[test]
fn a_worm_that_lies_in_its_canal_is_not_taken_for_a_lifted_one() {
    const LIFTED: &str = "max_deformation_m = 0.00001\n";
    let ripple = |waves: u32, phase: f64| {
        format!(
            "{LIFTED}[[virtual_worm.servo_effect]]\nname = \"gear-ripple\"\namplitude_n_m = 0.001\nwaves_per_turn = {waves}\nphase = {phase}\n"
        )
    };
    let mut table = vec![
        ("lifted".to_owned(), LIFTED.to_owned(), false),
        (
            "worn gears".to_owned(),
            format!("{LIFTED}inner_friction_n_m = 0.03\n"),
            false,
        ),
        (
            "new gears".to_owned(),
            format!("{LIFTED}inner_friction_n_m = 0.003\n"),
            false,
        ),
        ("level".to_owned(), String::new(), true),
        ("level, soft".to_owned(), "max_deformation_m = 0.001\n".to_owned(), true),
        ("15°".to_owned(), "[canal]\nslope_deg = 15.0\n".to_owned(), true),
        ("−15°".to_owned(), "[canal]\nslope_deg = -15.0\n".to_owned(), true),
    ];
    // With the step of a cell a ripple returns with four waves, and with eight.
    for (waves, phase) in [(4, 0.0), (4, 0.25), (4, 0.5), (4, 0.75), (7, 0.4), (8, 0.25)] {
        table.push((format!("ripple, {waves} waves at {phase}"), ripple(waves, phase), false));
    }
    let told = Config::default();
    let worm = Worm::try_from(&told).expect("the worm of the paper");
    for (seed, (name, toml, lies)) in (1..).zip(table) {
        let turns = lifted_turns(&toml, seed);
        let touching = touches(&turns, &worm, &told.self_sensing().gear);
        let rises: Vec<f64> = turns.iter().map(|turns| 1e3 * turns.step_rise_n_m).collect();
        println!("{name}: rises {rises:.2?} mN m, {touching:?}");
        assert_eq!(touching.is_some(), lies, "{name}");
    }
}

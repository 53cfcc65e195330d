//! Slow turns of a running worm, for the friction of its gears. What they say is worked out by
//! [`worm_estimator::self_sensing::calibration`].
//!
//! The worm crawls as by `wormd command crawl --attend`: it holds as soon as this process is gone, and a hold of anybody else ends the
//! calibration.

use crate::failure::Failure;
use crate::supervisor::attend;
use crate::supervisor::controller::{self, command};
use crate::topics::{Hub, Instance};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use worm_estimator::config::{CalibrationMode, Config};
use worm_estimator::message::{CommandKind, Mode, State};
use worm_estimator::self_sensing::MotorSample;
use worm_estimator::self_sensing::calibration::{FrictionAt, GearFriction, LiftedTurns, fit, level, lifted, touches};
use worm_physics::Worm;

/// Its name in the record of commands.
const SENDER: &str = "wormd calibrate";
/// Speeds as parts of the usual gait's; dry and viscous friction are told apart by how far they differ.
const LIFTED_SPEEDS: [f64; 3] = [0.25, 0.5, 1.0];
const LEVEL_SPEEDS: [f64; 2] = [0.5, 1.0];
/// Turns of the cam at each speed: a whole one and its beginning; on the level cycles to load the tips, and some that are fitted.
const LIFTED_TURNS: f64 = 1.35;
const LEVEL_TURNS: f64 = 7.0;
/// Standard deviations of what is known of dry and viscous friction before, N m and N m s/rad.
const BEFORE: [f64; 2] = [0.03, 0.01];
/// How often states are taken.
const ROUND: Duration = Duration::from_millis(5);
/// How long a worm may say nothing.
const SILENCE: Duration = Duration::from_secs(1);

/// What a calibration has found.
pub(crate) struct Found {
    /// Friction at each speed; speeds at which the worm did not crawl evenly are missing.
    pub at: Vec<FrictionAt>,
    /// Friction over the speed.
    pub friction: GearFriction,
    /// Mean temperature of the servo, °C.
    pub temperature_c: f64,
    /// Mean voltage on the bus, V.
    pub supply_v: f64,
}

/// One stretch of crawling.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stage {
    /// Gait cycles per second, negative backward.
    pub cycles_per_s: f64,
    /// How far.
    pub turns: f64,
    /// Whether it counts; a way back does not.
    pub counts: bool,
}

/// The stretches of a calibration; a worm in its canal comes back to where it was.
pub(crate) fn stages(mode: CalibrationMode, config: &Config) -> Vec<Stage> {
    let usual = config.gait_cycles_per_s().abs();
    let stage = |speed: f64, turns: f64, counts: bool| Stage {
        cycles_per_s: speed * usual,
        turns,
        counts,
    };
    match mode {
        CalibrationMode::Lifted => LIFTED_SPEEDS
            .into_iter()
            .flat_map(|speed| [stage(speed, LIFTED_TURNS, true), stage(-speed, LIFTED_TURNS, true)])
            .collect(),
        CalibrationMode::Level => {
            let forward = LEVEL_SPEEDS.map(|speed| stage(speed, LEVEL_TURNS, true));
            let way_back = stage(-1.0, LEVEL_TURNS * LEVEL_SPEEDS.len() as f64, false);
            forward.into_iter().chain([way_back]).collect()
        }
    }
}

/// How long stretches take, s.
pub(crate) fn duration_s(stages: &[Stage]) -> f64 {
    stages.iter().map(|stage| stage.turns / stage.cycles_per_s.abs()).sum()
}

/// Turns the cam of a running worm, and works out the friction of its gears. The worm holds at the end, however that comes. `tell` is told
/// each stretch before it begins.
///
/// # Errors
/// [`Failure::Failed`] when the worm refuses, does not say anything, is stopped by somebody, or did not turn evenly, and after a signal;
/// [`Failure::Unusable`] when one that should be lifted is not.
pub(crate) fn calibrate(
    instance: &Instance,
    config: &Config,
    mode: CalibrationMode,
    end: &AtomicBool,
    tell: &mut dyn FnMut(&Stage),
) -> Result<Found, Failure> {
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    arm(&hub)?;
    let worm = Worm::try_from(config).map_err(Failure::unusable)?;
    let known = config.self_sensing();
    let (mut at, mut all) = (Vec::new(), Vec::new());
    let mut turns: Vec<LiftedTurns> = Vec::new();
    for stage in stages(mode, config) {
        tell(&stage);
        let samples = turn(instance, &hub, &stage, end)?;
        if !stage.counts {
            continue;
        }
        match mode {
            CalibrationMode::Lifted => turns.extend(lifted(&samples, &known.gear, worm.cells())),
            CalibrationMode::Level => at.extend(level(&samples, &worm, &known)),
        }
        all.extend(samples);
    }
    if let Some(touching) = touches(&turns, &worm, &known.gear) {
        return Err(Failure::unusable(format!(
            "the worm is not lifted: {touching}: hold it so that no tip touches anything, or lay it on the level and give --level; nothing was written"
        )));
    }
    at.extend(turns.iter().map(|turns| turns.friction));
    if at.is_empty() {
        return Err(Failure::failed(
            "at no speed was there a whole even turn with the motor's current: does the servo report its current, and does nothing stop the worm?",
        ));
    }
    let mean = |of: fn(&MotorSample) -> f64| {
        let known: Vec<f64> = all.iter().map(of).filter(|value| value.is_finite()).collect();
        known.iter().sum::<f64>() / known.len() as f64
    };
    let usual_rad_per_s = std::f64::consts::TAU * config.gait_cycles_per_s();
    Ok(Found {
        friction: fit(&at, &known.gear, BEFORE, usual_rad_per_s),
        at,
        temperature_c: mean(|sample| sample.temperature_c),
        supply_v: mean(|sample| sample.bus_voltage_v),
    })
}

/// Switches torque on where it is off.
fn arm(hub: &Hub) -> Result<(), Failure> {
    let mut states = hub.subscriber::<State>().map_err(Failure::failed)?;
    let begun = std::time::Instant::now();
    let state = loop {
        match states.latest().map_err(Failure::failed)? {
            Some(state) => break *state,
            None if begun.elapsed() > SILENCE => {
                return Err(Failure::failed(
                    "the controller publishes no state: is it still starting?",
                ));
            }
            None => std::thread::sleep(ROUND),
        }
    };
    if state.mode != Mode::Disarmed.code() {
        return Ok(());
    }
    let client = hub.command_client().map_err(Failure::failed)?;
    let answer = controller::send(&client, command(CommandKind::Arm, SENDER))?;
    answer.refusal().map_or(Ok(()), |refusal| Err(Failure::failed(refusal)))
}

/// One stretch: the readings of the motor while the worm crawls.
fn turn(instance: &Instance, hub: &Hub, stage: &Stage, end: &AtomicBool) -> Result<Vec<MotorSample>, Failure> {
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let read = read_turn(instance, stage, end, &over);
            over.store(true, Ordering::Relaxed);
            read
        });
        let crawled = attend::crawl(hub, SENDER, stage.cycles_per_s, &over, || {});
        // The reader must not wait for a worm that does not crawl any more.
        over.store(true, Ordering::Relaxed);
        let samples = reader
            .join()
            .map_err(|_| Failure::failed("the reader of states failed"))?;
        crawled?;
        if end.load(Ordering::Relaxed) {
            return Err(Failure::failed(
                "ended by a signal: the worm holds, and nothing was written",
            ));
        }
        samples
    })
}

/// Takes the motor's part of states in which the worm crawls, until it has turned far enough, or `over` is set.
fn read_turn(
    instance: &Instance,
    stage: &Stage,
    end: &AtomicBool,
    over: &AtomicBool,
) -> Result<Vec<MotorSample>, Failure> {
    let hub = Hub::open(instance).map_err(Failure::failed)?;
    let mut states = hub.subscriber::<State>().map_err(Failure::failed)?;
    let mut samples: Vec<MotorSample> = Vec::new();
    while !over.load(Ordering::Relaxed) && !end.load(Ordering::Relaxed) {
        while let Some(state) = states.next().map_err(Failure::failed)? {
            let is_new = state.mode == Mode::Crawling.code() && state.motor_is_new == 1 && state.phase.is_finite();
            if is_new && state.motor_velocity_rad_s * stage.cycles_per_s >= 0.0 {
                samples.push(MotorSample::from(&*state));
            }
        }
        let turned = samples
            .first()
            .zip(samples.last())
            .map_or(0.0, |(first, last)| (last.phase - first.phase).abs());
        if turned >= stage.turns {
            break;
        }
        std::thread::sleep(ROUND);
    }
    Ok(samples)
}

//! `wormd explain --live`: the running worm is recorded first.

use crate::command::dataset::READING;
use crate::command::progress::Progress;
use crate::command::{Failure, end_on_signal_until};
use crate::recorder::{FileOptions, POLL_INTERVAL, Recorder};
use crate::topics::{Controller, Hub, Instance, RoleLock};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{Fault, Mode, State};
use worm_log::Channel;

/// How long a worm may be silent before it counts as gone. Its controller publishes in every tick.
const SILENCE_TIMEOUT: Duration = Duration::from_secs(2);

/// Gait cycles recorded beyond the last whole one, so that its end is recorded.
const MARGIN_CYCLES: f64 = 0.05;

/// Records the crawling worm over so many whole gait cycles into a log, which replaces an older one; one without cell positions where the
/// motor will do.
///
/// # Errors
/// [`Failure::Unusable`] when no worm of this name runs, or it does not crawl; [`Failure::Failed`] when it stops, falls silent or
/// the user ends the recording before that, or the log cannot be written. What was recorded is kept.
pub(super) fn record(
    config: &Config,
    text: Option<String>,
    (cycles, motor_will_do): (u32, bool),
    log: &Path,
    progress: &mut Progress,
) -> Result<(), Failure> {
    let instance = Instance::of(config).map_err(Failure::unusable)?;
    // While the hub is open, others leave the worm's folder alone; when it closes, an empty folder is removed.
    let _hub = Hub::open(&instance).map_err(Failure::failed)?;
    if RoleLock::<Controller>::holder(&instance).is_none() {
        let worm = &config.worm.name;
        return Err(Failure::unusable(format!(
            "no worm {worm} is running: start it with `wormd up --name {worm}`, or give the name of another with --name"
        )));
    }
    let (end, over) = end_on_signal_until()?;
    let topics = [Channel::State, Channel::Estimate, Channel::Cycle, Channel::Alarm];
    let mut recorder = Recorder::open(config, text, &topics, log, true, FileOptions::default())?;
    let mut cycles_recorded = CycleProgress::new(&config.worm.name, cycles, motor_will_do);
    let mut done = Ok(false);
    while matches!(done, Ok(false)) {
        if end.load(Ordering::Relaxed) {
            done = Err(cycles_recorded.ended_early("was no longer to be recorded", log));
            break;
        }
        std::thread::sleep(POLL_INTERVAL);
        done = recorder
            .poll()
            .and_then(|polled| cycles_recorded.update(polled.state.as_ref(), log));
        progress.tell("recording the worm", READING * cycles_recorded.fraction());
    }
    recorder.close()?;
    // From here on a signal may end the process at once: the search may take long.
    over.store(true, Ordering::Relaxed);
    done.map(|_| ())
}

/// Progress of the recording, from the worm's own states.
struct CycleProgress<'a> {
    worm: &'a str,
    cycles: f64,
    motor_will_do: bool,
    last_state: Instant,
    first_phase: Option<f64>,
    phase: f64,
}

impl<'a> CycleProgress<'a> {
    fn new(worm: &'a str, cycles: u32, motor_will_do: bool) -> Self {
        Self {
            worm,
            motor_will_do,
            cycles: f64::from(cycles),
            last_state: Instant::now(),
            first_phase: None,
            phase: f64::NAN,
        }
    }

    /// Takes the newest state, if there is one. Returns whether all cycles are recorded.
    fn update(&mut self, state: Option<&State>, log: &Path) -> Result<bool, Failure> {
        let Some(state) = state else {
            if self.last_state.elapsed() < SILENCE_TIMEOUT {
                return Ok(false);
            }
            return Err(self.ended_early("fell silent", log));
        };
        self.last_state = Instant::now();
        if state.mode != Mode::Crawling.code() {
            let mode = Mode::try_from(state.mode).map_or("unknown", Mode::name);
            let fault = Fault::try_from(state.fault).unwrap_or(Fault::None);
            let why = match fault {
                Fault::None => mode.to_owned(),
                fault => format!("{mode}: {fault}"),
            };
            if self.first_phase.is_some() {
                return Err(self.ended_early(&format!("stopped crawling ({why})"), log));
            }
            let worm = self.worm;
            return Err(Failure::unusable(format!(
                "{worm} does not crawl ({why}): let it crawl first, with `wormd command crawl --name {worm}`"
            )));
        }
        if state.sample == 0 && !self.motor_will_do {
            let worm = self.worm;
            return Err(Failure::unusable(format!(
                "{worm} has no cell positions: --current takes what the motor's current shows as evidence instead"
            )));
        }
        if state.phase.is_finite() {
            self.phase = state.phase;
            self.first_phase.get_or_insert(state.phase);
        }
        Ok(self.recorded() >= self.needed())
    }

    /// Gait cycles since the recording began.
    fn recorded(&self) -> f64 {
        self.first_phase.map_or(0.0, |first| (self.phase - first).abs())
    }

    /// Gait cycles until the last whole one has ended, in either direction.
    fn needed(&self) -> f64 {
        // The cycle in which the recording begins is not whole.
        1.0 + self.cycles + MARGIN_CYCLES
    }

    fn fraction(&self) -> f64 {
        self.recorded() / self.needed()
    }

    fn ended_early(&self, what: &str, log: &Path) -> Failure {
        let (recorded, file) = (self.recorded(), log.display());
        Failure::failed(format!(
            "{} {what} after {recorded:.1} of {} gait cycles: what was recorded is kept, and may be enough for `wormd explain {file} --slope DEG`",
            self.worm, self.cycles
        ))
    }
}

//! What ends a trial before its time: a signal to the process, and the emergency stop.

use super::trial::TrialError;
use super::{EmergencyStopInput, ExchangeOutcome};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often a trial that sends nothing looks.
const SLICE: Duration = Duration::from_millis(10);

/// The inputs that a trial looks at with every exchange, and every 10 ms while it is silent.
#[derive(Debug)]
pub struct StopInputs<'a> {
    signals: &'a [Arc<AtomicBool>],
    emergency_stop: Option<EmergencyStopInput>,
    since: Instant,
}

impl<'a> StopInputs<'a> {
    /// Any of the flags `signals` ends a trial, and so does the emergency stop, where there is one.
    #[must_use]
    pub fn new(signals: &'a [Arc<AtomicBool>], emergency_stop: Option<EmergencyStopInput>) -> Self {
        Self {
            signals,
            emergency_stop,
            since: Instant::now(),
        }
    }

    /// To be called when a trial begins: the time since an earlier one does not count as silence of the emergency stop.
    pub(super) fn begin(&mut self) -> Result<(), TrialError> {
        if let Some(input) = &mut self.emergency_stop {
            input.forget();
        }
        self.check_silently()
    }

    /// Looks at all inputs; `outcome` is that of an exchange just made.
    pub(super) fn check(&mut self, outcome: &ExchangeOutcome) -> Result<(), TrialError> {
        let now_ns = self.now_ns();
        let is_pressed = |input: &mut EmergencyStopInput| input.is_pressed(now_ns, outcome);
        self.judge(is_pressed)
    }

    /// Waits, looking at what can be read without a packet on the bus: a switch at the tracker cannot.
    pub(super) fn wait(&mut self, time: Duration) -> Result<(), TrialError> {
        let end = Instant::now() + time;
        loop {
            self.check_silently()?;
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(());
            }
            std::thread::sleep(left.min(SLICE));
        }
    }

    /// Looks at what can be read without a packet on the bus.
    pub(crate) fn check_silently(&mut self) -> Result<(), TrialError> {
        let now_ns = self.now_ns();
        self.judge(|input| input.is_pressed_at_line(now_ns))
    }

    fn judge(&mut self, is_pressed: impl FnOnce(&mut EmergencyStopInput) -> bool) -> Result<(), TrialError> {
        if self.signals.iter().any(|signal| signal.load(Ordering::Relaxed)) {
            return Err(TrialError::Signal);
        }
        if self.emergency_stop.as_mut().is_some_and(is_pressed) {
            return Err(TrialError::EmergencyStop);
        }
        Ok(())
    }

    fn now_ns(&self) -> u64 {
        self.since.elapsed().as_nanos() as u64
    }
}

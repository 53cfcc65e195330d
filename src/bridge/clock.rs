//! What the robot's clocks are worth: the kernel's word on synchronisation, and when wall time was set.
//!
//! No decision depends on any of this. It goes to the laptops and into the worms' events, so that who reads a log later knows what its
//! times mean.

use super::wire::{ClockStatus, ClockStep};
use crate::realtime::monotonic_ns;
use nix::time::{ClockId, clock_gettime};

/// Smaller changes of the offset are slewing and the pause between the two clocks being read, ns.
const MIN_STEP_NS: i64 = 100_000_000;

/// The watch over the clocks.
#[derive(Debug)]
pub(crate) struct ClockWatch {
    status: ClockStatus,
}

impl ClockWatch {
    /// Begins with the clocks as they are.
    pub(crate) fn new() -> Self {
        let boot_id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
        Self {
            status: ClockStatus {
                boot_id: boot_id.trim().to_owned(),
                synchronised: is_synchronised(),
                wall_offset_ns: wall_offset_ns(),
                steps: 0,
                last_step: None,
            },
        }
    }

    /// Looks at the clocks again; returns a step that has happened since.
    pub(crate) fn look(&mut self) -> Option<ClockStep> {
        self.status.synchronised = is_synchronised();
        self.take(wall_offset_ns(), monotonic_ns())
    }

    /// The clocks as they were when they were looked at.
    pub(crate) fn status(&self) -> &ClockStatus {
        &self.status
    }

    fn take(&mut self, offset_ns: i64, now_ns: u64) -> Option<ClockStep> {
        let step_ns = offset_ns.saturating_sub(self.status.wall_offset_ns);
        self.status.wall_offset_ns = offset_ns;
        if step_ns.saturating_abs() < MIN_STEP_NS {
            return None;
        }
        let step = ClockStep {
            time_ns: now_ns,
            step_ns,
        };
        self.status.steps += 1;
        self.status.last_step = Some(step);
        Some(step)
    }
}

/// Wall time less `CLOCK_MONOTONIC`, ns; 0 where there is no wall time.
fn wall_offset_ns() -> i64 {
    let Ok(wall) = clock_gettime(ClockId::CLOCK_REALTIME) else {
        return 0;
    };
    let wall_ns = i128::from(wall.tv_sec()) * 1_000_000_000 + i128::from(wall.tv_nsec());
    i64::try_from(wall_ns - i128::from(monotonic_ns())).unwrap_or(0)
}

/// What systemd-timesyncd leaves once it has set the clock.
const TIMESYNCD: &str = "/run/systemd/timesync/synchronized";

/// Whether the kernel counts its wall time as synchronised (adjtimex(2)). A hardened service may not ask; then systemd-timesyncd may know.
fn is_synchronised() -> Option<bool> {
    let mut status = std::mem::MaybeUninit::<libc::timex>::zeroed();
    // SAFETY: all zeros are a valid timex, and with modes 0 the call only fills it in.
    match unsafe { libc::adjtimex(status.as_mut_ptr()) } {
        -1 => std::path::Path::new(TIMESYNCD).exists().then_some(true),
        libc::TIME_ERROR => Some(false),
        _ => Some(true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_noted_and_slewing_is_not() {
        let mut watch = ClockWatch::new();
        assert_eq!(watch.status().steps, 0);
        let begun_ns = watch.status().wall_offset_ns;
        assert_eq!(watch.take(begun_ns + 20_000_000, 1), None);
        assert_eq!(watch.take(begun_ns - 20_000_000, 2), None);
        let month_ns = 30 * 86_400 * 1_000_000_000;
        let step = watch.take(begun_ns - 20_000_000 - month_ns, 3).expect("a step");
        assert_eq!((step.time_ns, step.step_ns), (3, -month_ns));
        assert_eq!(watch.take(begun_ns - month_ns, 4), None);
        assert_eq!((watch.status().steps, watch.status().last_step), (1, Some(step)));
        assert!(watch.look().is_some(), "the true clock is a month away");
    }
}

//! The loop's own clock, which stands still while the computer pauses.
//!
//! A computer that is busy, or whose host takes its CPUs away, does not run the loop for a while. In that time no device was asked,
//! and none could have been received. So the silences of servo, tracker and estimator are measured on a clock that stands still
//! meanwhile. Without pauses it agrees with the computer's clock.
//!
//! A tick that was merely late by some periods is excused in the same way. But where every tick is late the devices are asked in every
//! one of them: of such ticks the clock counts at least half, so that no silence, ramp or time limit takes more than twice its time.

use worm_estimator::config::Config;

/// An absence of at least this length is a pause of the computer, an event of its own; below it the tick was merely late. Ten times
/// what a loaded computer without a real-time kernel takes to run a woken thread, and half of the shortest bus watchdog, ns.
pub(super) const MIN_PAUSE_NS: u64 = 10_000_000;

/// A time in nanoseconds; the longest time that fits for one that does not.
pub(super) fn seconds_to_ns(seconds: f64) -> u64 {
    (seconds * 1e9) as u64
}

/// How one tick advanced the clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ClockStep {
    /// Time on the loop's own clock, ns.
    pub present_ns: u64,
    /// How far it advanced since the tick before, ns.
    pub step_ns: u64,
    /// The pause of the computer that ended in this tick, ns; 0 where there was none.
    pub pause_ns: u64,
}

/// The loop's own clock, and the pauses that it left out.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LoopClock {
    last_ns: Option<u64>,
    present_ns: u64,
    paused_ns: u64,
}

impl LoopClock {
    /// Takes a tick at `now_ns` of the computer's clock, in or before which the loop was kept from running for `absent_ns`, and after
    /// a service that took `service_ns`. In a service no reading is requested, so the clock stands still as in a pause.
    pub(super) fn advance(&mut self, now_ns: u64, absent_ns: u64, service_ns: u64) -> ClockStep {
        let elapsed_ns = self.last_ns.map_or(0, |last_ns| now_ns.saturating_sub(last_ns));
        let elapsed_ns = elapsed_ns.saturating_sub(service_ns);
        if self.last_ns.replace(now_ns).is_none() {
            self.present_ns = now_ns;
        }
        let absent_ns = absent_ns.min(elapsed_ns);
        let step_ns = elapsed_ns - absent_ns;
        self.present_ns += step_ns;
        let pause_ns = if absent_ns >= MIN_PAUSE_NS { absent_ns } else { 0 };
        self.paused_ns += pause_ns;
        ClockStep {
            present_ns: self.present_ns,
            step_ns,
            pause_ns,
        }
    }

    /// All pauses so far, ns.
    pub(super) fn paused_ns(&self) -> u64 {
        self.paused_ns
    }
}

/// Silence after which the loop checks whether all CPUs of the computer run, ns.
const CHECK_CPUS_AFTER_NS: u64 = 20_000_000;

/// Decides whether a missing answer is charged to the servo or to the computer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Silence {
    silent_ns: u64,
    uncharged_ns: u64,
    max_uncharged_ns: u64,
}

impl Silence {
    /// No silence yet. A servo is excused for at most twice the time after which its link counts as lost, whatever the computer
    /// does.
    pub(super) fn new(config: &Config) -> Self {
        Self {
            silent_ns: 0,
            uncharged_ns: 0,
            max_uncharged_ns: seconds_to_ns(2.0 * config.control.link_timeout_s),
        }
    }

    /// How much of a tick of `period_ns` is not charged to the servo. `all_cpus_run` returns whether the last check of the CPUs is
    /// complete, and starts the next; it is called only during a silence.
    pub(super) fn uncharged_ns(&mut self, period_ns: u64, answered: bool, all_cpus_run: impl FnOnce() -> bool) -> u64 {
        if answered {
            (self.silent_ns, self.uncharged_ns) = (0, 0);
            return 0;
        }
        self.silent_ns += period_ns;
        if self.silent_ns < CHECK_CPUS_AFTER_NS || all_cpus_run() || self.uncharged_ns >= self.max_uncharged_ns {
            return 0;
        }
        self.uncharged_ns += period_ns;
        period_ns
    }
}

/// Times of one tick on the computer's clock that show an absence of the loop, ns.
#[derive(Debug, Clone, Copy)]
pub(super) struct ExchangeTimes {
    /// The tick's deadline, and when it really began.
    pub deadline: u64,
    pub woken: u64,
    /// How long the exchange may wait, and when it ended.
    pub bus_allowed: u64,
    pub exchanged: u64,
    /// What the tick before took from the end of its exchange to its own end.
    pub work_before: u64,
    /// From the end of the exchange before to the end of this one.
    pub elapsed: u64,
}

/// How long the loop could not run between the end of the previous exchange and the end of this one, in whole periods: a shorter
/// absence has cost no tick. Of one that is no pause, at most half of the time between them.
pub(super) fn absent_ns(times: &ExchangeTimes, period_ns: u64) -> u64 {
    let woken_late = times.woken.saturating_sub(times.deadline);
    let answered_late = (times.exchanged - times.woken).saturating_sub(times.bus_allowed);
    let whole_periods = |ns: u64| ns / period_ns * period_ns;
    // The previous tick's work may have run past this deadline, which the schedule then moved on.
    let absent = whole_periods(woken_late + answered_late) + whole_periods(times.work_before);
    if absent < MIN_PAUSE_NS {
        absent.min(times.elapsed / 2)
    } else {
        absent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn the_clock_stands_still_while_the_computer_does() {
        let mut loop_clock = LoopClock::default();
        // (computer's clock, absence; the loop's clock, pause; all ms)
        let table = [
            (1000, 0, 1000, 0),
            (1001, 0, 1001, 0),
            (1006, 4, 1002, 0),
            (1307, 300, 1003, 300),
            (1317, 10, 1003, 10),
            // An absence cannot be longer than the time that has passed.
            (1318, 50, 1003, 1),
        ];
        for (now, absent, present, pause) in table {
            let passed = loop_clock.advance(now * MS, absent * MS, 0);
            assert_eq!(passed.present_ns, present * MS, "at {now} ms");
            let expected = if pause >= 10 { pause * MS } else { 0 };
            assert_eq!(passed.pause_ns, expected, "at {now} ms");
        }
        assert_eq!(loop_clock.paused_ns(), 310 * MS);
        // A service is no pause, and takes none of the clock's time either.
        let passed = loop_clock.advance(1569 * MS, 0, 250 * MS);
        assert_eq!((passed.present_ns, passed.step_ns, passed.pause_ns), (1004 * MS, MS, 0));
    }

    #[test]
    fn a_servo_is_not_charged_with_a_cpu_that_is_away_but_not_excused_for_ever() {
        let mut silence = Silence::new(&Config::default());
        let mut uncharged_ms = |ticks: u32, answered: bool, all_cpus_run: bool| -> u64 {
            let uncharged = (0..ticks).map(|_| silence.uncharged_ns(MS, answered, || all_cpus_run));
            uncharged.sum::<u64>() / MS
        };
        assert_eq!(uncharged_ms(19, false, false), 0, "too short to check");
        assert_eq!(uncharged_ms(100, false, true), 0, "a computer that runs");
        assert_eq!(uncharged_ms(60, false, false), 60, "a CPU is away");
        assert_eq!(uncharged_ms(500, false, false), 140, "twice link_timeout_s in all");
        assert_eq!(uncharged_ms(1, true, false), 0);
        assert_eq!(uncharged_ms(100, false, false), 81, "an answer resets it");
    }

    #[test]
    fn only_what_the_loop_could_not_help_is_absence() {
        let times = |woken_us: u64, bus_us: u64, work_before_us: u64| ExchangeTimes {
            elapsed: 10_000_000,
            deadline: 5_000_000,
            woken: 5_000_000 + woken_us * 1_000,
            bus_allowed: 700_000,
            exchanged: 5_000_000 + (woken_us + bus_us) * 1_000,
            work_before: work_before_us * 1_000,
        };
        // (woken late, exchange, work before in µs; absence in ms)
        for (woken, bus, work_before, absent) in [
            (50, 90, 20, 0),
            (900, 690, 20, 0),
            (60, 700, 20, 0),
            (1_100, 300, 20, 1),
            (80_300, 90, 20, 80),
            (60, 300_700, 20, 300),
            (60, 90, 45_000, 45),
        ] {
            assert_eq!(
                absent_ns(&times(woken, bus, work_before), MS),
                absent * MS,
                "{woken} {bus} {work_before}"
            );
        }
    }

    #[test]
    fn late_ticks_make_no_time_longer_than_twice() {
        for late_ms in 1..10 {
            let mut loop_clock = LoopClock::default();
            let (mut now_ns, elapsed) = (1_000 * MS, (1 + late_ms) * MS);
            let began_ns = loop_clock.advance(now_ns, 0, 0).present_ns;
            for _ in 0..100 {
                let deadline = now_ns + MS;
                now_ns += elapsed;
                let late = ExchangeTimes {
                    deadline,
                    woken: now_ns,
                    bus_allowed: MS,
                    exchanged: now_ns,
                    work_before: 0,
                    elapsed,
                };
                loop_clock.advance(now_ns, absent_ns(&late, MS), 0);
            }
            let present_ns = loop_clock.advance(now_ns, 0, 0).present_ns - began_ns;
            assert!(2 * present_ns >= 100 * elapsed, "{late_ms} ms late: {present_ns} ns");
        }
    }
}

//! Settings that are valid but inadvisable.

use super::{Config, EmergencyStopSource, Policy, PositionSource};
use crate::message::AlarmKind;

/// One setting that is valid but inadvisable, and a better choice.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Advice {
    /// The key, as `section.key`.
    pub key: &'static str,
    /// What is wrong with it, and a better choice.
    pub text: String,
}

/// Bits on the wire per byte: start bit, eight data bits, stop bit.
const BITS_PER_BYTE: f64 = 10.0;

/// Bytes of one exchange without the cell positions: goal velocity, fast bulk read, its answer.
const EXCHANGE_BYTES: f64 = 16.0 + 20.0 + 8.0 + 53.0 + 15.0;

pub(super) fn advise(config: &Config) -> Vec<Advice> {
    let mut advice = Vec::new();
    let mut say = |holds: bool, key: &'static str, text: String| {
        if holds {
            advice.push(Advice { key, text });
        }
    };
    let period_s = 1.0 / config.control.rate_hz;
    if let Some(port) = &config.port {
        let wire_s = (EXCHANGE_BYTES + 4.0 * config.worm.cells as f64) * BITS_PER_BYTE / f64::from(port.baud);
        say(
            wire_s > period_s * config.control.bus_wait_share,
            "port.baud",
            format!(
                "an exchange takes {:.2} ms on the wire at {} baud, more than the {:.2} ms it may take at {} Hz: raise the baud rate or lower control.rate_hz",
                wire_s * 1e3,
                port.baud,
                period_s * config.control.bus_wait_share * 1e3,
                config.control.rate_hz
            ),
        );
    }
    say(
        f64::from(config.servo.watchdog_ms) * 1e-3 < 10.0 * period_s,
        "servo.watchdog_ms",
        "fewer than ten ticks: one late tick may stop the motor".to_owned(),
    );
    say(
        config.servo.watchdog_ms > 500,
        "servo.watchdog_ms",
        "the motor turns on for more than half a second after the computer fell silent".to_owned(),
    );
    say(
        60.0 / config.gait.cycle_s > 0.9 * config.servo.velocity_limit_rev_per_min,
        "gait.cycle_s",
        format!(
            "{:.1} rev/min leaves no room below servo.velocity_limit_rev_per_min = {}",
            60.0 / config.gait.cycle_s,
            config.servo.velocity_limit_rev_per_min
        ),
    );
    say(
        config.limits.current_a > config.servo.current_limit_a,
        "limits.current_a",
        "above servo.current_limit_a, so it can never be reached".to_owned(),
    );
    say(
        config
            .tracker_rate_hz()
            .is_some_and(|rate_hz| rate_hz > config.control.rate_hz),
        "tracker.rate_hz",
        "faster than the loop reads: samples will be missed".to_owned(),
    );
    let stops_at_tracker = config
        .emergency_stop
        .as_ref()
        .is_some_and(|stop| stop.source == EmergencyStopSource::Tracker);
    say(
        stops_at_tracker && config.position_source() == PositionSource::TrackerWhileItLasts,
        "control.on_stale_tracker",
        "\"continue\" with an emergency stop at the tracker: where the tracker falls silent the emergency stop cannot be read, which stops \
         the worm; give emergency_stop.source = \"gpio\""
            .to_owned(),
    );
    say(
        config.alarms.of(AlarmKind::MotorStall).policy == Policy::Warn,
        "alarms.motor_stall.policy",
        "a stalled motor that is not stopped overheats: hold or stop".to_owned(),
    );
    say(
        config.worm.cells == 2,
        "worm.cells",
        "two equal cells hold each other off by equal forces, and which of them slides is left to chance: the model's \
         advance is not to be relied on, and alarms will speak; three cells crawl"
            .to_owned(),
    );
    say(
        config.realtime.priority == 0,
        "realtime.priority",
        "0: every other process may delay the loop; 80 is usual".to_owned(),
    );
    advice
}

//! What is known of the worm for Prometheus, in its text format (version 0.0.4). Pure.
//!
//! A worm that is silent must not look alive: `wormd_up` and the ages are always there, and what is older than [`EXPIRY_MS`] is left out,
//! so that a graph ends instead of going on level.

use super::feed::Feed;
use crate::watch::breakdown::Breakdown;
use std::fmt::Write;
use worm_estimator::message::{AlarmKind, Fault, Mode, RecordingState};

/// What is older is not given out any more, ms.
const EXPIRY_MS: u64 = 5000;

/// The text that is made, for one worm.
struct Text {
    worm: String,
    text: String,
}

/// A value with its labels; those are in the text format, without the worm.
type Labelled = (String, f64);

impl Text {
    /// A metric with these samples. Values that are not known are left out.
    fn metric(&mut self, kind: &str, name: &str, help: &str, samples: impl IntoIterator<Item = Labelled>) {
        let mut samples = samples.into_iter().filter(|(_, value)| value.is_finite()).peekable();
        if samples.peek().is_none() {
            return;
        }
        // Writing to a string does not fail.
        let _ = write!(self.text, "# HELP {name} {help}\n# TYPE {name} {kind}\n");
        for (labels, value) in samples {
            let worm = &self.worm;
            let comma = if labels.is_empty() { "" } else { "," };
            let _ = writeln!(self.text, "{name}{{worm=\"{worm}\"{comma}{labels}}} {value}");
        }
    }

    fn gauge(&mut self, name: &str, help: &str, value: f64) {
        self.metric("gauge", name, help, [(String::new(), value)]);
    }

    fn gauges(&mut self, name: &str, help: &str, samples: impl IntoIterator<Item = Labelled>) {
        self.metric("gauge", name, help, samples);
    }

    fn counter(&mut self, name: &str, help: &str, value: u64) {
        self.metric("counter", name, help, [(String::new(), value as f64)]);
    }
}

/// A label.
fn label(name: &str, value: impl std::fmt::Display) -> String {
    let value = value.to_string();
    let escaped = value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
    format!("{name}=\"{escaped}\"")
}

/// 1 for what is so.
fn flag(is_so: bool) -> f64 {
    f64::from(u8::from(is_so))
}

fn seconds_of_ms(ms: Option<u64>) -> f64 {
    ms.map_or(f64::NAN, |ms| ms as f64 * 1e-3)
}

/// All metrics; `pages` are open at this dashboard.
pub(super) fn text(feed: &Feed, now_ns: u64, pages: usize) -> String {
    let mut out = Text {
        worm: feed.picture.subject.name.clone(),
        text: String::with_capacity(16 << 10),
    };
    source(&mut out, feed, now_ns, pages);
    let ages = feed.ages(now_ns);
    let is_young = |age: Option<u64>| age.is_some_and(|ms| ms < EXPIRY_MS);
    if is_young(ages.state) {
        state(&mut out, feed);
    }
    if is_young(ages.timing) {
        timing(&mut out, feed);
    }
    if is_young(ages.estimate) {
        alarms(&mut out, feed);
        last_cycle(&mut out, feed);
        range(&mut out, feed);
    }
    if is_young(ages.recording) {
        recording(&mut out, feed);
    }
    out.text
}

/// Whether there is anything behind the rest.
fn source(out: &mut Text, feed: &Feed, now_ns: u64, pages: usize) {
    let ages = feed.ages(now_ns);
    out.gauge(
        "wormd_up",
        "Whether the newest state of the worm is younger than a second.",
        flag(feed.is_live(now_ns)),
    );
    out.gauges(
        "wormd_build_info",
        "Version of the dashboard, as a label.",
        [(label("version", env!("CARGO_PKG_VERSION")), 1.0)],
    );
    out.gauge(
        "wormd_relay_connected",
        "Whether the dashboard is connected to the relay of the worm.",
        flag(feed.connection().connected),
    );
    out.gauge(
        "wormd_frame_age_seconds",
        "How long ago the relay was last heard.",
        seconds_of_ms(feed.frame_age_ms(now_ns)),
    );
    let of_topics = [
        ("state", ages.state),
        ("estimate", ages.estimate),
        ("timing", ages.timing),
        ("recording", ages.recording),
        ("trip", ages.trip),
    ];
    out.gauges(
        "wormd_source_age_seconds",
        "How old the newest message of a topic is, by the monotonic clock.",
        of_topics.map(|(topic, age)| (label("topic", topic), seconds_of_ms(age))),
    );
    out.gauge(
        "wormd_dashboard_pages",
        "Pages that are open at this dashboard.",
        pages as f64,
    );
    if feed.frame_age_ms(now_ns).is_some_and(|age_ms| age_ms < EXPIRY_MS) {
        let picture = &feed.picture;
        out.gauge(
            "wormd_watchers",
            "Watchers of the relay; a dashboard is one, and each page that drives.",
            picture.watchers as f64,
        );
        out.gauge(
            "wormd_driven",
            "Whether somebody drives.",
            flag(picture.driver.is_some()),
        );
        out.gauges(
            "wormd_driver_attends",
            "Whether the worm crawls for as long as this driver is heard.",
            picture
                .driver
                .iter()
                .map(|driver| (label("driver", &driver.name), flag(driver.attends))),
        );
    }
}

fn state(out: &mut Text, feed: &Feed) {
    let Some(state) = &feed.picture.state else { return };
    out.gauges(
        "wormd_mode",
        "The mode of the controller: 1 for the present one.",
        Mode::ALL
            .iter()
            .map(|mode| (label("mode", mode.name()), flag(mode.code() == state.mode))),
    );
    out.gauges(
        "wormd_fault",
        "Why the controller stopped: 1 for the present reason.",
        Fault::ALL
            .iter()
            .map(|fault| (label("fault", fault.name()), flag(fault.code() == state.fault))),
    );
    out.counter("wormd_ticks_total", "Ticks of the control loop.", feed.picture.ticks());
    out.counter(
        "wormd_link_failures_total",
        "Exchanges without a usable answer of the servo.",
        state.link_failures,
    );
    out.counter(
        "wormd_samples_missed_total",
        "Tracker samples that came and went between two reads.",
        state.samples_missed,
    );
    out.gauge(
        "wormd_phase_cycles",
        "Gait cycles done, by the angle of the cam.",
        state.phase,
    );
    out.gauge(
        "wormd_motor_current_amperes",
        "Current in the motor winding.",
        state.motor_current_a,
    );
    out.gauge(
        "wormd_motor_velocity_radians_per_second",
        "Velocity of the cam.",
        state.motor_velocity_rad_s,
    );
    out.gauge(
        "wormd_motor_temperature_celsius",
        "Temperature of the servo.",
        state.motor_temperature_c,
    );
    out.gauge("wormd_bus_voltage_volts", "Voltage at the servo.", state.bus_voltage_v);
    let Some(estimate) = &feed.picture.estimate else { return };
    let cells = (estimate.cell_count as usize).min(worm_physics::MAX_CELLS);
    let of_cells = |values: &[f64]| -> Vec<Labelled> {
        values[..cells]
            .iter()
            .enumerate()
            .map(|(cell, value)| (label("cell", cell + 1), *value))
            .collect()
    };
    out.gauges(
        "wormd_position_meters",
        "Position of a cell along the canal.",
        of_cells(&estimate.position_m),
    );
    out.gauges(
        "wormd_deformation_meters",
        "Deformation of a cell's tip.",
        of_cells(&estimate.deformation_m),
    );
}

fn timing(out: &mut Text, feed: &Feed) {
    if let Some(timing) = &feed.picture.timing {
        out.counter(
            "wormd_overruns_total",
            "Deadlines of the control loop that passed without a tick.",
            timing.overruns,
        );
        out.gauge(
            "wormd_tick_period_seconds",
            "Period of the control loop at present.",
            timing.period_ns as f64 * 1e-9,
        );
    }
    let Some(statistics) = &feed.picture.statistics else {
        return;
    };
    for (name, help, us) in [
        (
            "wormd_wake_lateness_seconds",
            "How long after its deadline a tick begins, since the relay began.",
            statistics.wake_us,
        ),
        (
            "wormd_bus_exchange_seconds",
            "How long the exchange on the bus takes, since the relay began.",
            statistics.bus_us,
        ),
        (
            "wormd_compute_seconds",
            "How long a tick computes, since the relay began.",
            statistics.compute_us,
        ),
    ] {
        let quantiles = [
            ("0.5", us.p50),
            ("0.9", us.p90),
            ("0.99", us.p99),
            ("0.999", us.p99_9),
            ("1", us.max),
        ];
        out.metric(
            "summary",
            name,
            help,
            quantiles.map(|(quantile, us)| (label("quantile", quantile), us * 1e-6)),
        );
    }
    out.counter(
        "wormd_host_pauses_total",
        "Pauses of the computer since the relay began.",
        statistics.host_pauses,
    );
    out.metric(
        "counter",
        "wormd_host_paused_seconds_total",
        "How long these pauses were together.",
        [(String::new(), statistics.host_paused_s)],
    );
}

fn alarms(out: &mut Text, feed: &Feed) {
    let (Some(estimate), Some(state)) = (&feed.picture.estimate, &feed.picture.state) else {
        return;
    };
    for (name, help, mask) in [
        (
            "wormd_alarm_raised",
            "Whether an alarm is raised.",
            estimate.raised_mask,
        ),
        ("wormd_alarm_armed", "Whether an alarm watches.", estimate.armed_mask),
        (
            "wormd_alarm_acknowledged",
            "Whether somebody has acknowledged an alarm that is raised.",
            state.acknowledged_mask,
        ),
    ] {
        let of_kinds = AlarmKind::ALL
            .iter()
            .map(|kind| (label("alarm", kind.name()), flag(mask >> kind.code() & 1 == 1)));
        out.gauges(name, help, of_kinds);
    }
}

fn last_cycle(out: &mut Text, feed: &Feed) {
    let picture = &feed.picture;
    let Some(cycle) = picture.cycles.last() else { return };
    let energy = Breakdown::of(cycle, &picture.subject);
    out.counter(
        "wormd_cycles_total",
        "Gait cycles since crawling began.",
        cycle.index + 1,
    );
    out.gauge(
        "wormd_cycle_duration_seconds",
        "How long the last gait cycle took.",
        cycle.duration_s,
    );
    out.gauge(
        "wormd_cycle_advance_meters",
        "Distance of the last gait cycle.",
        cycle.advance_m,
    );
    out.gauges(
        "wormd_cycle_energy_joules",
        "Where the electrical energy of the last gait cycle went: copper, gears, sliding, weight.",
        [
            ("copper", energy.copper_j),
            ("gears", energy.gears_j),
            ("sliding", energy.sliding_j),
            ("weight", energy.weight_j),
        ]
        .map(|(part, energy_j)| (label("part", part), energy_j)),
    );
    out.gauge(
        "wormd_cycle_electrical_energy_joules",
        "Electrical energy of the last gait cycle.",
        energy.electrical_j,
    );
    out.gauge(
        "wormd_cycle_cost_of_transport_ratio",
        "Positive work of the last gait cycle over weight and distance.",
        cycle.cot,
    );
}

fn range(out: &mut Text, feed: &Feed) {
    let Some(range) = &feed.picture.range else { return };
    let bounds = |low: f64, expected: f64, high: f64| {
        [("low", low), ("expected", expected), ("high", high)].map(|(bound, value)| (label("bound", bound), value))
    };
    out.gauge(
        "wormd_battery_charge_ratio",
        "Share of the battery's energy that is left.",
        range.charge_share,
    );
    out.gauges(
        "wormd_range_meters",
        "How far the battery lasts, with its 90 % interval.",
        bounds(range.range_low_m, range.range_m, range.range_high_m),
    );
    out.gauges(
        "wormd_time_left_seconds",
        "How long the battery lasts, with its 90 % interval.",
        bounds(range.time_low_s, range.time_s, range.time_high_s),
    );
}

fn recording(out: &mut Text, feed: &Feed) {
    let Some(status) = &feed.picture.recording else { return };
    out.gauges(
        "wormd_recording_state",
        "What the recorder does: 1 for the present state.",
        RecordingState::ALL
            .iter()
            .map(|state| (label("state", state.name()), flag(state.code() == status.state))),
    );
    out.counter(
        "wormd_recording_bytes_total",
        "Bytes written by the recorder.",
        status.bytes,
    );
    out.counter(
        "wormd_recording_messages_lost_total",
        "Messages that did not arrive at the recorder.",
        status.messages_lost,
    );
}

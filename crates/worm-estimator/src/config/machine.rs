//! The hardware and software around the worm: port, servo, loop, limits, operating system, topics.

use super::check::Checker;
use serde::Deserialize;
use worm_physics::servo::identified::XL330_IDENTIFIED;

/// How both devices are read in one exchange.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReadMode {
    /// Fast bulk read if both devices answer it at start-up, else bulk read, else separate reads.
    Auto,
    /// Fast bulk read: one answer for both devices.
    FastBulk,
    /// Bulk read: an answer each.
    Bulk,
    /// One read after the other.
    Separate,
}

/// The serial port of a real worm.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Port {
    /// The port's device file.
    pub path: String,
    /// Baud rate, the same in the port and in both devices.
    #[serde(default = "default_baud")]
    pub baud: u32,
    /// How both devices are read.
    #[serde(default = "default_read_mode")]
    pub read: ReadMode,
}

/// Baud rates of the X series (XL330-M288 e-manual, register 8).
pub const BAUD_RATES: [u32; 7] = [9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000];

fn default_baud() -> u32 {
    4_000_000
}

fn default_read_mode() -> ReadMode {
    ReadMode::Auto
}

impl Port {
    /// A port with the default baud rate and read mode.
    pub fn at(path: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            baud: default_baud(),
            read: default_read_mode(),
        }
    }

    pub(super) fn check(&self, checker: &mut Checker) {
        checker.require(
            !self.path.is_empty(),
            "port.path",
            "\"\"",
            "name the port, such as \"/dev/ttyUSB0\", or remove the section [port] for the virtual worm",
        );
        let known = BAUD_RATES.contains(&self.baud);
        checker.require(
            known,
            "port.baud",
            self.baud,
            format!("must be one of {:?}", BAUD_RATES),
        );
    }
}

/// The servo that turns the cam: a DYNAMIXEL of the X series.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Servo {
    /// Device ID on the bus.
    pub id: u8,
    /// Required model number.
    pub model_number: u16,
    /// Present position at which the gait phase is a whole number, counts of 1/4096 turn.
    pub home_position: i32,
    /// Cam turns forward when the servo turns in its positive direction.
    pub positive_is_forward: bool,
    /// Resistance of the winding at 25 °C, ohm.
    pub winding_resistance_ohm: f64,
    /// Torque of the output shaft per current, N m/A, before inner friction.
    pub torque_constant_n_m_per_a: f64,
    /// Greatest current of the motor, that of a blocked one, A. The servo gets it as a limit of its duty.
    pub current_limit_a: f64,
    /// Velocity limit written to the servo, rev/min.
    pub velocity_limit_rev_per_min: f64,
    /// Temperature limit written to the servo, °C.
    pub temperature_limit_c: u8,
    /// Silence after which the servo stops the motor by itself, ms, in steps of 20 ms.
    pub watchdog_ms: u32,
    /// Whether to arm a servo whose firmware is known not to stop the motor when its bus watchdog acts.
    pub accept_unsafe_watchdog: bool,
}

impl Default for Servo {
    fn default() -> Self {
        Self {
            id: 1,
            model_number: 1200,
            home_position: 0,
            positive_is_forward: true,
            winding_resistance_ohm: XL330_IDENTIFIED.winding_ohm,
            torque_constant_n_m_per_a: XL330_IDENTIFIED.torque_constant,
            current_limit_a: 1.0,
            velocity_limit_rev_per_min: 60.0,
            temperature_limit_c: 70,
            watchdog_ms: 80,
            accept_unsafe_watchdog: false,
        }
    }
}

impl Servo {
    pub(super) fn check(&self, checker: &mut Checker) {
        checker.range("servo.id", self.id, 0..=252, "");
        checker.range(
            "servo.winding_resistance_ohm",
            self.winding_resistance_ohm,
            0.01..=1000.0,
            "ohm",
        );
        checker.range(
            "servo.torque_constant_n_m_per_a",
            self.torque_constant_n_m_per_a,
            1e-3..=100.0,
            "N m/A",
        );
        checker.range("servo.current_limit_a", self.current_limit_a, 0.01..=1.75, "A");
        checker.range(
            "servo.velocity_limit_rev_per_min",
            self.velocity_limit_rev_per_min,
            0.3..=468.0,
            "rev/min",
        );
        checker.range("servo.temperature_limit_c", self.temperature_limit_c, 30..=100, "°C");
        checker.range("servo.watchdog_ms", self.watchdog_ms, 20..=2540, "ms");
        checker.require(
            self.watchdog_ms.is_multiple_of(20),
            "servo.watchdog_ms",
            self.watchdog_ms,
            "must be a multiple of 20 ms, the servo's unit",
        );
    }
}

/// The control loop and its timeouts.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Control {
    /// Ticks per second.
    pub rate_hz: f64,
    /// Fraction of the tick's period that the exchange may wait for answers.
    pub bus_wait_share: f64,
    /// Servo silence after which the link counts as lost, s.
    pub link_timeout_s: f64,
    /// Time without a new tracker sample after which the tracker counts as stale, s.
    pub tracker_timeout_s: f64,
    /// What a crawling worm does when the tracker is stale.
    pub on_stale_tracker: OnStaleTracker,
    /// Estimator silence after which it counts as gone, s.
    pub estimator_timeout_s: f64,
    /// Whether the worm crawls only while an estimator is running.
    pub require_estimator: bool,
    /// Stiffness of a hold: commanded velocity per angle error, 1/s.
    pub hold_gain_per_s: f64,
    /// Gait cycles that a `back-off` goes back before it holds.
    pub back_off_cycles: f64,
    /// Whether the loop goes on at a steady fraction of `rate_hz` on a computer that cannot hold it.
    pub adapt_rate: bool,
    /// Whether the worm crawls on by itself, if that is safe, after a pause of the computer has stopped it.
    pub resume_after_pause: bool,
    /// How long the lease of `wormd up` lasts without being renewed, s.
    pub lease_s: f64,
    /// What a crawling worm does when its lease lapses.
    pub on_lapsed_lease: OnLapsedLease,
    /// How long a worm crawls by a command that names no time, where nobody holds a lease, s.
    pub crawl_limit_s: f64,
    /// Time without motion after which torque goes off, s.
    pub idle_disarm_s: f64,
    /// Where torque goes off after idling.
    pub idle_disarm: IdleDisarm,
}

/// What a crawling worm does when the tracker gives no samples any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnStaleTracker {
    /// Stops and latches the fault `tracker-stale`.
    Stop,
    /// Crawls on without positions until they come again.
    Continue,
}

/// What a crawling worm does when whoever made it crawl is gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnLapsedLease {
    /// Stands still at once and keeps the cam where it is: a worm on a slope must not fall.
    Hold,
    /// Stands still at once and switches torque off.
    Stop,
}

/// Where torque goes off after idling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IdleDisarm {
    /// On slopes of at most [`IdleDisarm::LEVEL_DEG`]; on a steeper one the worm goes on holding.
    Level,
    /// Everywhere.
    Always,
    /// Nowhere.
    Never,
}

impl IdleDisarm {
    /// Steepest slope that counts as level, degrees.
    pub const LEVEL_DEG: f64 = 5.0;
}

impl Default for Control {
    fn default() -> Self {
        Self {
            rate_hz: 1000.0,
            bus_wait_share: 0.7,
            link_timeout_s: 0.1,
            tracker_timeout_s: 0.5,
            on_stale_tracker: OnStaleTracker::Stop,
            estimator_timeout_s: 0.5,
            require_estimator: true,
            hold_gain_per_s: 5.0,
            back_off_cycles: 1.0,
            adapt_rate: true,
            resume_after_pause: false,
            lease_s: 1.0,
            on_lapsed_lease: OnLapsedLease::Hold,
            crawl_limit_s: 600.0,
            idle_disarm_s: 300.0,
            idle_disarm: IdleDisarm::Level,
        }
    }
}

impl Control {
    pub(super) fn check(&self, checker: &mut Checker) {
        checker.range("control.rate_hz", self.rate_hz, 10.0..=10_000.0, "Hz");
        checker.range("control.bus_wait_share", self.bus_wait_share, 0.1..=0.95, "");
        checker.range("control.link_timeout_s", self.link_timeout_s, 0.005..=5.0, "s");
        checker.range("control.tracker_timeout_s", self.tracker_timeout_s, 0.02..=10.0, "s");
        checker.range("control.estimator_timeout_s", self.estimator_timeout_s, 0.1..=10.0, "s");
        checker.range("control.hold_gain_per_s", self.hold_gain_per_s, 0.1..=50.0, "1/s");
        checker.range("control.back_off_cycles", self.back_off_cycles, 0.1..=100.0, "cycles");
        checker.range("control.lease_s", self.lease_s, 0.1..=60.0, "s");
        checker.range("control.crawl_limit_s", self.crawl_limit_s, 1.0..=1e6, "s");
        checker.range("control.idle_disarm_s", self.idle_disarm_s, 1.0..=1e6, "s");
    }
}

/// Limits at which the controller stops by itself.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Motor current, A.
    pub current_a: f64,
    /// How long the current may stay above the limit, s.
    pub current_time_s: f64,
    /// Servo temperature, °C.
    pub temperature_c: f64,
    /// Bus voltage, V, averaged over 0.1 s.
    pub voltage_v: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            current_a: 0.9,
            current_time_s: 0.5,
            temperature_c: 65.0,
            voltage_v: 3.7,
        }
    }
}

impl Limits {
    pub(super) fn check(&self, checker: &mut Checker) {
        checker.range("limits.current_a", self.current_a, 0.01..=5.0, "A");
        checker.range("limits.current_time_s", self.current_time_s, 0.0..=10.0, "s");
        checker.range("limits.temperature_c", self.temperature_c, 20.0..=120.0, "°C");
        checker.range("limits.voltage_v", self.voltage_v, 0.0..=50.0, "V");
    }
}

/// The estimator.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Estimator {
    /// Good cycles on which alarm thresholds are calibrated.
    pub calibration_cycles: u32,
    /// A position further than this many standard deviations from where the cell can be is an outlier.
    pub outlier_sigmas: f64,
}

impl Default for Estimator {
    fn default() -> Self {
        Self {
            calibration_cycles: 3,
            outlier_sigmas: 5.0,
        }
    }
}

impl Estimator {
    pub(super) fn check(&self, checker: &mut Checker) {
        checker.range(
            "estimator.calibration_cycles",
            self.calibration_cycles,
            1..=100,
            "cycles",
        );
        checker.range("estimator.outlier_sigmas", self.outlier_sigmas, 3.0..=20.0, "");
    }
}

/// What the loop requests from the operating system. A refusal is reported, and the worm still runs.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Realtime {
    /// Priority under SCHED_FIFO; 0 leaves the ordinary scheduler.
    pub priority: u8,
    /// CPU that the loop is pinned to; absent: none.
    pub cpu: Option<usize>,
    /// Lock all memory.
    pub lock_memory: bool,
}

impl Default for Realtime {
    fn default() -> Self {
        Self {
            priority: 80,
            cpu: None,
            lock_memory: true,
        }
    }
}

impl Realtime {
    pub(super) fn check(&self, checker: &mut Checker) {
        checker.range("realtime.priority", self.priority, 0..=99, "");
        if let Some(cpu) = self.cpu {
            checker.range("realtime.cpu", cpu, 0..=1023, "");
        }
    }
}

/// Where the shared-memory topics live.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Topics {
    /// Folder for locks and service files of all worms on this computer, best on a tmpfs; or [`Topics::AUTO`].
    pub root: String,
}

impl Default for Topics {
    fn default() -> Self {
        Self {
            root: Self::AUTO.to_owned(),
        }
    }
}

impl Topics {
    /// The [`root`](Self::root) that leaves it to the daemon: `/dev/shm/wormd` for root, `/run/user/UID/wormd` for other users.
    pub const AUTO: &str = "auto";

    pub(super) fn check(&self, worm_name: &str, checker: &mut Checker) {
        // A service's socket lies in the root and holds the name twice; a socket's path is short.
        let max = 48_usize.saturating_sub(2 * worm_name.len());
        checker.require(
            self.root == Self::AUTO || (self.root.starts_with('/') && self.root.len() <= max),
            "topics.root",
            format!("\"{}\"", self.root),
            format!(
                "must be an absolute path of at most {max} characters for a worm of this name (socket paths are short), or \"auto\""
            ),
        );
    }
}

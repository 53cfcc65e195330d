//! Sessions as the tests want them: a configuration from what differs, a sound worm, commands that must be accepted.

use worm_estimator::config::Config;
use worm_estimator::message::{CommandKind, CommandOutcome, Mode};
use wormd::link::virtual_worm::Options;
use wormd::soak::{Machine, Session, Wired};

// What the configurations of several tests differ in from the default.
pub const LEVEL: &str = "";
pub const STEEP: &str = "canal.slope_deg = 30\n";
pub const BATTERY: &str = "[battery]\ncapacity_j = 400.0\nfull_v = 5.6\nempty_v = 4.0\ninternal_resistance_ohm = 0.2\n\
                           hotel_power_w = 0.5\nreserve_share = 0.1\n";
pub const SWITCH: &str = "[emergency_stop]\nsource = \"tracker\"\n";

/// A configuration from what differs.
pub fn config(toml: &str) -> Config {
    Config::from_toml(toml, "test".as_ref()).expect("a valid test configuration")
}

/// The virtual worm behind the packet codec.
pub fn wired(config: &Config, options: &Options) -> Wired {
    Wired::new(config, options).expect("a sound worm")
}

/// A disarmed worm; ticks at `rate_hz`.
pub fn session<M: Machine>(config: &Config, machine: M, rate_hz: f64) -> Session<M> {
    Session::new(config, machine, rate_hz).expect("a valid configuration")
}

/// A worm that was armed and commanded to crawl with the configured gait.
pub fn crawling<M: Machine>(config: &Config, machine: M, rate_hz: f64) -> Session<M> {
    let mut session = session(config, machine, rate_hz);
    session.begin();
    session.command(CommandKind::Crawl, 0.0);
    session
}

/// Commands that must be accepted.
pub trait Obeying {
    /// Waits for the estimator, then arms.
    fn begin(&mut self);
    /// Gives a command.
    fn command(&mut self, kind: CommandKind, cycles_per_s: f64);
}

impl<M: Machine> Obeying for Session<M> {
    fn begin(&mut self) {
        self.run_s(0.05, |_| {});
        self.command(CommandKind::Arm, 0.0);
        self.run_s(0.05, |_| {});
        assert_eq!(self.mode(), Mode::Armed, "a sound worm can be armed");
    }

    fn command(&mut self, kind: CommandKind, cycles_per_s: f64) {
        let verdict = self.send(kind, cycles_per_s).verdict;
        assert_eq!(
            verdict,
            Some(CommandOutcome::Accepted),
            "{kind:?} at {} s",
            self.now_s()
        );
    }
}

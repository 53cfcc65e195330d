//! kill -9 at random moments: the motor stands within 200 ms of the death of whoever holds the lease or runs the loop.
//!
//! The servo is simulated in the test itself, so that it goes on when processes die, and its own clock tells the time: it stands still
//! while the computer does. `WORMD_KILLS` sets the number of kills (500 for the long run), `WORMD_SEED` the seed.

use super::attending::stalled_terminal;
use super::process::{Process, wait_for};
use super::worm::Worm;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use worm_estimator::config::{Config, Realtime};
use wormd::link::virtual_worm::{Options, VirtualWorm};

const KILLS: usize = 12;
/// By the servo's clock, s.
const BOUND_S: f64 = 0.2;
/// The same after the death of the estimator, which neither holds the lease nor runs the loop: its timeout, and the time in which a
/// busy computer lets the controller notice.
const UNATTENDED_BOUND_S: f64 = 1.0;
/// For so long it is watched whether the motor starts again, s.
const WATCHED_S: f64 = 0.6;
/// One count of the servo's measured speed, rad/s (register 128: 0.229 rev/min).
const COUNT_RAD_S: f64 = 0.229 * std::f64::consts::TAU / 60.0;
/// A hold corrects its angle with no more than this, counts.
const CORRECTION: f64 = 2.0;
/// Loaded pads push a cam without torque no faster than this, counts: 2.3 rev/min.
const PUSHED: f64 = 10.0;

/// What the servo measured.
struct Sample {
    /// Its clock, s.
    time_s: f64,
    /// Its speed, counts.
    speed: f64,
    has_torque: bool,
}

impl Sample {
    /// Whether the motor turns the cam, rather than the loaded pads.
    fn turns(&self) -> bool {
        self.speed > if self.has_torque { CORRECTION } else { PUSHED }
    }
}

#[derive(Default)]
struct Servo {
    measured: Vec<Sample>,
}

impl Servo {
    fn now_s(&self) -> f64 {
        self.measured.last().map_or(0.0, |sample| sample.time_s)
    }

    fn speed(&self) -> f64 {
        self.measured.last().map_or(0.0, |sample| sample.speed)
    }

    fn since(&self, time_s: f64) -> impl DoubleEndedIterator<Item = &Sample> {
        self.measured.iter().filter(move |sample| sample.time_s >= time_s)
    }

    /// How long after `death_s` the motor first stood, and how long after it last turned, s.
    fn stopped_after(&self, death_s: f64) -> (f64, f64) {
        let first_stood = self
            .since(death_s)
            .find(|sample| sample.speed == 0.0 || !sample.has_torque && !sample.turns())
            .map_or(f64::INFINITY, |sample| sample.time_s - death_s);
        let last_turned = self
            .since(death_s)
            .rfind(|sample| sample.turns())
            .map_or(0.0, |sample| sample.time_s - death_s);
        (first_stood, last_turned)
    }

    /// What it measured every ten milliseconds: ms after the death, counts, and a dash where it has no torque.
    fn in_words(&self, death_s: f64) -> String {
        let mut due_ms = 0.0;
        let mut words = String::new();
        for sample in self.since(death_s) {
            let since_ms = 1e3 * (sample.time_s - death_s);
            if since_ms >= due_ms {
                let torque = if sample.has_torque { "" } else { "-" };
                words += &format!(" {since_ms:.0}:{:.0}{torque}", sample.speed);
                due_ms = since_ms + 10.0;
            }
        }
        words
    }
}

/// Kills a process, and returns the time by a clock at which it was last alive. A thread of real time looks, so that a busy computer does
/// not blame the motor for its own delay; and a killed process may take a while to be run once more, to die.
fn kill_and_see_it_die(pid: Pid, realtime: &Realtime, now_s: impl Fn() -> f64 + Send) -> f64 {
    let watch = move || {
        wormd::realtime::request(realtime, 20);
        kill(pid, Signal::SIGKILL).expect("is alive");
        let mut last_alive_s = now_s();
        while is_alive(pid) {
            last_alive_s = now_s();
            std::thread::sleep(Duration::from_millis(1));
        }
        last_alive_s
    };
    std::thread::scope(|scope| scope.spawn(watch).join().expect("it does not panic"))
}

/// Whom to kill, and whether it holds the lease or runs the loop.
const VICTIMS: [(&str, bool); 3] = [("up", true), ("control", true), ("estimate", false)];

/// The process of the worm that runs a subcommand.
fn find(up: &Process, subcommand: &str) -> Option<Pid> {
    if subcommand == "up" {
        return Some(Pid::from_raw(up.id() as i32));
    }
    let children = std::fs::read_to_string(format!("/proc/{0}/task/{0}/children", up.id())).ok()?;
    children.split_whitespace().find_map(|pid| {
        let line = std::fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        let is_it = line.split(|byte| *byte == 0).nth(1) == Some(subcommand.as_bytes());
        is_it.then(|| pid.parse().ok().map(Pid::from_raw)).flatten()
    })
}

/// Whether the process still has its files open.
fn is_alive(pid: Pid) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let state = stat
        .rsplit_once(')')
        .and_then(|(_, rest)| rest.trim_start().chars().next());
    !matches!(state, None | Some('Z' | 'X'))
}

fn setting(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

#[test]
fn the_motor_stands_soon_after_any_kill() {
    let kills = setting("WORMD_KILLS").map_or(KILLS, |kills| kills as usize);
    let seed = setting("WORMD_SEED").unwrap_or(15);
    println!("{kills} kills with seed {seed}");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let worm = Worm::on_a_steady_computer("kills");
    let servo = Arc::new(Mutex::new(Servo::default()));
    let there = Arc::clone(&servo);
    let mut config = Config::default();
    // A motor that is still warm from the last round is no fault.
    config.virtual_worm.ambient_c = 20.0;
    let realtime = config.realtime.clone();
    let mut wanted = Some(realtime.clone());
    let devices = VirtualWorm::spawn_observed(&config, &Options::default(), move |devices, now_s| {
        if let Some(wanted) = wanted.take() {
            // As `wormd virtual-worm` does: a servo answers however busy the computer is.
            wormd::realtime::request(&wanted, 10);
        }
        let speed = (devices.plant().motor().velocity_rad_per_s().abs() / COUNT_RAD_S).round();
        there.lock().expect("no holder panics").measured.push(Sample {
            time_s: now_s,
            speed,
            has_torque: devices.plant().torque_is_on(),
        });
    })
    .expect("a virtual worm");
    let port = devices.path().to_string_lossy().into_owned();
    let servo = || servo.lock().expect("no holder panics");

    let mut delays: Vec<(&str, f64)> = Vec::new();
    let mut early_ends = 0;
    while delays.len() < kills {
        let round = delays.len();
        let (victim, holds_it) = VICTIMS[round % VICTIMS.len()];
        let is_stalled = random.random_bool(0.5);
        let pty = is_stalled.then(stalled_terminal);
        let (invocation, master) = (
            worm.wormd(&["up", "--port", &port]),
            pty.as_ref().map(|pty| pty.master.try_clone()),
        );
        let mut up = match pty {
            Some(pty) => invocation.start_in(pty.slave),
            None => invocation.start_silent(),
        };
        // Mostly while it crawls, and now and then somewhere in the start.
        let is_crawling = random.random_bool(0.8);
        let moment = Duration::from_millis(random.random_range(0..1200));
        wait_for(
            "the cam turns, or the process is there",
            Duration::from_secs(60),
            || {
                let is_reached = match is_crawling {
                    true => servo().speed() > 50.0,
                    false => find(&up, victim).is_some(),
                };
                is_reached || up.exit_status().is_some()
            },
        );
        std::thread::sleep(moment);
        let Some(pid) = find(&up, victim).filter(|_| up.exit_status().is_none()) else {
            // A computer that is too busy for the worm stops it with a fault.
            early_ends += 1;
            assert!(
                early_ends < 3 + kills / 4,
                "`wormd up` ended by itself {early_ends} times"
            );
            up.ends_within(Duration::from_secs(60));
            continue;
        };
        {
            let mut servo = servo();
            let now_s = servo.now_s();
            servo.measured.retain(|sample| sample.time_s >= now_s);
        }
        let death_s = kill_and_see_it_die(pid, &realtime, || servo().now_s());
        wait_for("the servo's clock goes on", Duration::from_secs(60), || {
            servo().now_s() > death_s + if holds_it { WATCHED_S } else { 2.0 }
        });
        let (first_stood, last_turned) = servo().stopped_after(death_s);
        let bound_s = if holds_it { BOUND_S } else { UNATTENDED_BOUND_S };
        assert!(
            first_stood.max(last_turned) <= bound_s,
            "round {round}, {victim} killed, terminal stalled: {is_stalled}: stood after {first_stood:.3} s, turned until {last_turned:.3} s; {}",
            servo().in_words(death_s)
        );
        delays.push((victim, first_stood.max(last_turned)));
        // Killed, or because another process has ended.
        up.ends_within(Duration::from_secs(60));
        drop(master);
    }
    for (victim, _) in VICTIMS {
        let mut of_victim: Vec<f64> = delays
            .iter()
            .filter(|(of, _)| *of == victim)
            .map(|(_, delay_s)| *delay_s)
            .collect();
        of_victim.sort_by(f64::total_cmp);
        let at = |share: f64| {
            of_victim
                .get((share * (of_victim.len() as f64 - 1.0)).round() as usize)
                .map_or(0.0, |delay_s| delay_s * 1e3)
        };
        println!(
            "{victim}: {} kills, stopped after {:.0} ms (median), {:.0} ms (p99), {:.0} ms (max)",
            of_victim.len(),
            at(0.5),
            at(0.99),
            at(1.0)
        );
    }
    wait_for("a run after all kills", Duration::from_secs(120), || {
        let output = worm
            .wormd(&["up", "--port", &port, "--json", "--duration", "1"])
            .output();
        output.status.success()
    });
    worm.wait_until_nothing_is_left();
}

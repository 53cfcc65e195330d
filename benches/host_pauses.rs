//! Whether `wormd up` works on a computer that is busy or pauses: repeated runs of `wormd up --json`, beside busy loops and with its
//! processes suspended at random, and the result of each.
//!
//! ```sh
//! cargo bench --bench host_pauses                              # one run of each scenario
//! cargo bench --bench host_pauses -- --runs 50 --scenario d    # all disturbances together, fifty times
//! ```
//!
//! | scenario | disturbance |
//! |---|---|
//! | `a` | four busy loops at normal priority |
//! | `b` | its three processes are suspended together for 20 to 300 ms, about once a second |
//! | `c` | one of the three is suspended for 20 to 60 ms, about once a second |
//! | `d` | all of that |
//!
//! A run is good when it ends without fault or alarm, loses no sample, and each settled cycle's energies are within 3 % of those
//! without pauses: the medians of an undisturbed run at the beginning. Exit status 1 when any run was not good.

use testkit::process_pauses as host_pauses;

use clap::Parser;
use host_pauses::{HostPauses, Pause};
use nix::unistd::Pid;
use serde_json::Value;
use std::process::{Command, ExitCode, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

const ENERGIES: [&str; 5] = [
    "energy_loss_j",
    "energy_actuator_net_j",
    "energy_actuator_positive_j",
    "energy_electrical_j",
    "energy_copper_j",
];
/// Largest relative deviation of a settled cycle's energy from the undisturbed one.
const NEAR: f64 = 0.03;
const BUSY_LOOPS: usize = 4;
/// Time between pauses, ms.
const BETWEEN: std::ops::Range<u64> = 300..1400;

#[derive(Parser)]
struct Arguments {
    /// Runs of each scenario
    #[arg(long, default_value_t = 1)]
    runs: u32,
    /// Seconds of crawling in each run
    #[arg(long, default_value_t = 20)]
    duration: u32,
    /// Scenarios, some of a, b, c, d
    #[arg(long, value_delimiter = ',', default_value = "a,b,c,d")]
    scenario: Vec<char>,
    /// Seed of the pauses
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Given by cargo
    #[arg(long, hide = true)]
    bench: bool,
}

/// Busy loops that run until this is dropped.
struct Load {
    end: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Load {
    fn start(loops: usize) -> Self {
        let end = Arc::new(AtomicBool::new(false));
        let threads = (0..loops).map(|_| {
            let end = Arc::clone(&end);
            std::thread::spawn(move || while !end.load(Ordering::Relaxed) {})
        });
        Self {
            threads: threads.collect(),
            end,
        }
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A busy loop cannot panic.
            let _ = thread.join();
        }
    }
}

/// One run's summary, with how it ended.
struct Run {
    summary: Value,
    succeeded: bool,
    log: String,
    pauses: u64,
    duration_s: u32,
}

fn run(arguments: &Arguments, scenario: Option<char>, number: u32) -> Run {
    let kinds = match scenario {
        Some('b') => vec![Pause::Together(20..300)],
        Some('c') => vec![Pause::OneOf(20..60)],
        Some('d') => vec![Pause::Together(20..300), Pause::OneOf(20..60)],
        _ => Vec::new(),
    };
    let _load = matches!(scenario, Some('a' | 'd')).then(|| Load::start(BUSY_LOOPS));
    let child = Command::new(env!("CARGO_BIN_EXE_wormd"))
        .args(["up", "--json", "--duration", &arguments.duration.to_string()])
        .args(["--name", &format!("hp{}", std::process::id())])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let pauses = (!kinds.is_empty()).then(|| {
        let pauses = HostPauses::start(kinds, BETWEEN, arguments.seed + u64::from(number));
        pauses.processes().push(Pid::from_raw(child.id() as i32));
        pauses
    });
    let output = child.wait_with_output().expect("it ends");
    Run {
        summary: serde_json::from_slice(&output.stdout).unwrap_or(Value::Null),
        succeeded: output.status.success(),
        log: String::from_utf8_lossy(&output.stderr).into_owned(),
        pauses: pauses.map_or(0, |pauses| pauses.made()),
        duration_s: arguments.duration,
    }
}

/// An energy of each settled cycle, J, except one that ended while the worm was being stopped: braking costs copper heat.
fn energies(summary: &Value, name: &str, duration_s: u32) -> Vec<f64> {
    let cycles = summary["cycles"].as_array().map_or(&[][..], Vec::as_slice);
    let mut ended_s = 0.0;
    cycles
        .iter()
        .filter(|cycle| {
            ended_s += cycle["duration_s"].as_f64().unwrap_or(f64::NAN);
            cycle["settled"] == true && ended_s < f64::from(duration_s) - 0.1
        })
        .map(|cycle| cycle[name].as_f64().unwrap_or(f64::NAN))
        .collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

impl Run {
    /// The largest deviation of any energy of a settled cycle from the undisturbed ones.
    fn farthest(&self, undisturbed: &[f64]) -> f64 {
        let deviations = ENERGIES.iter().zip(undisturbed).flat_map(|(name, reference_j)| {
            energies(&self.summary, name, self.duration_s)
                .into_iter()
                .map(move |energy_j| (energy_j / reference_j - 1.0).abs())
        });
        // A NaN counts as the largest deviation.
        deviations.fold(
            0.0,
            |farthest, deviation| if deviation <= farthest { farthest } else { deviation },
        )
    }

    /// What is wrong with the run.
    fn troubles(&self, undisturbed: &[f64]) -> Vec<String> {
        let mut troubles = Vec::new();
        let mut expect = |holds: bool, trouble: String| {
            if !holds {
                troubles.push(trouble);
            }
        };
        let Self { summary, .. } = self;
        expect(
            self.succeeded,
            format!("it failed: {}", self.log.lines().last().unwrap_or("")),
        );
        expect(summary["fault"] == "none", format!("fault {}", summary["fault"]));
        expect(
            summary["alarms"] == serde_json::json!([]),
            format!("alarms {}", summary["alarms"]),
        );
        expect(
            summary["samples_lost"] == 0,
            format!("{} samples lost", summary["samples_lost"]),
        );
        expect(
            !energies(summary, ENERGIES[0], self.duration_s).is_empty(),
            "no settled cycle".to_owned(),
        );
        let farthest = self.farthest(undisturbed);
        expect(farthest < NEAR, format!("an energy is {:.1} % off", 100.0 * farthest));
        troubles
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let quiet = run(&arguments, None, 0);
    let undisturbed = ENERGIES.map(|name| median(energies(&quiet.summary, name, quiet.duration_s)));
    println!(
        "undisturbed: {} ticks, {} overruns, host_pauses {}; medians in mJ: {}",
        quiet.summary["ticks"],
        quiet.summary["overruns"],
        quiet.summary["timing"]["host_pauses"],
        ENERGIES
            .iter()
            .zip(undisturbed)
            .map(|(name, energy_j)| format!("{name} {:.2}", 1e3 * energy_j))
            .collect::<Vec<_>>()
            .join(", ")
    );
    let mut all_good = true;
    for &scenario in &arguments.scenario {
        let mut good = 0;
        let mut farthest: f64 = 0.0;
        let mut pauses = 0;
        for number in 0..arguments.runs {
            let run = run(&arguments, Some(scenario), number);
            let troubles = run.troubles(&undisturbed);
            if troubles.is_empty() {
                good += 1;
            } else {
                println!("scenario {scenario}, run {number}: {}", troubles.join("; "));
            }
            farthest = farthest.max(run.farthest(&undisturbed));
            pauses += run.pauses;
        }
        println!(
            "scenario {scenario}: {good} of {} good, {pauses} pauses made, energies at most {:.1} % off",
            arguments.runs,
            100.0 * farthest
        );
        all_good &= good == arguments.runs;
    }
    if all_good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

//! The `wormd` binary: finds the subcommand, runs it, and turns its outcome into an exit status.

use clap::{CommandFactory, Parser, Subcommand};
use std::io::IsTerminal;
use std::process::ExitCode;
use std::time::Duration;
use tracing_subscriber::filter::filter_fn;
use tracing_subscriber::layer::{Layer, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;
use wormd::command::{self, Failure};

/// How long a log that is printed in the background may take at the end; a terminal that nobody reads takes for ever.
const LOG_PATIENCE: Duration = Duration::from_secs(1);

/// Real-time controller and telemetry daemon for an untethered earthworm robot
#[derive(Debug, Parser)]
#[command(name = "wormd", version, about, max_term_width = 100)]
struct Arguments {
    /// Log more: -v for what each process does, -vv for everything
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
    #[command(subcommand)]
    command: Subcommands,
}

#[derive(Debug, Subcommand)]
enum Subcommands {
    /// The main job: virtual worm (unless a port is configured), controller and estimator, with a live status
    Up(command::up::UpArgs),
    /// The controller alone
    Control(command::control::ControlArgs),
    /// The estimator alone
    Estimate(command::estimate::EstimateArgs),
    /// The simulated devices on a pseudo-terminal
    VirtualWorm(command::virtual_worm::VirtualWormArgs),
    /// A fault of a running virtual worm, switched on or off
    Fault(command::fault::FaultArgs),
    /// A command to a running controller
    Command(command::send_command::SendCommandArgs),
    /// A running worm in a terminal, with keys to crawl, hold, stop and reset
    Watch(command::watch::WatchArgs),
    /// A running worm in a browser, for anyone to watch and halt, and for one to drive
    #[cfg(feature = "dashboard")]
    Dashboard(command::dashboard::DashboardArgs),
    /// The topics of a worm, live, for Foxglove to show
    #[cfg(feature = "foxglove")]
    Foxglove(command::foxglove::FoxgloveArgs),
    /// Worms of this computer for laptops elsewhere
    #[cfg(feature = "bridge")]
    Bridge(command::bridge::BridgeArgs),
    /// Worms of robots elsewhere, offered here to watch, dashboard and programs
    #[cfg(feature = "bridge")]
    Fleet(command::fleet::FleetArgs),
    /// Serves the watchers of a worm; they start it by themselves
    Relay(command::relay::RelayArgs),
    /// The topics of a worm into a log (MCAP)
    Record(command::record::RecordArgs),
    /// The topics of a worm and the messages on them, for programs in other languages
    Topics(command::topics::TopicsArgs),
    /// What the black box has kept: lists, and copies over a link that breaks
    BlackBox(command::black_box::BlackBoxArgs),
    /// Why a worm stopped: the first reason, what led there, and what to do, from a box or any other log
    Why(command::why::WhyArgs),
    /// Run a log through the estimator again, and compare the results
    Replay(command::replay::ReplayArgs),
    /// Friction, stiffness, advance and energy from the motor's current in a log, without looking at positions
    Infer(command::infer::InferArgs),
    /// Friction of the gears from slow turns of a running worm, lifted or on the level, into its configuration
    Calibrate(command::calibrate::CalibrateArgs),
    /// A log as Parquet or CSV tables, or as a complete log of one that was cut off
    Export(command::export::ExportArgs),
    /// Distance and energy of a design: Tables 1 and 2 of the paper, range on a battery
    Study(command::study::StudyArgs),
    /// A trip on the battery: energy, time, range, where it fails, and the best design for a route
    Plan(command::plan::PlanArgs),
    /// Make a trip along a route on board: out and home, as far as battery and link allow
    Trip(command::trip::TripArgs),
    /// The paper's experiment on a recording: tip deformations, slides, energy, figures
    #[cfg(feature = "analysis")]
    Analyze(command::analyze::AnalyzeArgs),
    /// Where model and recordings disagree, and which physical effect the model misses
    #[cfg(feature = "analysis")]
    Explain(command::explain::ExplainArgs),
    /// Predict recordings by a model that was not fitted to them, and say how far off it is
    #[cfg(feature = "analysis")]
    Predict(command::predict::PredictArgs),
    /// A servo that moves an arm on a bench: recordings of it for `wormd explain`
    ServoBench(command::servo_bench::ServoBenchArgs),
    /// A recording from the model: what motion capture would have seen
    #[cfg(feature = "analysis")]
    Simulate(command::simulate::SimulateArgs),
    /// The loop's own latency, from deadline to alarm, against what this computer can do at best
    Latency(command::latency::LatencyArgs),
    /// The bare sleeper of `wormd latency`
    #[command(hide = true)]
    LatencyFloor(command::latency_floor::LatencyFloorArgs),
    /// Many hours in virtual time with drawn worms and faults: do alarms and stops come when they must, and only then?
    Soak(command::soak::SoakArgs),
    /// The worms that run on this computer, and how they stand
    Status(command::status::StatusArgs),
    /// Everything that support needs of a worm, in one archive: configuration, versions, check, last box, logs
    Bundle(command::bundle::BundleArgs),
    /// Man pages and shell completions, for a package
    #[command(hide = true)]
    Manual(command::manual::ManualArgs),
    /// Preflight: configuration, port, permissions, scheduler, and what to do about each finding
    Check(command::check::CheckArgs),
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let verbose = arguments.verbose;
    let level = match verbose {
        0 => tracing::Level::WARN,
        1 => tracing::Level::INFO,
        2 => tracing::Level::DEBUG,
        _ => tracing::Level::TRACE,
    };
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(|| command::LogOutput)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        // It would panic when standard error is closed: the parent was killed, or the terminal closed.
        .log_internal_errors(false)
        .compact();
    // Zenoh also warns of what is meant to be so, as that gossip is off.
    let is_of_interest = move |metadata: &tracing::Metadata<'_>| {
        let is_quiet = metadata.target().starts_with("zenoh") && verbose < 2;
        *metadata.level() <= if is_quiet { tracing::Level::ERROR } else { level }
    };
    let lines = lines.with_filter(filter_fn(is_of_interest).with_max_level_hint(level));
    let subscriber = tracing_subscriber::registry().with(lines);
    #[cfg(feature = "bridge")]
    let subscriber = {
        let has_links = matches!(arguments.command, Subcommands::Bridge(_) | Subcommands::Fleet(_));
        let of_links = filter_fn(command::bridge::LinkLog::takes).with_max_level_hint(tracing::Level::DEBUG);
        subscriber.with(has_links.then(|| command::bridge::LinkLog.with_filter(of_links)))
    };
    subscriber.init();
    let code = match run(arguments.command, verbose) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            command::log_line(format_args!("wormd: {failure}"));
            failure.exit_code()
        }
    };
    command::finish_log(LOG_PATIENCE);
    code
}

fn run(command: Subcommands, verbose: u8) -> Result<(), Failure> {
    match command {
        Subcommands::Up(args) => command::up::run(&args, verbose),
        Subcommands::Control(args) => command::control::run(&args),
        Subcommands::Estimate(args) => command::estimate::run(&args),
        Subcommands::VirtualWorm(args) => command::virtual_worm::run(&args),
        Subcommands::Fault(args) => command::fault::run(&args),
        Subcommands::Command(args) => command::send_command::run(&args),
        Subcommands::Watch(args) => command::watch::run(&args),
        #[cfg(feature = "dashboard")]
        Subcommands::Dashboard(args) => command::dashboard::run(&args),
        #[cfg(feature = "foxglove")]
        Subcommands::Foxglove(args) => command::foxglove::run(&args),
        #[cfg(feature = "bridge")]
        Subcommands::Bridge(args) => command::bridge::run(&args),
        #[cfg(feature = "bridge")]
        Subcommands::Fleet(args) => command::fleet::run(&args),
        Subcommands::Relay(args) => command::relay::run(&args),
        Subcommands::Record(args) => command::record::run(&args),
        Subcommands::Topics(args) => command::topics::run(&args),
        Subcommands::BlackBox(args) => command::black_box::run(&args),
        Subcommands::Why(args) => command::why::run(&args),
        Subcommands::Replay(args) => command::replay::run(&args),
        Subcommands::Infer(args) => command::infer::run(&args),
        Subcommands::Calibrate(args) => command::calibrate::run(&args),
        Subcommands::Export(args) => command::export::run(&args),
        Subcommands::Study(args) => command::study::run(&args),
        Subcommands::Plan(args) => command::plan::run(&args),
        Subcommands::Trip(args) => command::trip::run(&args),
        #[cfg(feature = "analysis")]
        Subcommands::Analyze(args) => command::analyze::run(&args),
        #[cfg(feature = "analysis")]
        Subcommands::Explain(args) => command::explain::run(&args),
        #[cfg(feature = "analysis")]
        Subcommands::Predict(args) => command::predict::run(&args),
        Subcommands::ServoBench(args) => command::servo_bench::run(&args),
        #[cfg(feature = "analysis")]
        Subcommands::Simulate(args) => command::simulate::run(&args),
        Subcommands::Latency(args) => command::latency::run(&args, verbose),
        Subcommands::LatencyFloor(args) => command::latency_floor::run(&args),
        Subcommands::Soak(args) => command::soak::run(&args),
        Subcommands::Status(args) => command::status::run(&args),
        Subcommands::Bundle(args) => command::bundle::run(&args),
        Subcommands::Manual(args) => command::manual::run(&args, Arguments::command()),
        Subcommands::Check(args) => command::check::run(&args),
    }
}

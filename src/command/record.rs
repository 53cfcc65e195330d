//! `wormd record`: the topics of a worm into a log, or its black box; of a worm over a network what its relay sends.

use super::recording_limits::RecordingLimits;
use super::{Failure, WormArgs, end_on_signal, positive_seconds, print};
use crate::attendance::{RoundCounter, ServiceManager, end_after_controller, end_with_parent};
use crate::black_box::BlackBox;
use crate::recorder::{FileOptions, NetworkRecorder, NetworkWorm, Recorder, record};
use crate::topics::{Controller, Instance, RoleLock};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use worm_estimator::config::Config;
use worm_log::Channel;

/// What is recorded by default.
pub(super) const ALL_TOPICS: &str = "state,timing,estimate,cycle,alarm,range,command,trip,inferred";

/// Arguments of `wormd record`.
#[derive(Debug, Args)]
pub struct RecordArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// The log, an MCAP file
    #[arg(long, value_name = "FILE", required_unless_present = "black_box")]
    out: Option<PathBuf>,
    /// Instead of a log: the moments around each alarm and fault, as files in this folder, and a thin log of the rest. Without DIR, in
    /// `black_box.folder` of the configuration
    #[arg(long, value_name = "DIR", num_args = 0..=1, conflicts_with_all = ["out", "force", "duration", "topics", "max_size", "max_age", "keep", "max_total", "no_index", "rate"])]
    black_box: Option<Option<PathBuf>>,
    #[command(flatten)]
    limits: RecordingLimits,
    /// Overwrite existing files
    #[arg(long)]
    force: bool,
    /// End after this time, counted from the first message; without it, on Ctrl-C
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds, allow_negative_numbers = true)]
    duration: Option<Duration>,
    /// Only these topics, and always the commands that the controller got
    #[arg(long, value_name = "TOPIC,…", value_delimiter = ',', value_parser = channel, default_value = ALL_TOPICS)]
    topics: Vec<Channel>,
    /// End when standard input ends: for a program that starts the recorder, whose end then completes the log
    #[arg(long)]
    end_with_stdin: bool,
    /// Standard input is a pipe from the process that watches over the worm
    #[arg(long, hide = true, conflicts_with = "end_with_stdin")]
    supervised: bool,
}

pub(super) fn channel(name: &str) -> Result<Channel, String> {
    Channel::from_name(name).ok_or_else(|| {
        let names: Vec<_> = Channel::ALL.iter().map(|channel| channel.name()).collect();
        format!(
            "there is no topic of this name to record: give some of {}",
            names.join(", ")
        )
    })
}

/// Runs `wormd record` until a signal ends it, or its time is over. Prints the line "ready" on standard output once it listens.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration, worm or file that cannot be used; [`Failure::Failed`] when the topics fail or
/// the file cannot be written.
pub fn run(args: &RecordArgs) -> Result<(), Failure> {
    print::log_in_background()?;
    let (config, text) = args.worm.load_with_text()?;
    let options = args.limits.file_options().map_err(Failure::unusable)?;
    let end = end_on_signal()?;
    if args.end_with_stdin {
        end_with_parent(&end)?;
    }
    let rounds = RoundCounter::default();
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let (_service, elsewhere) = if args.supervised {
        end_after_controller(&instance, &end)?;
        (None, None)
    } else {
        let service = ServiceManager::inform_of_rounds(&end, &rounds)?;
        (Some(service), NetworkWorm::find(&instance, args.worm.forward())?)
    };
    let Some(out) = &args.out else {
        refuse_black_box(elsewhere.as_ref(), &config)?;
        return run_black_box(args, &config, text, &end, &rounds);
    };
    if let Some(worm) = elsewhere {
        if options.rate_hz.is_some() {
            return Err(Failure::unusable(
                "over a network 20 ticks a second come, and --rate cannot change that: leave it out, or record on the robot",
            ));
        }
        return run_over_network(args, worm, text, (out, options), &end, &rounds);
    }
    let mut recorder = Recorder::open(&config, text, &args.topics, out, args.force, options)?;
    let (worm, file) = (&config.worm.name, out.display());
    print::log_line(format_args!("recording {worm} to {file}, from its first message on"));
    if !args.supervised && RoleLock::<Controller>::holder(&instance).is_none() {
        print::log_line(format_args!(
            "no worm {worm} is running yet: start it with `wormd up --name {worm}`; one of a robot elsewhere is recorded if `wormd fleet` \
             offers it before this begins"
        ));
    }
    print::ready();
    let outcome = record(&mut recorder, args.duration, &end, &rounds);
    // The log is completed whatever ended the recording.
    print::log_line(recorder.close()?);
    outcome
}

fn run_over_network(
    args: &RecordArgs,
    worm: NetworkWorm,
    text: Option<String>,
    (out, options): (&Path, FileOptions),
    end: &AtomicBool,
    rounds: &RoundCounter,
) -> Result<(), Failure> {
    let robot = worm.robot().unwrap_or("a robot that was not heard yet").to_owned();
    let mut recorder = NetworkRecorder::open(worm, text, &args.topics, out, args.force, options)?;
    print::log_line(format_args!(
        "recording from {robot} over the network to {}, 20 ticks a second: for every tick record on the robot and copy the file \
         (`wormd black-box get`, scp)",
        out.display()
    ));
    print::ready();
    let outcome = record(&mut recorder, args.duration, end, rounds);
    // The log is completed whatever ended the recording.
    let Some(summary) = recorder.close()? else {
        let nothing = "nothing came of the worm, so no log was written: `wormd fleet` says whether its robot is there";
        return outcome.and(Err(Failure::failed(nothing)));
    };
    print::log_line(summary);
    outcome
}

/// The moments around an alarm are worth every tick, and those are on the robot.
fn refuse_black_box(elsewhere: Option<&NetworkWorm>, config: &Config) -> Result<(), Failure> {
    let Some(worm) = elsewhere else { return Ok(()) };
    let (name, robot) = (&config.worm.name, worm.robot().unwrap_or("a robot elsewhere"));
    Err(Failure::unusable(format!(
        "{name} is a worm of {robot}, and a black box belongs on the robot, where every tick is: run `wormd record --black-box DIR` there, \
         and copy its boxes with `wormd black-box get`"
    )))
}

fn run_black_box(
    args: &RecordArgs,
    config: &Config,
    text: Option<String>,
    end: &AtomicBool,
    rounds: &RoundCounter,
) -> Result<(), Failure> {
    let given = args.black_box.clone().flatten();
    let configured = || config.black_box.as_ref()?.folder.as_ref().map(PathBuf::from);
    let folder = given.or_else(configured).ok_or_else(|| {
        Failure::unusable("in which folder? Give --black-box DIR, or set black_box.folder in the configuration")
    })?;
    let mut black_box = BlackBox::open(config, text, &folder)?;
    let (worm, folder) = (&config.worm.name, folder.display());
    print::log_line(format_args!("black box of {worm} in {folder}"));
    print::ready();
    let outcome = black_box.run(end, rounds);
    print::log_line(black_box.close()?);
    outcome
}

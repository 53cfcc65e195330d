//! `wormd trip`: makes a trip along a route, and tells one that is under way what to do.

use super::{Failure, WormArgs, end_on_signal, positive_seconds, print, require_worm};
use crate::realtime::monotonic_ns;
use crate::supervisor::controller::refuse_foreign;
use crate::topics::{Instance, RoleLock, Trip};
use crate::trip::wire::{Ask, Attendance, Question};
use crate::trip::{self, words};
use clap::{Args, Subcommand, ValueEnum};
use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use worm_estimator::config::{Config, OnLinkLoss, read_text};
use worm_estimator::message::{JsonMessage, TripPhase, TripStatus};
use worm_plan::{Guide, Heading, Route, Workbench};

/// How often `attend` says that it is there.
const ATTEND: Duration = Duration::from_millis(500);

/// Arguments of `wormd trip`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct TripArgs {
    #[command(subcommand)]
    order: Option<OrderArgs>,
    /// The route: CSV with the columns length_m and slope_deg, and cycle_s where a leg has a speed of its own; a line for each leg
    #[arg(value_name = "ROUTE.csv", required = true)]
    route: Option<PathBuf>,
    #[command(flatten)]
    worm: WormArgs,
    /// What to do when nobody was heard for --link-timeout, instead of trip.link_loss
    #[arg(long, value_enum)]
    link_loss: Option<LinkLossArg>,
    /// Silence after which the link counts as lost, instead of trip.link_timeout_s
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds, allow_negative_numbers = true)]
    link_timeout: Option<Duration>,
    /// Share of the battery's energy kept back beyond the way home, instead of trip.reserve_share
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    reserve: Option<f64>,
    /// Come home from the end of the route; so without this, too
    #[arg(long, conflicts_with = "one_way")]
    return_home: bool,
    /// The trip is over at the end of the route
    #[arg(long)]
    one_way: bool,
    /// Go on without this terminal, in a session of its own; what happens is in the computer's log
    #[arg(long)]
    detach: bool,
    /// Print one JSON object at the end instead of text; with --detach, the trip's process once the worm crawls
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum LinkLossArg {
    /// The worm holds
    Hold,
    /// It goes home
    Return,
    /// It goes on
    Continue,
}

/// What a trip that is under way is told.
#[derive(Debug, Subcommand)]
enum OrderArgs {
    /// How the trip stands
    Status(OrderWorm),
    /// The worm holds, and the trip waits
    Pause(OrderWorm),
    /// The trip goes on
    Resume(OrderWorm),
    /// The worm goes home
    Return(OrderWorm),
    /// The worm goes out again, if what is left in the battery permits it
    Outbound(OrderWorm),
    /// The trip is over, and the worm holds
    Abort(OrderWorm),
    /// Say once that somebody attends
    Alive(OrderWorm),
    /// Say that somebody attends for as long as this command runs
    Attend(OrderWorm),
}

#[derive(Debug, Args)]
struct OrderWorm {
    #[command(flatten)]
    worm: WormArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Runs `wormd trip`.
///
/// # Errors
/// [`Failure::Unusable`] for a route, configuration or worm that cannot be used, a leg that the worm cannot crawl, and beside another trip;
/// [`Failure::Failed`] when the trip ends before it is over, or refuses what it is told.
pub fn run(args: &TripArgs) -> Result<(), Failure> {
    match (&args.order, &args.route) {
        (Some(order), _) => tell(order),
        (None, Some(route)) if args.detach => detach(args, route),
        (None, Some(route)) => travel(args, route),
        (None, None) => Err(Failure::unusable("give a route: `wormd trip ROUTE.csv`")),
    }
}

fn travel(args: &TripArgs, file: &Path) -> Result<(), Failure> {
    print::log_in_background()?;
    let config = args.config()?;
    if !config.tracker.present && !config.self_sensing.enabled {
        return Err(Failure::unusable(
            "nobody would know where the worm is on its trip: tracker.present and self_sensing.enabled are both false. Enable self-sensing, \
             or make it crawl for a while with `wormd command crawl`",
        ));
    }
    let bench = Workbench::new(&config).map_err(Failure::unusable)?;
    let text = read_text(file).map_err(|error| {
        let file = file.display();
        Failure::unusable(format!(
            "{file}: {error}: give a CSV file with the columns length_m and slope_deg"
        ))
    })?;
    let route = Route::from_csv(&text, file).map_err(Failure::unusable)?;
    let guide = Guide::new(&bench, &config, &route, !args.one_way, monotonic_ns())
        .map_err(|impassable| Failure::unusable(format!("{}: {impassable}", file.display())))?;
    let end = end_on_signal()?;
    refuse_foreign(&config)?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    require_worm(&instance)?;
    let role = RoleLock::<Trip>::take(&instance).map_err(Failure::unusable)?;
    print::log_line(plan_text(&config, &guide, !args.one_way));
    // With --json nothing but the object is printed there.
    let begun = || {
        if !args.json {
            print::ready();
        }
    };
    let last = trip::run(guide, &instance, &role, &end, begun)?;
    args.print(&config, &last)?;
    if last.phase == TripPhase::Done.code() {
        Ok(())
    } else {
        Err(Failure::failed(words::change(&last)))
    }
}

/// What the trip is about, before it begins.
fn plan_text(config: &Config, guide: &Guide, return_home: bool) -> String {
    let way = guide.itinerary();
    let time = |heading| {
        way.cost(0.0, way.length_m(), heading).map_or_else(
            || "impossible".to_owned(),
            |cost| format!("{:.0} min", cost.time_s / 60.0),
        )
    };
    let trip = &config.trip;
    let lost = match trip.link_loss {
        OnLinkLoss::Hold => "it holds",
        OnLinkLoss::Return => "it goes home",
        OnLinkLoss::Continue => "it goes on",
    };
    let battery = match config.battery {
        Some(_) => format!("reserve {:.0} % of the battery", 100.0 * trip.reserve_share),
        None => "no [battery] is configured: the trip does not watch the energy".to_owned(),
    };
    let reckoned = if config.tracker.present {
        ""
    } else {
        "; without a tracker it goes by the motor's current: its place is uncertain by some percent of the way"
    };
    format!(
        "{}: {} legs, {:.2} m; out {}, home {}{}; when nobody is heard for {} s {lost}; {battery}{reckoned}",
        config.worm.name,
        way.legs().len(),
        way.length_m(),
        time(Heading::Out),
        time(Heading::Home),
        if return_home { "" } else { " (one way)" },
        trip.link_timeout_s,
    )
}

/// Starts the same command in a session of its own, and waits until its worm crawls.
fn detach(args: &TripArgs, route: &Path) -> Result<(), Failure> {
    let program = std::env::current_exe().map_err(Failure::failed)?;
    let mut command = Command::new(program);
    command.arg("trip").arg(route).args(args.worm.forward());
    if let Some(policy) = args.link_loss {
        command.args(["--link-loss", policy.name()]);
    }
    if let Some(timeout) = args.link_timeout {
        command.args(["--link-timeout", &timeout.as_secs_f64().to_string()]);
    }
    if let Some(reserve) = args.reserve {
        command.args(["--reserve", &reserve.to_string()]);
    }
    if args.one_way {
        command.arg("--one-way");
    }
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    // SAFETY: setsid is async-signal-safe, and nothing is allocated between fork and exec.
    unsafe {
        // Neither Ctrl-C nor the end of this terminal is meant for it.
        command.pre_exec(|| nix::unistd::setsid().map(drop).map_err(std::io::Error::from));
    }
    let mut process = command.spawn().map_err(Failure::failed)?;
    let log = process.stderr.take();
    let log = std::thread::spawn(move || {
        let lines = log.into_iter().flat_map(|log| BufReader::new(log).lines());
        lines.map_while(Result::ok).for_each(print::log_line);
    });
    let out = process.stdout.take();
    let is_ready = out.is_some_and(|out| {
        let mut lines = BufReader::new(out).lines().map_while(Result::ok);
        lines.any(|line| line == "ready")
    });
    if is_ready && args.json {
        return print::line(serde_json::json!({ "process": process.id() }));
    }
    if is_ready {
        print::log_line(format_args!(
            "the trip goes on as process {}: `wormd trip status` says how it stands",
            process.id()
        ));
        return Ok(());
    }
    let status = process.wait().map_err(Failure::failed)?;
    // What it said is on standard error already.
    let _ = log.join();
    let reason = "the trip did not begin: the lines above say why";
    Err(match status.code() {
        Some(2) => Failure::unusable(reason),
        _ => Failure::failed(reason),
    })
}

fn tell(order: &OrderArgs) -> Result<(), Failure> {
    let (ask, args) = match order {
        OrderArgs::Status(args) => (Ask::Status, args),
        OrderArgs::Pause(args) => (Ask::Pause, args),
        OrderArgs::Resume(args) => (Ask::Resume, args),
        OrderArgs::Return(args) => (Ask::Return, args),
        OrderArgs::Outbound(args) => (Ask::Outbound, args),
        OrderArgs::Abort(args) => (Ask::Abort, args),
        OrderArgs::Alive(args) | OrderArgs::Attend(args) => (Ask::Alive, args),
    };
    let config = args.worm.load()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    require_worm(&instance)?;
    if matches!(order, OrderArgs::Attend(_)) {
        return attend(&config, &instance);
    }
    let question = Question { ask, by: by() };
    let answer = trip::wire::ask(&instance, &question)?;
    if args.json {
        print::line(&answer.trip)?;
    }
    if let Some(refusal) = answer.refusal {
        return Err(Failure::failed(format!("{} refused: {refusal}", ask.name())));
    }
    if args.json {
        return Ok(());
    }
    let bytes = serde_json::to_vec(&answer.trip).map_err(Failure::failed)?;
    let status = TripStatus::read_json(&bytes).map_err(|error| {
        Failure::failed(format!(
            "the trip is of another version of wormd ({error}): --json shows its answer"
        ))
    })?;
    print::line(words::line(&status))?;
    words::energy(&status).map_or(Ok(()), print::line)
}

/// Attends until it is told to end.
fn attend(config: &Config, instance: &Instance) -> Result<(), Failure> {
    let end: std::sync::Arc<AtomicBool> = end_on_signal()?;
    let attendance = Attendance::open(instance, &by()).map_err(Failure::failed)?;
    print::log_line(format_args!("{}: attends until Ctrl-C", config.worm.name));
    print::ready();
    while !end.load(Ordering::Relaxed) {
        attendance.say();
        std::thread::sleep(ATTEND);
    }
    Ok(())
}

/// Who tells the trip so, for the record.
fn by() -> String {
    let user = nix::unistd::User::from_uid(nix::unistd::getuid()).ok().flatten();
    user.map_or_else(|| format!("user {}", nix::unistd::getuid()), |user| user.name)
}

impl LinkLossArg {
    const fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Return => "return",
            Self::Continue => "continue",
        }
    }
}

impl TripArgs {
    /// The configuration, with what the command line says instead, checked.
    fn config(&self) -> Result<Config, Failure> {
        let mut config = self.worm.load()?;
        if let Some(policy) = self.link_loss {
            config.trip.link_loss = match policy {
                LinkLossArg::Hold => OnLinkLoss::Hold,
                LinkLossArg::Return => OnLinkLoss::Return,
                LinkLossArg::Continue => OnLinkLoss::Continue,
            };
        }
        if let Some(timeout) = self.link_timeout {
            config.trip.link_timeout_s = timeout.as_secs_f64();
        }
        if let Some(reserve) = self.reserve {
            config.trip.reserve_share = reserve;
        }
        super::checked(config)
    }

    fn print(&self, config: &Config, last: &TripStatus) -> Result<(), Failure> {
        if !self.json {
            return print::line(words::line(last));
        }
        let mut trip = trip::json_of(last).map_err(Failure::failed)?;
        trip["worm"] = config.worm.name.clone().into();
        trip["duration_s"] = (last.time_ns.saturating_sub(last.started_ns) as f64 * 1e-9).into();
        print::line(trip)
    }
}

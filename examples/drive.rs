//! Commands a running worm: arms it, lets it crawl five centimetres or for a minute, whichever comes first, and stops it.
//!
//! ```sh
//! wormd virtual-worm --link /tmp/worm-port &
//! wormd control --port /tmp/worm-port &
//! wormd estimate --port /tmp/worm-port &
//! cargo run --release --example drive            # another worm: -- NAME
//! ```
//!
//! A command is a request with an answer: the controller accepts it, or refuses it with a reason. A worm that crawls already,
//! such as that of `wormd up`, refuses to be armed. Whatever happens to this program, the controller keeps its own safety rules.

use std::error::Error;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{Command, CommandKind, CommandOutcome, Cycle, Fault, Mode, ShortText};
use wormd::topics::{CommandClient, Hub, Instance, Subscriber};

const DISTANCE_M: f64 = 0.05;
const MAX_TIME: Duration = Duration::from_secs(60);
/// How long the controller may take to answer; it does so in its next tick.
const ANSWER_TIME: Duration = Duration::from_secs(1);

fn main() -> ExitCode {
    match drive() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn drive() -> Result<(), Box<dyn Error>> {
    let mut config = Config::default();
    if let Some(name) = std::env::args().nth(1) {
        config.worm.name = name;
    }
    let hub = Hub::open(&Instance::of(&config)?)?;
    let client = hub.command_client()?;
    let mut cycles = hub.subscriber::<Cycle>()?;

    command(&client, CommandKind::Arm, 0.0)?;
    command(&client, CommandKind::Crawl, 0.4)?; // gait cycles per second
    let result = follow(&mut cycles);
    // Stop first, then report what went wrong.
    command(&client, CommandKind::Stop, 0.0)?;
    println!("{:.0} mm crawled", 1e3 * result?);
    Ok(())
}

/// Waits until the worm has crawled far enough or for long enough; returns the distance, m.
fn follow(cycles: &mut Subscriber<Cycle>) -> Result<f64, Box<dyn Error>> {
    let begin = Instant::now();
    let mut travelled_m = 0.0;
    while travelled_m < DISTANCE_M && begin.elapsed() < MAX_TIME {
        while let Some(cycle) = cycles.next()? {
            if cycle.advance_m.is_finite() {
                travelled_m += cycle.advance_m;
            }
            println!("cycle {}: {:.0} mm so far", cycle.index, 1e3 * travelled_m);
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    Ok(travelled_m)
}

/// Sends one command and expects that it is accepted.
fn command(client: &CommandClient, kind: CommandKind, cycles_per_s: f64) -> Result<(), Box<dyn Error>> {
    let request = Command {
        cycles_per_s,
        // Who sends it, for the record.
        sender: ShortText::new("drive example"),
        ..Command::new(kind)
    };
    let reply = client.call(request, ANSWER_TIME)?;
    match CommandOutcome::try_from(reply.verdict)? {
        CommandOutcome::Accepted => {
            println!("{kind} accepted");
            Ok(())
        }
        refused => {
            let (mode, fault) = (Mode::try_from(reply.mode)?, Fault::try_from(reply.fault)?);
            Err(format!("{kind} refused: {refused} (mode {mode}, fault {fault})").into())
        }
    }
}

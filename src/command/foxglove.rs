//! `wormd foxglove`: the topics of a worm, live, for Foxglove to show.

use super::record::{ALL_TOPICS, channel};
use super::{Failure, WormArgs, end_on_signal, print};
use crate::foxglove::LiveStream;
use crate::supervisor::controller::refuse_foreign;
use crate::topics::Instance;
use clap::Args;
use std::net::SocketAddr;
use worm_log::Channel;

/// Arguments of `wormd foxglove`.
#[derive(Debug, Args)]
pub struct FoxgloveArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// Where to listen
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8765")]
    listen: SocketAddr,
    /// Permit an address that other computers can reach: whoever reaches it can read everything, for Foxglove knows no password
    #[arg(long)]
    allow_anyone: bool,
    /// Only these topics
    #[arg(long, value_name = "TOPIC,…", value_delimiter = ',', value_parser = channel, default_value = ALL_TOPICS)]
    topics: Vec<Channel>,
    /// Only so many states, timings and estimates a second, and every one in which something changes: for a slow network
    #[arg(long, value_name = "HZ", value_parser = rate_hz, allow_negative_numbers = true)]
    rate: Option<f64>,
}

fn rate_hz(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(rate_hz) if (0.1..=10_000.0).contains(&rate_hz) => Ok(rate_hz),
        _ => Err("give a number from 0.1 to 10000 Hz".to_owned()),
    }
}

/// Runs `wormd foxglove` until a signal ends it. Prints its address once clients can come; the worm may come later, and go.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration, a worm or an address that cannot be used; [`Failure::Failed`] when the topics fail.
pub fn run(args: &FoxgloveArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    refuse_foreign(&config)?;
    if !args.listen.ip().is_loopback() && !args.allow_anyone {
        return Err(Failure::unusable(format!(
            "{} can be reached from other computers, and Foxglove knows no password: come by `ssh -L 8765:127.0.0.1:8765`, or give \
             --allow-anyone where everyone in the network may read",
            args.listen
        )));
    }
    let end = end_on_signal()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let stream = LiveStream::open(&instance, &args.topics, args.listen, args.rate)?;
    print::announce(format!(
        "Foxglove may connect to ws://{} for {}",
        stream.address(),
        config.worm.name
    ));
    print::log_in_background()?;
    stream.run(&end)
}

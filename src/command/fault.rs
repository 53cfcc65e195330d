//! `wormd fault`: faults of a running virtual worm, switched on and off.

use super::{Failure, WormArgs, print};
use crate::link::virtual_worm::{Fault, FaultRequest, ask_fault_switch};
use crate::topics::Instance;
use clap::Args;
use std::io;
use std::path::PathBuf;

/// Arguments of `wormd fault`.
#[derive(Debug, Args)]
#[command(
    after_help = Fault::help(),
    long_about = "A fault of a running virtual worm, switched on or off.\n\n\
                  The virtual worm takes faults only where it was started with --allow-faults (`wormd up --allow-faults`). A window \
                  @START..END is in seconds from now; without one the fault lasts until it is cleared."
)]
pub struct FaultArgs {
    /// The fault to switch on, as listed below
    #[arg(value_name = "SPEC", required_unless_present_any = ["clear", "list"])]
    fault: Option<Fault>,
    /// End all faults, or those of a kind
    #[arg(long, value_name = "KIND", num_args = 0..=1, default_missing_value = "", conflicts_with = "fault")]
    clear: Option<String>,
    /// List the faults that there are
    #[arg(long, conflicts_with_all = ["fault", "clear"])]
    list: bool,
    /// The virtual worm's --link, where it was not started by `wormd up`
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    #[command(flatten)]
    worm: WormArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Runs `wormd fault`.
///
/// # Errors
/// [`Failure::Unusable`] for arguments that cannot be used; [`Failure::Failed`] when there is no virtual worm, or it refuses.
pub fn run(args: &FaultArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    let (link, worm) = match &args.link {
        Some(link) => (link.clone(), link.display().to_string()),
        None if config.port.is_some() => {
            return Err(Failure::unusable(
                "faults are for the virtual worm, but a port is configured",
            ));
        }
        None => {
            let instance = Instance::of(&config).map_err(Failure::unusable)?;
            (instance.folder().join("tty"), config.worm.name.clone())
        }
    };
    let request = match (&args.fault, &args.clear) {
        (Some(fault), _) => FaultRequest::SwitchOn(fault.to_string()),
        (None, Some(kind)) => FaultRequest::Clear(Some(kind.clone()).filter(|kind| !kind.is_empty())),
        (None, None) => FaultRequest::List,
    };
    let answer = ask_fault_switch(&link, &request).map_err(|error| {
        Failure::failed(match error.kind() {
            io::ErrorKind::ConnectionRefused => format!(
                "{worm}: no virtual worm that takes faults: start it with --allow-faults, as in `wormd up --allow-faults`"
            ),
            io::ErrorKind::PermissionDenied => format!("{worm}: the virtual worm belongs to another user"),
            _ => format!("{worm}: the virtual worm does not answer: {error}"),
        })
    })?;
    if let Some(refusal) = answer.refusal {
        return Err(Failure::failed(format!("{worm}: {refusal}")));
    }
    if args.json {
        return print::line(serde_json::to_string(&answer).map_err(Failure::failed)?);
    }
    if args.clear.is_some() {
        print::line(format_args!("{worm}: {} faults cleared", answer.cleared))?;
    }
    for listed in &answer.faults {
        let state = if listed.holds { "on" } else { "waiting, or over" };
        print::line(format_args!("{worm}: {} ({state})", listed.fault))?;
    }
    if args.list && answer.faults.is_empty() {
        print::line(format_args!("{worm}: no faults"))?;
    }
    Ok(())
}

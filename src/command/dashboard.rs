//! `wormd dashboard`: a running worm in a browser.

use super::{Failure, WormArgs, ending_signals, print};
use crate::black_box::folder::Folder;
use crate::black_box::place::Place;
use crate::dashboard::server::{self, Settings};
use crate::dashboard::{Token, listen};
use crate::supervisor::controller::refuse_foreign;
use crate::topics::Instance;
use clap::Args;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;

/// How much the dashboard gives way to others, as the relay does.
const NICENESS: libc::c_int = 5;

/// Arguments of `wormd dashboard`.
#[derive(Debug, Args)]
pub struct DashboardArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// Where to listen; beyond loopback (0.0.0.0:8470 for all networks) a token is needed
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8470")]
    listen: String,
    /// File with the token that permits to drive; the variable WORMD_DASHBOARD_TOKEN does as well. Without one, a new one is made and
    /// printed
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// A further name by which browsers may call this computer, besides its host name and addresses
    #[arg(long, value_name = "NAME")]
    host: Vec<String>,
    /// Folder with reports of finished runs: folders that have a report.html
    #[arg(long, value_name = "DIR")]
    reports: Option<PathBuf>,
    /// Folder of the black box; without it, that of the configuration, or where the worm's black box of this user wrote last
    #[arg(long, value_name = "DIR")]
    black_box: Option<PathBuf>,
}

/// Runs `wormd dashboard` until a signal ends it. Prints its address once browsers can come; the worm may come later, and go.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration, an address, a token or a folder of reports that cannot be used; [`Failure::Failed`] when
/// the system gives no thread.
pub fn run(args: &DashboardArgs) -> Result<(), Failure> {
    let config = args.worm.load()?;
    refuse_foreign(&config)?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let outcome = serve(args, config, &instance);
    instance.remove_folder_if_empty();
    outcome
}

fn serve(args: &DashboardArgs, config: worm_estimator::config::Config, instance: &Instance) -> Result<(), Failure> {
    if let Some(folder) = &args.reports {
        std::fs::read_dir(folder).map_err(|error| {
            Failure::unusable(format!(
                "--reports {}: {error}: give a folder with reports",
                folder.display()
            ))
        })?;
    }
    if let Some(folder) = &args.black_box {
        Folder::new(folder).boxes().map_err(Failure::unusable)?;
    }
    let configured = Token::configured(args.token_file.as_deref())?;
    let listener = listen(&args.listen, configured.as_ref())?;
    let token = match configured {
        Some(token) => token,
        None => Token::random()?,
    };
    // SAFETY: the call takes plain numbers; 0 is this process.
    if unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, NICENESS) } != 0 {
        tracing::debug!("the priority cannot be lowered: {}", std::io::Error::last_os_error());
    }
    let (end, signalled) = UnixStream::pair().map_err(Failure::failed)?;
    for signal in ending_signals() {
        let writer = signalled.try_clone().map_err(Failure::failed)?;
        signal_hook::low_level::pipe::register(signal, writer)
            .map_err(|error| Failure::failed(format!("signal {signal} cannot be handled: {error}")))?;
    }
    let address = listener.local_addr().map_err(Failure::failed)?;
    let worm = instance.worm();
    let mut text = format!("The dashboard of {worm} is at http://{address}/");
    if let Some(token) = token.to_tell() {
        text += &format!("\nTo drive, open http://{address}/#token={token}");
        text += "\n(that token is for this run; --token-file gives one that stays)";
    }
    // At once: who reads only the first line may be gone before a second write, and that is no reason to end.
    print::announce(text);
    let mut hosts = args.host.clone();
    hosts.extend(own_names());
    let settings = Settings {
        boxes: Place::of(&config, args.black_box.as_deref()),
        config,
        instance: instance.clone(),
        arguments: args.worm.forward(),
        listener,
        token,
        hosts,
        reports: args.reports.clone(),
    };
    print::log_in_background()?;
    server::run(settings, end)
}

/// The names of this computer.
fn own_names() -> Vec<String> {
    match std::fs::read_to_string("/proc/sys/kernel/hostname") {
        Ok(name) => vec![format!("{}.local", name.trim()), name.trim().to_owned()],
        Err(_) => Vec::new(),
    }
}

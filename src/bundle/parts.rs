//! The parts of a bundle.

use super::archive::Archive;
use super::redact::redacted;
use crate::black_box::folder::{FileKind, Folder};
use crate::black_box::standing::{Standing, remarks, why_no_box};
use crate::preflight::{CheckReport, Trials};
use crate::topics::{Controller, Hub, Instance, RoleLock};
use crate::why::newest_stop::newest_stop;
use crate::why::{explain_stop, text};
use serde_json::json;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{AlarmKind, Estimate, JsonMessage, State};
use worm_log::messages;

/// How long another program may take.
const PROGRAM_TIMEOUT: Duration = Duration::from_secs(20);
/// How long a running worm is listened to.
const LISTENING: Duration = Duration::from_secs(2);
/// Lines of the journal.
const JOURNAL_LINES: &str = "20000";
/// How much of the thin log goes in, bytes.
const THIN_BYTES: u64 = 8_000_000;

/// What a bundle is of.
pub(crate) struct Subject {
    /// The worm's name.
    pub worm: String,
    /// Where the configuration is; none for the defaults.
    pub config_file: Option<PathBuf>,
    /// The configuration, or why it cannot be used.
    pub config: Result<Config, String>,
    /// The folder of the black box.
    pub black_box: PathBuf,
}

impl Subject {
    /// The configuration as far as it can be used, with the worm's name.
    fn worm_config(&self) -> Config {
        let mut config = self.config.clone().unwrap_or_default();
        config.worm.name.clone_from(&self.worm);
        config
    }
}

/// Adds all parts.
///
/// # Errors
/// When the archive cannot be written.
pub(crate) fn add_all(
    archive: &mut Archive,
    subject: &Subject,
    status: Result<Vec<u8>, String>,
    mut progress: impl FnMut(&str),
) -> io::Result<()> {
    progress("configuration");
    archive.add("config.toml", config_text(subject))?;
    archive.add("versions.json", versions())?;
    progress("check");
    archive.add("check.json", check(subject))?;
    progress("the running worm");
    archive.add("status.json", status)?;
    archive.add("alarms.json", in_force(subject))?;
    archive.add("processes.txt", processes())?;
    progress("systemd");
    let unit = format!("wormd*@{}.*", subject.worm);
    archive.add(
        "systemd.txt",
        program(
            "systemctl",
            &["status", "--no-pager", "--full", "--lines=0", "--all", &unit],
            true,
        ),
    )?;
    let arguments = [
        "--no-pager",
        "--output=short-iso-precise",
        "--lines",
        JOURNAL_LINES,
        "--unit",
        &unit,
    ];
    archive.add("journal.txt", program("journalctl", &arguments, false))?;
    progress("the black box");
    add_black_box(archive, subject)
}

fn config_text(subject: &Subject) -> Result<Vec<u8>, String> {
    let Some(file) = &subject.config_file else {
        return Err("no --config was given: the worm runs on the built-in defaults, as far as is known".to_owned());
    };
    let text = worm_estimator::config::read_text(file).map_err(|error| format!("{}: {error}", file.display()))?;
    Ok(redacted(&text).into_bytes())
}

fn versions() -> Result<Vec<u8>, String> {
    let read = |path: &str| fs::read_to_string(path).ok().map(|text| text.trim().to_owned());
    let program = std::env::current_exe().ok();
    let os = read("/etc/os-release").and_then(|text| {
        let name = text.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="))?;
        Some(name.trim_matches('"').to_owned())
    });
    let versions = json!({
        "wormd": env!("CARGO_PKG_VERSION"),
        "features": { "analysis": cfg!(feature = "analysis"), "tables": cfg!(feature = "tables") },
        "program": program.map(|path| path.display().to_string()),
        "architecture": std::env::consts::ARCH,
        "kernel": read("/proc/version"),
        "kernel_realtime": read("/sys/kernel/realtime").as_deref() == Some("1"),
        "kernel_arguments": read("/proc/cmdline").map(|text| redacted(&text)),
        "operating_system": os,
        "cpus": std::thread::available_parallelism().ok().map(usize::from),
        "memory": read("/proc/meminfo").and_then(|text| text.lines().next().map(str::to_owned)),
        "load": read("/proc/loadavg"),
        "uptime": read("/proc/uptime"),
        "boot_id": read("/proc/sys/kernel/random/boot_id"),
    });
    serde_json::to_vec_pretty(&versions).map_err(|error| error.to_string())
}

fn check(subject: &Subject) -> Result<Vec<u8>, String> {
    let config = subject.config.as_ref().map_err(Clone::clone)?;
    let source = subject
        .config_file
        .as_ref()
        .map_or_else(|| "the built-in defaults".to_owned(), |file| file.display().to_string());
    let trials = Trials {
        watchdog: false,
        motion: false,
        signals: Vec::new(),
    };
    let report = CheckReport::new(config, &source, &trials);
    serde_json::to_vec_pretty(&report).map_err(|error| error.to_string())
}

/// The newest state of a running worm, and the alarms that stand.
fn in_force(subject: &Subject) -> Result<Vec<u8>, String> {
    let config = subject.worm_config();
    let instance = Instance::of(&config).map_err(|error| error.to_string())?;
    if RoleLock::<Controller>::holder(&instance).is_none() {
        return Err(format!("no controller of {} runs for this user", subject.worm));
    }
    let hub = Hub::open(&instance).map_err(|error| error.to_string())?;
    let mut states = hub.subscriber::<State>().map_err(|error| error.to_string())?;
    let mut estimates = hub.subscriber::<Estimate>().map_err(|error| error.to_string())?;
    let (mut state, mut estimate) = (None, None);
    let begun = Instant::now();
    while (state.is_none() || estimate.is_none()) && begun.elapsed() < LISTENING {
        std::thread::sleep(Duration::from_millis(20));
        state = states
            .latest()
            .map_err(|error| error.to_string())?
            .map(|found| *found)
            .or(state);
        estimate = estimates
            .latest()
            .map_err(|error| error.to_string())?
            .map(|found| *found)
            .or(estimate);
    }
    let of_mask = |mask: u32| -> Vec<&str> {
        let kinds = AlarmKind::ALL.iter().filter(|kind| mask >> kind.code() & 1 == 1);
        kinds.map(|kind| kind.name()).collect()
    };
    let found = json!({
        "raised": estimate.map(|estimate| of_mask(estimate.raised_mask)),
        "armed": estimate.map(|estimate| of_mask(estimate.armed_mask)),
        "acknowledged": state.map(|state| of_mask(state.acknowledged_mask)),
        "state": state.map(|state| as_json(&state)),
        "estimate": estimate.map(|estimate| as_json(&estimate)),
    });
    serde_json::to_vec_pretty(&found).map_err(|error| error.to_string())
}

fn as_json(message: &impl JsonMessage) -> serde_json::Value {
    let mut text = Vec::new();
    let written = message.write_json(&mut text);
    written
        .ok()
        .and_then(|()| serde_json::from_slice(&text).ok())
        .unwrap_or(serde_json::Value::Null)
}

/// The processes of this program, as far as the kernel shows them.
fn processes() -> Result<Vec<u8>, String> {
    let mut text = String::new();
    let folder = fs::read_dir("/proc").map_err(|error| format!("/proc: {error}"))?;
    for process in folder.flatten() {
        let path = process.path();
        let Some(pid) = path.file_name().and_then(|name| name.to_str()?.parse::<u32>().ok()) else {
            continue;
        };
        let Ok(arguments) = fs::read(path.join("cmdline")) else {
            continue;
        };
        let mut words = arguments.split(|&byte| byte == 0).map(String::from_utf8_lossy);
        let is_ours = words
            .next()
            .is_some_and(|program| Path::new(&*program).file_name().is_some_and(|name| name == "wormd"));
        if !is_ours {
            continue;
        }
        let line: Vec<String> = arguments
            .split(|&byte| byte == 0)
            .map(|word| String::from_utf8_lossy(word).into_owned())
            .collect();
        text += &format!("{pid} {}\n", redacted(line.join(" ").trim_end()));
        let status = fs::read_to_string(path.join("status")).unwrap_or_default();
        let wanted = ["State", "Uid", "VmRSS", "VmLck", "Threads", "voluntary_ctxt_switches"];
        for line in status
            .lines()
            .filter(|line| wanted.iter().any(|name| line.starts_with(name)))
        {
            text += &format!("    {line}\n");
        }
    }
    if text.is_empty() {
        return Err("no process named wormd is shown to this user".to_owned());
    }
    Ok(text.into_bytes())
}

/// What another program prints. One that takes too long is ended.
fn program(name: &str, arguments: &[&str], may_fail: bool) -> Result<Vec<u8>, String> {
    let mut child = Command::new(name)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| format!("{name}: {error}"))?;
    let read = |pipe: Option<Box<dyn io::Read + Send>>| {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            // What came until an error counts.
            let _ = pipe.map(|mut pipe| pipe.read_to_end(&mut bytes));
            bytes
        })
    };
    let out = read(
        child
            .stdout
            .take()
            .map(|pipe| Box::new(pipe) as Box<dyn io::Read + Send>),
    );
    let err = read(
        child
            .stderr
            .take()
            .map(|pipe| Box::new(pipe) as Box<dyn io::Read + Send>),
    );
    let begun = Instant::now();
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if begun.elapsed() < PROGRAM_TIMEOUT => std::thread::sleep(Duration::from_millis(20)),
            _ => {
                let _ = child.kill();
                let _ = child.wait();
                return Err(format!("{name} did not answer within {} s", PROGRAM_TIMEOUT.as_secs()));
            }
        }
    };
    let joined = |thread: std::thread::JoinHandle<Vec<u8>>| thread.join().unwrap_or_default();
    let (out, err) = (joined(out), joined(err));
    let said = String::from_utf8_lossy(&err);
    // `systemctl status` fails where a unit is not running, and says what it has to say.
    let is_useful = status.success() || may_fail && !out.is_empty();
    if !is_useful || out.is_empty() {
        let why = said.lines().next().unwrap_or("it printed nothing");
        return Err(format!("{name}: {why}"));
    }
    Ok(redacted(&String::from_utf8_lossy(&out)).into_bytes())
}

/// The newest box with a stop and its explanation, the newest of all where that is a later one, and the end of the thin log.
fn add_black_box(archive: &mut Archive, subject: &Subject) -> io::Result<()> {
    let folder = Folder::new(&subject.black_box);
    let entries = match folder.list() {
        Ok(entries) => entries,
        Err(error) => {
            let reason = error.to_string();
            archive.add("black-box/list.json", Err(reason.clone()))?;
            return archive.add("black-box/box", Err(reason));
        }
    };
    archive.add(
        "black-box/list.json",
        serde_json::to_vec_pretty(&entries).map_err(|error| error.to_string()),
    )?;
    let standing = Standing::ask(&subject.worm_config());
    match newest_stop(&folder).map_err(io::Error::other)? {
        Some(found) => {
            for entry in std::iter::once(&found.entry).chain(found.later.last()) {
                archive.add_file(&format!("black-box/{}", entry.name), &folder.path().join(&entry.name))?;
            }
            archive.add("black-box/why.txt", why(&folder.path().join(&found.entry.name)))?;
            let missing = remarks(&folder, standing.as_ref());
            if !missing.is_empty() {
                archive.add("black-box/newer", Err(missing.join("; ")))?;
            }
        }
        None => {
            archive.add("black-box/box", Err(why_no_box(&folder, standing.as_ref())))?;
        }
    }
    let mut bytes = 0;
    let thin = entries.iter().rev().filter(|entry| entry.kind == FileKind::Thin);
    for entry in thin {
        bytes += entry.bytes;
        if bytes > THIN_BYTES {
            break;
        }
        archive.add_file(&format!("black-box/{}", entry.name), &folder.path().join(&entry.name))?;
    }
    if bytes == 0 {
        archive.add("black-box/thin", Err("there is no thin log".to_owned()))?;
    }
    Ok(())
}

fn why(path: &Path) -> Result<Vec<u8>, String> {
    let log = messages(path).map_err(|error| error.to_string())?;
    let config = log.config().map_err(|error| error.to_string())?;
    let explanation = explain_stop(&log, &config, crate::black_box::trigger(path).as_ref(), None);
    Ok((text::text(&explanation) + "\n").into_bytes())
}

//! `wormd black-box`: the boxes of a worm: which there are, and copies of them over any link.

use super::{Failure, WormArgs, log_line, print};
use crate::black_box::copy::{Checksum, Source, checksum, copy};
use crate::black_box::folder::{Entry, FileKind, Folder, open_from};
use crate::black_box::place::Place;
use crate::black_box::standing::{Standing, remarks, why_no_box};
use clap::{Args, Subcommand};
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Arguments of `wormd black-box`.
#[derive(Debug, Args)]
pub struct BlackBoxArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// The boxes, the oldest first: when, why, how long, how large
    List(ListArgs),
    /// A copy of a box, which can be broken off and goes on where it was
    Get(GetArgs),
    /// Length and SHA-256 of a box, as one JSON object
    Checksum(ChecksumArgs),
}

/// Which black box.
#[derive(Debug, Clone, Args)]
pub(super) struct PlaceArgs {
    /// Folder of the black box; without it, `black_box.folder` of the configuration or /var/lib/wormd/NAME/black-box, or the folder that
    /// `wormd up --black-box` of this user wrote to since then
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    #[command(flatten)]
    pub(super) worm: WormArgs,
}

#[derive(Debug, Args)]
struct ListArgs {
    #[command(flatten)]
    place: PlaceArgs,
    /// The parts of the thin log, too
    #[arg(long)]
    thin: bool,
    /// Print a JSON array instead of text
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct GetArgs {
    /// The box: its name or number from the list, or "last"
    #[arg(value_name = "NAME")]
    file: String,
    /// Where the copy goes; a partial one (FILE.part) is gone on with, and its checksum is verified
    #[arg(long, value_name = "FILE", conflicts_with = "offset")]
    out: Option<PathBuf>,
    /// Fetch it from another computer, by this command before `wormd`, such as "ssh robot"; tried again until it is complete
    #[arg(long, value_name = "COMMAND", requires = "out")]
    via: Option<String>,
    /// Without --out, write it to standard output, from this byte on
    #[arg(long, value_name = "BYTE", default_value_t = 0)]
    offset: u64,
    #[command(flatten)]
    place: PlaceArgs,
}

#[derive(Debug, Args)]
struct ChecksumArgs {
    /// The box: its name or number from the list, or "last"
    #[arg(value_name = "NAME")]
    file: String,
    #[command(flatten)]
    place: PlaceArgs,
}

/// Runs `wormd black-box`.
///
/// # Errors
/// [`Failure::Unusable`] for a folder or box that is not there; [`Failure::Failed`] when a copy cannot be completed.
pub fn run(args: &BlackBoxArgs) -> Result<(), Failure> {
    match &args.action {
        Action::List(args) => list(args),
        Action::Get(args) => get(args),
        Action::Checksum(args) => {
            let path = args.place.find(&args.file)?;
            let sum = checksum(&path).map_err(|error| unreadable(&path, &error))?;
            print::line(serde_json::to_string(&sum).map_err(Failure::failed)?)
        }
    }
}

impl PlaceArgs {
    /// The folder.
    ///
    /// # Errors
    /// [`Failure::Unusable`] for a configuration that cannot be used.
    pub(super) fn folder(&self) -> Result<Folder, Failure> {
        if let Some(folder) = &self.folder {
            return Ok(Folder::new(folder));
        }
        let config = self.worm.load()?;
        let folder = Place::of(&config, None).folder();
        if folder.path() != Folder::configured(&config).path() {
            let (worm, path) = (&config.worm.name, folder.path().display());
            log_line(format_args!(
                "note: the black box of {worm} wrote to {path} last: its boxes are meant (--folder names others)"
            ));
        }
        Ok(folder)
    }

    /// The file of a box, by name, number or "last".
    ///
    /// # Errors
    /// [`Failure::Unusable`] when there is none.
    pub(super) fn find(&self, name: &str) -> Result<PathBuf, Failure> {
        let folder = self.folder()?;
        if name != "last" {
            return folder.find(name).map_err(Failure::unusable);
        }
        let newest = folder.newest_box().map_err(Failure::unusable)?;
        let newest = newest.ok_or_else(|| self.no_box(&folder))?;
        Ok(folder.path().join(newest.name))
    }

    /// There is no box to speak of, and why.
    pub(super) fn no_box(&self, folder: &Folder) -> Failure {
        Failure::unusable(self.why_no_box(folder))
    }

    fn why_no_box(&self, folder: &Folder) -> String {
        let why = why_no_box(folder, self.standing().as_ref());
        format!("{}: {why}", folder.path().display())
    }

    /// Says what a folder with boxes does not show.
    pub(super) fn tell_what_is_missing(&self, folder: &Folder) {
        for remark in remarks(folder, self.standing().as_ref()) {
            log_line(format_args!("note: {remark}"));
        }
    }

    /// What stands at the worm, if it runs here. With a folder alone its configuration may be unusable: then nothing is known of it.
    fn standing(&self) -> Option<Standing> {
        Standing::ask(&self.worm.load().ok()?)
    }
}

fn list(args: &ListArgs) -> Result<(), Failure> {
    let folder = args.place.folder()?;
    let entries = if args.thin { folder.list() } else { folder.boxes() };
    let entries = entries.map_err(Failure::unusable)?;
    if args.json {
        return print::line(serde_json::to_string(&entries).map_err(Failure::failed)?);
    }
    if entries.is_empty() {
        return print::line(args.place.why_no_box(&folder));
    }
    let mut text = String::new();
    for entry in &entries {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", in_words(entry));
    }
    print::line(text.trim_end())?;
    args.place.tell_what_is_missing(&folder);
    Ok(())
}

fn in_words(entry: &Entry) -> String {
    let when = entry.unix_ns.map_or_else(|| "at an unknown time".to_owned(), utc_text);
    let mut text = format!(
        "{:>6}  {when}  {:>6.1} s  {:>7.2} MB  {}",
        entry.number,
        entry.duration_s,
        entry.bytes as f64 * 1e-6,
        entry.reason.as_deref().unwrap_or("thin log"),
    );
    let mut later: Vec<&str> = entry.events.iter().skip(1).map(|event| event.event.as_str()).collect();
    later.dedup();
    if !later.is_empty() {
        text += &format!(", then {}", later.join(", "));
    }
    match (entry.under_way, entry.complete) {
        (true, _) => text += " (under way, or interrupted)",
        (false, false) if entry.kind == FileKind::Box => text += " (interrupted)",
        _ => {}
    }
    text + "\n        " + &entry.name
}

/// A wall-clock time as people read it.
fn utc_text(unix_ns: u64) -> String {
    crate::black_box::utc::readable(UNIX_EPOCH + Duration::from_nanos(unix_ns))
}

fn get(args: &GetArgs) -> Result<(), Failure> {
    let Some(out) = &args.out else {
        let path = args.place.find(&args.file)?;
        let mut input = open_from(&path, args.offset).map_err(|error| unreadable(&path, &error))?;
        let mut stdout = io::stdout().lock();
        return io::copy(&mut input, &mut stdout)
            .and_then(|_| stdout.flush())
            .map_err(|error| Failure::failed(format!("standard output: {error}")));
    };
    let begun = SystemTime::now();
    let wanted = match &args.via {
        None => {
            let path = args.place.find(&args.file)?;
            let wanted = checksum(&path).map_err(|error| unreadable(&path, &error))?;
            copy(&Source::File(&path), &wanted, out)?;
            wanted
        }
        Some(via) => {
            let words = remote_words(via, "checksum", &args.file, &args.place)?;
            let wanted = remote_checksum(&words)?;
            // By its name from now on: "last" may be another one soon.
            let words = remote_words(via, "get", &wanted.name, &args.place)?;
            copy(&Source::Command(&words), &wanted, out)?;
            wanted
        }
    };
    let took = begun.elapsed().unwrap_or_default().as_secs_f64();
    print::line(format_args!(
        "{}: {} bytes of {}, checksum verified, in {took:.1} s",
        out.display(),
        wanted.bytes,
        wanted.name
    ))
}

/// The command that runs `wormd black-box ACTION NAME` where `via` leads to.
fn remote_words(via: &str, action: &str, name: &str, place: &PlaceArgs) -> Result<Vec<String>, Failure> {
    let mut words: Vec<String> = via.split_whitespace().map(str::to_owned).collect();
    if words.is_empty() {
        return Err(Failure::unusable("--via needs a command, such as \"ssh robot\""));
    }
    let mut arguments = vec![
        "wormd".to_owned(),
        "black-box".to_owned(),
        action.to_owned(),
        name.to_owned(),
    ];
    if let Some(folder) = &place.folder {
        arguments.extend(["--folder".to_owned(), folder.to_string_lossy().into_owned()]);
    }
    arguments.extend(
        place
            .worm
            .forward()
            .into_iter()
            .map(|word| word.to_string_lossy().into_owned()),
    );
    // A shell may stand at the other end, and none may: what both read alike is let through.
    let is_plain = |word: &String| {
        word.chars()
            .all(|letter| letter.is_ascii_alphanumeric() || "-_./@:".contains(letter))
    };
    if let Some(word) = arguments.iter().find(|word| !is_plain(word)) {
        return Err(Failure::unusable(format!(
            "'{word}' cannot be sent by --via: use letters, digits, '-', '_', '.' and '/'"
        )));
    }
    words.extend(arguments);
    Ok(words)
}

fn remote_checksum(words: &[String]) -> Result<Checksum, Failure> {
    let called = words.join(" ");
    let (program, arguments) = words.split_first().unwrap_or((&words[0], &[]));
    let output = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| Failure::unusable(format!("{called}: {error}")))?;
    if !output.status.success() {
        return Err(Failure::failed(format!("{called}: {}", output.status)));
    }
    serde_json::from_slice(&output.stdout)
        .map_err(|error| Failure::failed(format!("{called}: its answer is no checksum: {error}")))
}

fn unreadable(path: &Path, error: &io::Error) -> Failure {
    Failure::unusable(format!("{}: cannot be read: {error}", path.display()))
}

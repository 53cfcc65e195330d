//! Copies of a file that can be broken off at any byte and go on from there, with a checksum at the end.

use super::folder::open_from;
use crate::failure::Failure;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Bytes that are copied at a time.
const PIECE: usize = 1 << 16;
/// Attempts without a single new byte after which a copy is given up.
const FRUITLESS_ATTEMPTS: u32 = 10;
/// Time between two attempts.
const BETWEEN_ATTEMPTS: Duration = Duration::from_secs(2);

/// What a copy must come to. Its field names are a contract of the JSON output.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Checksum {
    /// The file's name.
    pub name: String,
    /// Its length.
    pub bytes: u64,
    /// SHA-256 of its bytes, in hexadecimal digits, as `sha256sum` prints it.
    pub sha256: String,
}

/// SHA-256 of everything that can be read, in hexadecimal digits.
///
/// # Errors
/// From the operating system.
pub(crate) fn sha256(mut input: impl Read) -> io::Result<(u64, String)> {
    let mut digest = Sha256::new();
    let mut piece = vec![0; PIECE];
    let mut bytes = 0;
    loop {
        match input.read(&mut piece) {
            Ok(0) => break,
            Ok(read) => {
                digest.update(&piece[..read]);
                bytes += read as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    let digits = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    Ok((bytes, digits))
}

/// The checksum of a file.
///
/// # Errors
/// From the operating system.
pub(crate) fn checksum(path: &Path) -> io::Result<Checksum> {
    let (bytes, sha256) = sha256(File::open(path)?)?;
    Ok(Checksum {
        name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        bytes,
        sha256,
    })
}

/// Where a file is copied from.
pub(crate) enum Source<'a> {
    /// A file of this computer.
    File(&'a Path),
    /// The standard output of a command, which gets `--offset N` in addition, and may break off at any byte.
    Command(&'a [String]),
}

/// Copies a file to `out`. It grows as `out.part`; one that is there already is gone on with.
///
/// # Errors
/// [`Failure::Unusable`] when `out` is another file already; [`Failure::Failed`] when the source gives nothing more, a file cannot be
/// written, or the copy is not what it must be.
pub(crate) fn copy(source: &Source<'_>, wanted: &Checksum, out: &Path) -> Result<(), Failure> {
    let unwritable = |error: io::Error| Failure::failed(format!("{}: cannot be written: {error}", out.display()));
    if out.exists() {
        let there = checksum(out).map_err(Failure::unusable)?;
        if there.sha256 == wanted.sha256 {
            return Ok(());
        }
        return Err(Failure::unusable(format!(
            "{} is there already, and is not {}: choose another name",
            out.display(),
            wanted.name
        )));
    }
    let part = part_of(out);
    let mut file = OpenOptions::new()
        .create(true)
        .append(true)
        .open(&part)
        .map_err(|error| {
            Failure::unusable(format!(
                "{}: cannot be written: {error}: choose another place",
                part.display()
            ))
        })?;
    let mut fruitless = 0;
    loop {
        let have = file.metadata().map_err(unwritable)?.len();
        if have >= wanted.bytes {
            break;
        }
        let got = fetch(source, have, &mut file)?;
        if got > 0 {
            fruitless = 0;
            continue;
        }
        fruitless += 1;
        if fruitless >= FRUITLESS_ATTEMPTS || matches!(source, Source::File(_)) {
            return Err(Failure::failed(format!(
                "{}: {have} of {} bytes came, and no more: the same command goes on from there",
                part.display(),
                wanted.bytes
            )));
        }
        tracing::info!("{have} of {} bytes; trying again", wanted.bytes);
        std::thread::sleep(BETWEEN_ATTEMPTS);
    }
    let found = checksum(&part).map_err(unwritable)?;
    if (found.bytes, &found.sha256) != (wanted.bytes, &wanted.sha256) {
        return Err(Failure::failed(format!(
            "{}: its checksum is not that of {}: remove it, and copy again",
            part.display(),
            wanted.name
        )));
    }
    file.sync_all().map_err(unwritable)?;
    std::fs::rename(&part, out).map_err(unwritable)
}

/// Appends what the source gives from this byte on; returns how many bytes that were.
fn fetch(source: &Source<'_>, offset: u64, file: &mut File) -> Result<u64, Failure> {
    match source {
        Source::File(path) => {
            let failed = |error: io::Error| Failure::failed(format!("{}: {error}", path.display()));
            io::copy(&mut open_from(path, offset).map_err(failed)?, file).map_err(failed)
        }
        Source::Command(words) => {
            let Some((program, arguments)) = words.split_first() else {
                return Err(Failure::unusable("--via needs a command, such as \"ssh robot\""));
            };
            let mut child = Command::new(program)
                .args(arguments)
                .args(["--offset", &offset.to_string()])
                .stdin(Stdio::null())
                .stdout(Stdio::piped())
                .spawn()
                .map_err(|error| Failure::unusable(format!("{program}: {error}")))?;
            let copied = match child.stdout.take() {
                Some(mut stdout) => copy_pieces(&mut stdout, file),
                None => Ok(0),
            };
            // A link that broke ends it, too; what came counts.
            let _ = child.wait();
            copied.map_err(|error| Failure::failed(format!("the copy cannot be written: {error}")))
        }
    }
}

/// Copies until the end, or until reading fails.
fn copy_pieces(from: &mut impl Read, to: &mut impl Write) -> io::Result<u64> {
    let mut piece = vec![0; PIECE];
    let mut bytes = 0;
    loop {
        match from.read(&mut piece) {
            Ok(0) => return Ok(bytes),
            Ok(read) => {
                to.write_all(&piece[..read])?;
                bytes += read as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(_) => return Ok(bytes),
        }
    }
}

fn part_of(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(".part");
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_goes_on_where_it_was_broken_off_and_is_verified() {
        let folder = tempfile::tempdir().expect("a folder");
        let whole = folder.path().join("box.mcap");
        let bytes: Vec<u8> = (0..200_000_u32).flat_map(u32::to_le_bytes).collect();
        std::fs::write(&whole, &bytes).expect("room");
        let wanted = checksum(&whole).expect("readable");
        let out = folder.path().join("copy.mcap");
        let part = folder.path().join("copy.mcap.part");
        std::fs::write(&part, &bytes[..77_777]).expect("room");
        copy(&Source::File(&whole), &wanted, &out).expect("it goes on");
        assert!(std::fs::read(&out).expect("readable") == bytes && !part.exists());
        copy(&Source::File(&whole), &wanted, &out).expect("it is there already");

        // A link that breaks after every 100,000 bytes.
        let script = format!("tail -c +$(( $1 + 1 )) '{}' | head -c 100000", whole.display());
        let words = ["sh", "-c", &format!("shift; {script}"), "link"].map(str::to_owned);
        let out = folder.path().join("radio.mcap");
        copy(&Source::Command(&words), &wanted, &out).expect("it goes on by itself");
        assert!(std::fs::read(&out).expect("readable") == bytes);

        let out = folder.path().join("other.mcap");
        std::fs::write(folder.path().join("other.mcap.part"), b"something else").expect("room");
        let error = copy(&Source::File(&whole), &wanted, &out)
            .expect_err("it is no copy")
            .to_string();
        assert!(error.contains("its checksum is not that of box.mcap"), "{error}");
        std::fs::write(&out, b"something else").expect("room");
        let error = copy(&Source::File(&whole), &wanted, &out)
            .expect_err("it is there")
            .to_string();
        assert!(error.contains("is there already"), "{error}");
    }
}

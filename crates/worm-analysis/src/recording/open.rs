//! Opens a recording of any format.

use super::options::{OpenOptions, Wanted};
use super::series::Recording;
use super::text::Text;
use super::{c3d, mcap, projection, sanity_check, table, vicon};
use std::fs::File;
use std::io::{Cursor, Read, Seek};
use std::path::Path;
use worm_log::ReadError;

/// Bytes from which the format is recognised.
const HEAD: usize = 4096;
const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
const FORMATS: &str = "give a CSV as in the recording format, a Vicon Nexus CSV, a C3D or an MCAP file";

/// Reads a recording in any of the known formats and checks that it can be one of a worm. Positions that were not seen stay
/// `NaN`; [`Recording::filled`] bridges them.
///
/// # Errors
/// [`ReadError`] when the file cannot be read, is damaged, contradicts itself or is ambiguous.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Recording, ReadError> {
    open_with_progress(path, options, &mut |_fraction| {})
}

/// As [`open`], reporting to `progress` now and then which fraction of the file has been read, 0 to 1.
///
/// # Errors
/// As [`open`].
pub fn open_with_progress(
    path: &Path,
    options: &OpenOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Recording, ReadError> {
    let cannot = |error: std::io::Error| cannot_read(path, &error);
    let metadata = std::fs::metadata(path).map_err(cannot)?;
    if !metadata.is_file() {
        return Err(ReadError::whole(path, "is not a file", FORMATS));
    }
    let file = File::open(path).map_err(cannot)?;
    read_from(file, metadata.len(), path, options, progress)
}

/// As [`open`], from `length` bytes that can be read and rewound; errors and the recording call them `path`.
///
/// # Errors
/// As [`open`].
pub fn read_from(
    mut input: impl Read + Seek,
    length: u64,
    path: &Path,
    options: &OpenOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Recording, ReadError> {
    options.check(path)?;
    let cannot = |error: std::io::Error| cannot_read(path, &error);
    let mut head = Vec::with_capacity(HEAD);
    input
        .by_ref()
        .take(HEAD as u64)
        .read_to_end(&mut head)
        .map_err(cannot)?;
    let begin = if head.starts_with(BYTE_ORDER_MARK) {
        BYTE_ORDER_MARK.len()
    } else {
        0
    };
    let along_canal = |markers| projection::project(markers, options.axis, path);
    let mut recording = match Format::of(path, &head)? {
        Format::Table => {
            let mut recording = table::read(
                path,
                Text::new(Cursor::new(&head[begin..]).chain(input), length, progress),
                options.cells.filter(|_| options.wanted != Wanted::Positions),
            )?;
            if options.axis.is_some() {
                let note = "--axis is not used: the positions in this file lie along the canal already";
                recording.warnings.push(note.to_owned());
            }
            recording
        }
        Format::Vicon => along_canal(vicon::read(
            path,
            Text::new(Cursor::new(&head[begin..]).chain(input), length, progress),
        )?)?,
        Format::C3d => {
            let mut bytes = head;
            input.read_to_end(&mut bytes).map_err(cannot)?;
            along_canal(c3d::read(path, &bytes)?)?
        }
        Format::Mcap => {
            input.rewind().map_err(cannot)?;
            match options.wanted {
                Wanted::Positions => mcap::read_from(input, path)?,
                Wanted::Motor { window_s } => mcap::read_motor_from(input, path, window_s)?,
                Wanted::PositionsOrMotor { window_s } => match mcap::read_seen(&mut input, path)? {
                    Some(recording) => recording,
                    None => {
                        input.rewind().map_err(cannot)?;
                        mcap::read_motor_from(input, path, window_s)?
                    }
                },
            }
        }
    };
    let full_range_s = recording.time_s.first().copied().zip(recording.time_s.last().copied());
    if options.from_s.is_some() || options.to_s.is_some() {
        recording.cut(options.from_s, options.to_s);
    }
    sanity_check::check(&mut recording, options, full_range_s)?;
    Ok(recording)
}

fn cannot_read(path: &Path, error: &std::io::Error) -> ReadError {
    let problem = format!("cannot be read: {error}");
    ReadError::whole(path, problem, "give an existing recording that you may read")
}

/// The formats that are recognised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    /// CSV with named columns.
    Table,
    /// CSV as Vicon Nexus exports it.
    Vicon,
    C3d,
    Mcap,
}

impl Format {
    /// By content first, since an extension may be wrong; by extension where a damaged file no longer shows its format.
    fn of(path: &Path, head: &[u8]) -> Result<Self, ReadError> {
        if head.is_empty() {
            return Err(ReadError::whole(path, "is empty", FORMATS));
        }
        let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
        let is_named = |name: &str| extension.as_deref().is_some_and(|extension| extension == name);
        if head.starts_with(MCAP_MAGIC) || is_named("mcap") {
            Ok(Self::Mcap)
        } else if is_named("c3d") || c3d::is_recognised(head) {
            Ok(Self::C3d)
        } else if head.contains(&0) {
            let problem = "is neither text nor a known format";
            Err(ReadError::whole(path, problem, FORMATS))
        } else if vicon::is_recognised(head) {
            Ok(Self::Vicon)
        } else {
            Ok(Self::Table)
        }
    }
}

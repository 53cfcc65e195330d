//! One way in for all formats.

use super::options::OpenOptions;
use super::series::Recording;
use super::text::Text;
use super::{c3d, mcap, projection, sanity_check, table, vicon};
use std::fs::File;
use std::io::{Cursor, Read};
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
/// [`ReadError`] when the file cannot be read, is damaged, contradicts itself or leaves anything to guess.
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
    options.check(path)?;
    let cannot = |error: std::io::Error| {
        ReadError::whole(
            path,
            format!("cannot be read: {error}"),
            "give an existing recording that you may read",
        )
    };
    let metadata = std::fs::metadata(path).map_err(cannot)?;
    if !metadata.is_file() {
        return Err(ReadError::whole(path, "is not a file", FORMATS));
    }
    let mut file = File::open(path).map_err(cannot)?;
    let mut head = Vec::with_capacity(HEAD);
    file.by_ref().take(HEAD as u64).read_to_end(&mut head).map_err(cannot)?;
    let begin = if head.starts_with(BYTE_ORDER_MARK) {
        BYTE_ORDER_MARK.len()
    } else {
        0
    };
    let along_canal = |markers| projection::project(markers, options.axis, path);
    let format = Format::of(path, &head)?;
    let text = Text::new(Cursor::new(&head[begin..]).chain(&file), metadata.len(), progress);
    let mut recording = match format {
        Format::Table => {
            let mut recording = table::read(path, text)?;
            if options.axis.is_some() {
                let note = "--axis is not used: the positions in this file lie along the canal already";
                recording.warnings.push(note.to_owned());
            }
            recording
        }
        Format::Vicon => along_canal(vicon::read(path, text)?)?,
        Format::C3d => {
            let mut bytes = head;
            file.read_to_end(&mut bytes).map_err(cannot)?;
            along_canal(c3d::read(path, &bytes)?)?
        }
        Format::Mcap => mcap::read(path)?,
    };
    let whole_s = recording.time_s.first().copied().zip(recording.time_s.last().copied());
    if options.from_s.is_some() || options.to_s.is_some() {
        recording.cut(options.from_s, options.to_s);
    }
    sanity_check::check(&mut recording, options, whole_s)?;
    Ok(recording)
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
    /// By content first, for extensions lie; by extension where a damaged file no longer shows what it is.
    fn of(path: &Path, head: &[u8]) -> Result<Self, ReadError> {
        if head.is_empty() {
            return Err(ReadError::whole(path, "is empty", FORMATS));
        }
        let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
        let is_named = |name: &str| extension.as_deref().is_some_and(|extension| extension == name);
        if head.starts_with(MCAP_MAGIC) || is_named("mcap") {
            Ok(Self::Mcap)
        } else if is_named("c3d") || c3d::begins_like_one(head) {
            Ok(Self::C3d)
        } else if head.contains(&0) {
            let problem = "is neither text nor a format that is known here";
            Err(ReadError::whole(path, problem, FORMATS))
        } else if vicon::begins_like_one(head) {
            Ok(Self::Vicon)
        } else {
            Ok(Self::Table)
        }
    }
}

//! Motion capture as C3D, the binary format of the biomechanics laboratories.
//!
//! A file is made of blocks of 512 bytes: a header, the `parameters`, and frames of points and analogue samples. Only the
//! points are read. The crate `c3dio` is not used because it trusts the header: on a damaged file it indexes out of
//! bounds or allocates without limit, and beyond 65,535 frames (nine minutes at 120 Hz) it miscounts. A test compares this
//! reader with it on an intact file.

mod bytes;
mod parameters;

use super::markers::{Markers, UNSEEN, metres_in};
use super::table::quoted;
use bytes::{Bytes, Processor};
use parameters::Parameters;
use std::path::Path;
use worm_log::ReadError;

const BLOCK: usize = 512;
/// The second byte of every C3D file.
const KEY: u8 = 0x50;
const MAX_RATE_HZ: f64 = 1e5;
/// Largest count of frames that the header can hold.
const MAX_COUNT: usize = 65_535;
const EXPORT_AGAIN: &str = "export or copy the file again";

/// Whether a file begins as a C3D file.
pub(super) fn is_recognised(head: &[u8]) -> bool {
    // A printable first byte would be text whose second character happens to be a P.
    matches!(head, [block, KEY, ..] if *block < b' ')
}

/// Reads all points.
///
/// # Errors
/// [`ReadError`] for a file that is cut off, damaged, or has no valid rate or unit.
pub(super) fn read(path: &Path, file: &[u8]) -> Result<Markers, ReadError> {
    let refuse = |problem: &str| ReadError::whole(path, problem, EXPORT_AGAIN);
    let [parameter_block, KEY, ..] = *file else {
        return Err(refuse("is not a C3D file: its second byte is not 80"));
    };
    let section = (usize::from(parameter_block).checked_sub(1))
        .map(|blocks| blocks * BLOCK)
        .ok_or_else(|| refuse("the header does not say where the parameters are"))?;
    let code = *file
        .get(section + 3)
        .ok_or_else(|| refuse("is cut off before the parameters"))?;
    let processor = Processor::from_code(code)
        .ok_or_else(|| refuse(&format!("the parameters name an unknown processor, {code}")))?;
    let bytes = Bytes { bytes: file, processor };
    let parameters = Parameters::read(bytes, section).ok_or_else(|| refuse("the parameters run out of the file"))?;
    let header = Header::read(bytes).ok_or_else(|| refuse("is cut off in the header"))?;
    let layout = Layout::of(&header, &parameters, file).map_err(|problem| refuse(&problem))?;
    let metres = unit_m(&parameters, path)?;
    let mut markers = layout.read(bytes, metres);
    if layout.unread > 0 {
        markers.warnings.push(format!(
            "the file holds {} frames more than it says; they were not read",
            layout.unread
        ));
    }
    markers.names = names(&parameters, layout.points);
    Ok(markers)
}

/// The first block.
struct Header {
    points: usize,
    analog_per_frame: usize,
    frames: usize,
    /// Whether the last frame's number exceeds what the header can hold, so that `frames` is meaningless.
    is_full: bool,
    /// Negative where values are floating point; otherwise the length of one integer unit.
    scale: f32,
    data_block: usize,
    rate_hz: f64,
}

impl Header {
    fn read(bytes: Bytes<'_>) -> Option<Self> {
        let word = |number: usize| bytes.u16(2 * (number - 1)).map(usize::from);
        Some(Self {
            points: word(2)?,
            analog_per_frame: word(3)?,
            frames: (word(5)? + 1).saturating_sub(word(4)?),
            is_full: word(5)? == MAX_COUNT,
            scale: bytes.f32(12)?,
            data_block: word(9)?,
            rate_hz: f64::from(bytes.f32(20)?),
        })
    }
}

/// Where the points are; checked to lie inside the file.
struct Layout {
    points: usize,
    frames: usize,
    /// Whole frames that follow the last one.
    unread: usize,
    begin: usize,
    frame_length: usize,
    /// Length of one integer unit, in the file's unit; `None` for floating point.
    integer_scale: Option<f64>,
    rate_hz: f64,
}

impl Layout {
    fn of(header: &Header, parameters: &Parameters<'_>, file: &[u8]) -> Result<Self, String> {
        let rate_hz = parameters.number("POINT", "RATE").unwrap_or(header.rate_hz);
        if !(rate_hz > 0.0 && rate_hz <= MAX_RATE_HZ) {
            return Err(format!("the rate is given as {rate_hz} Hz"));
        }
        if let Some(used) = parameters.number("POINT", "USED")
            && used != header.points as f64
        {
            return Err(format!(
                "the header says {} points and POINT:USED says {used}",
                header.points
            ));
        }
        if header.points == 0 {
            return Err("there are no points in it".to_owned());
        }
        if !header.scale.is_finite() || header.scale == 0.0 {
            return Err(format!("the scale of the points is given as {}", header.scale));
        }
        let integer_scale = (header.scale > 0.0).then(|| f64::from(header.scale));
        let element = if integer_scale.is_some() { 2 } else { 4 };
        let frame_length = element * (4 * header.points + header.analog_per_frame);
        let begin = (header.data_block.checked_sub(1))
            .map(|blocks| blocks * BLOCK)
            .ok_or("the header does not say where the data are")?;
        let data = file.get(begin..).unwrap_or_default();
        let there = data.len() / frame_length;
        let mut frames = count_frames(header, parameters)?;
        if frames == MAX_COUNT && there > frames {
            // The count is full, so the file's length decides; its last block is padded with zeros.
            let is_empty = |frame: &&[u8]| frame.iter().all(|byte| *byte == 0);
            frames = there
                - data
                    .chunks_exact(frame_length)
                    .rev()
                    .take(BLOCK / frame_length)
                    .take_while(is_empty)
                    .count();
        }
        if frames > there {
            return Err(format!("is cut off: it says {frames} frames and holds {there}"));
        }
        // The padding of the last block is less than a block.
        let padding = BLOCK.div_ceil(frame_length);
        let unread = there - frames;
        Ok(Self {
            points: header.points,
            frames,
            unread: if unread > padding { unread } else { 0 },
            begin,
            frame_length,
            integer_scale,
            rate_hz,
        })
    }

    fn read(&self, bytes: Bytes<'_>, metres: f64) -> Markers {
        let mut markers = Markers {
            time_s: (0..self.frames).map(|frame| frame as f64 / self.rate_hz).collect(),
            position_m: vec![Vec::with_capacity(self.frames); self.points],
            ..Markers::default()
        };
        let mut zeros = 0;
        for frame in 0..self.frames {
            let at = self.begin + frame * self.frame_length;
            for (point, series) in markers.position_m.iter_mut().enumerate() {
                let position = self.point(bytes, at, point).filter(|position| {
                    // Some programs write a lost marker as a point at the very origin.
                    let is_zero = *position == [0.0; 3];
                    zeros += usize::from(is_zero);
                    !is_zero
                });
                series.push(position.map_or(UNSEEN, |position| position.map(|part| part * metres)));
            }
        }
        if zeros > 0 {
            let note = format!("{zeros} points lie exactly at the origin and were taken as not seen");
            markers.warnings.push(note);
        }
        markers
    }

    /// One point in the file's unit; `None` where it was not seen.
    fn point(&self, bytes: Bytes<'_>, frame_at: usize, point: usize) -> Option<[f64; 3]> {
        let parts: [f64; 4] = match self.integer_scale {
            None => {
                let at = frame_at + 16 * point;
                let part = |index: usize| bytes.f32(at + 4 * index).map(f64::from);
                [part(0)?, part(1)?, part(2)?, part(3)?]
            }
            Some(scale) => {
                let at = frame_at + 8 * point;
                let part = |index: usize| bytes.i16(at + 2 * index).map(|part| f64::from(part) * scale);
                [part(0)?, part(1)?, part(2)?, part(3)?]
            }
        };
        // The fourth holds residual and cameras, and is negative for a point that was not seen.
        let [x, y, z, residual] = parts;
        let is_seen = residual >= 0.0 && [x, y, z].iter().all(|part| part.is_finite());
        is_seen.then_some([x, y, z])
    }
}

/// The header counts to [`MAX_COUNT`]. Longer recordings give their length in one of three other places, or nowhere.
fn count_frames(header: &Header, parameters: &Parameters<'_>) -> Result<usize, String> {
    let first = parameters.two_words("TRIAL", "ACTUAL_START_FIELD");
    let last = parameters.two_words("TRIAL", "ACTUAL_END_FIELD");
    let by_fields = first.zip(last).map(|(first, last)| last - first + 1.0);
    let by_parameters = by_fields
        .or_else(|| parameters.number("POINT", "LONG_FRAMES"))
        .or_else(|| parameters.number("POINT", "FRAMES"));
    match by_parameters {
        Some(frames) if frames >= 1.0 && frames <= f64::from(u32::MAX) && frames.fract() == 0.0 => {
            let frames = frames as usize;
            if !header.is_full && frames != header.frames {
                return Err(format!(
                    "the header says {} frames and the parameters say {frames}",
                    header.frames
                ));
            }
            Ok(frames)
        }
        Some(frames) => Err(format!("the parameters give the number of frames as {frames}")),
        None if header.frames == 0 => Err("there are no frames in it".to_owned()),
        None => Ok(header.frames),
    }
}

fn unit_m(parameters: &Parameters<'_>, path: &Path) -> Result<f64, ReadError> {
    let unit = parameters.texts("POINT", "UNITS").and_then(|mut texts| texts.next());
    let problem = match &unit {
        Some(unit) => match metres_in(unit) {
            Some(metres) => return Ok(metres),
            None => format!("{} is not mm, cm or m", quoted(unit)),
        },
        None => "the unit of the points is not given".to_owned(),
    };
    Err(ReadError::at(
        path,
        "POINT:UNITS",
        problem,
        "export the file again in millimetres",
    ))
}

/// One name for each point; more than 255 continue in LABELS2, LABELS3, ….
fn names(parameters: &Parameters<'_>, points: usize) -> Vec<String> {
    let first = std::iter::once("LABELS".to_owned());
    let mut labels = first
        .chain((2..).map(|number| format!("LABELS{number}")))
        .map_while(|name| parameters.texts("POINT", &name))
        .flatten();
    (1..=points)
        .map(|point| match labels.next() {
            Some(label) if !label.is_empty() => label,
            _ => format!("point {point}"),
        })
        .collect()
}

//! Motion capture as CSV from Vicon Nexus.
//!
//! ```text
//! Trajectories
//! 120
//! ,,Worm:c1,,,Worm:c2,,
//! Frame,Sub Frame,X,Y,Z,X,Y,Z
//! ,,mm,mm,mm,mm,mm,mm
//! 1,0,160.2,3.1,20.0,120.4,2.9,20.1
//! ```
//!
//! A file holds several such sections (`Devices`, `Model Outputs`, …) with a blank line between them; only the trajectories
//! are read. Where the computer's language asks for it, fields are separated by semicolons and numbers have a decimal comma.

use super::markers::{Markers, UNSEEN, metres_in};
use super::table::quoted;
use super::text::Text;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use worm_estimator::abridged::abridged;
use worm_log::ReadError;

/// Titles of sections; a file begins with one of them.
const SECTIONS: [&str; 6] = [
    "Trajectories",
    "Devices",
    "Model Outputs",
    "Joints",
    "Segments",
    "Events",
];
const TRAJECTORIES: &str = "Trajectories";
/// Highest rate that is accepted, Hz.
const MAX_RATE_HZ: f64 = 1e5;
/// Longest line that is read, bytes: thousands of markers.
const MAX_LINE: u64 = 1 << 20;
/// Longest name of a marker that is kept whole, bytes.
const MAX_NAME: usize = 200;
const EXPORT_AGAIN: &str = "export the trajectories again, as ASCII with rate, names and units";

/// Whether a file begins as a Vicon export.
pub(super) fn is_recognised(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let first = text.trim_start_matches('\u{feff}').lines().find(|line| !is_blank(line));
    first.is_some_and(|line| SECTIONS.contains(&section_name(line)))
}

fn is_blank(line: &str) -> bool {
    line.trim_matches([',', ';', ' ', '\t', '"', '\r', '\n']).is_empty()
}

fn section_name(line: &str) -> &str {
    line.trim_matches([',', ';', ' ', '\t', '"', '\r', '\n'])
}

/// Reads the section of trajectories.
///
/// # Errors
/// [`ReadError`] with the line that is invalid.
pub(super) fn read<R: Read>(path: &Path, text: Text<'_, R>) -> Result<Markers, ReadError> {
    let mut lines = LineReader {
        path,
        reader: BufReader::new(text),
        line: String::new(),
        number: 0,
    };
    let mut after_blank = true;
    loop {
        if !lines.next()? {
            let problem = "there is no section Trajectories";
            return Err(ReadError::whole(path, problem, EXPORT_AGAIN));
        }
        if after_blank && section_name(&lines.line) == TRAJECTORIES {
            break;
        }
        after_blank = is_blank(&lines.line);
    }
    let header = Header::read(&mut lines)?;
    read_samples(&mut lines, header)
}

struct LineReader<'p, 't, R> {
    path: &'p Path,
    reader: BufReader<Text<'t, R>>,
    line: String,
    number: usize,
}

impl<R: Read> LineReader<'_, '_, R> {
    /// Goes to the next line; false at the end.
    fn next(&mut self) -> Result<bool, ReadError> {
        let mut bytes = std::mem::take(&mut self.line).into_bytes();
        bytes.clear();
        self.number += 1;
        let count = self.reader.by_ref().take(MAX_LINE).read_until(b'\n', &mut bytes);
        let count = count.or_else(|error| self.refuse(error.to_string(), "is the disk or the share still there?"))?;
        if count as u64 == MAX_LINE {
            return self.refuse("the line has no end", EXPORT_AGAIN);
        }
        if bytes.last() == Some(&b'\n') {
            bytes.pop();
        }
        self.line =
            String::from_utf8(bytes).unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned());
        Ok(count > 0)
    }

    /// Goes to the next line, which must exist and not be blank.
    fn next_required(&mut self, what: &str) -> Result<(), ReadError> {
        if self.next()? && !is_blank(&self.line) {
            return Ok(());
        }
        self.refuse(format!("{what} is missing"), EXPORT_AGAIN)
    }

    fn refuse<T>(&self, problem: impl Into<String>, remedy: &str) -> Result<T, ReadError> {
        Err(ReadError::at(
            self.path,
            format!("line {}", self.number),
            problem,
            remedy,
        ))
    }
}

/// The rows above the samples.
struct Header {
    rate_hz: f64,
    separator: char,
    names: Vec<String>,
    /// Metres in the unit of each marker.
    metres: Vec<f64>,
}

impl Header {
    fn read<R: Read>(lines: &mut LineReader<'_, '_, R>) -> Result<Self, ReadError> {
        lines.next_required("the rate")?;
        let rate = section_name(&lines.line).replace(',', ".");
        let rate_hz = rate
            .parse::<f64>()
            .ok()
            .filter(|rate_hz| *rate_hz > 0.0 && *rate_hz <= MAX_RATE_HZ);
        let Some(rate_hz) = rate_hz else {
            return lines.refuse(format!("{} is not a rate in Hz", quoted(&lines.line)), EXPORT_AGAIN);
        };
        lines.next_required("the row of marker names")?;
        let names_at = lines.number;
        let names_line = lines.line.clone();
        lines.next_required("the row Frame, Sub Frame, X, Y, Z")?;
        let separator = if lines.line.contains(';') { ';' } else { ',' };
        let fields: Vec<&str> = lines.line.split(separator).map(clean).collect();
        let columns = fields
            .iter()
            .rposition(|field| !field.is_empty())
            .map_or(0, |last| last + 1);
        let is_header = columns >= 5
            && fields[0].eq_ignore_ascii_case("frame")
            && fields[1].eq_ignore_ascii_case("sub frame")
            && (columns - 2).is_multiple_of(3)
            && fields[2..columns].chunks(3).all(|axes| axes == ["X", "Y", "Z"]);
        if !is_header {
            let problem = format!("{} is not the row Frame, Sub Frame, X, Y, Z, …", quoted(&lines.line));
            return lines.refuse(problem, EXPORT_AGAIN);
        }
        let markers = (columns - 2) / 3;
        let names: Vec<&str> = names_line.split(separator).map(clean).collect();
        let name_of = |marker: usize| match names.get(2 + 3 * marker) {
            Some(&"") | None => None,
            Some(&name) => Some(abridged(name.to_owned(), MAX_NAME)),
        };
        let Some(names) = (0..markers).map(name_of).collect::<Option<Vec<_>>>() else {
            return Err(ReadError::at(
                lines.path,
                format!("line {names_at}"),
                format!("there are coordinates of {markers} markers, but not a name above each X"),
                EXPORT_AGAIN,
            ));
        };
        lines.next_required("the row of units")?;
        let units: Vec<&str> = lines.line.split(separator).map(clean).collect();
        let mut metres = Vec::with_capacity(markers);
        for (marker, name) in names.iter().enumerate() {
            let axes = units.get(2 + 3 * marker..5 + 3 * marker).unwrap_or_default();
            let unit = axes.first().filter(|unit| axes.iter().all(|axis| axis == *unit));
            match unit.and_then(|unit| metres_in(unit)) {
                Some(length_m) => metres.push(length_m),
                None => {
                    let problem = format!("{} gives marker {} no unit mm, cm or m", quoted(&lines.line), name);
                    return lines.refuse(problem, EXPORT_AGAIN);
                }
            }
        }
        Ok(Self {
            rate_hz,
            separator,
            names,
            metres,
        })
    }
}

fn clean(field: &str) -> &str {
    field.trim().trim_matches('"').trim()
}

fn read_samples<R: Read>(lines: &mut LineReader<'_, '_, R>, header: Header) -> Result<Markers, ReadError> {
    let mut markers = Markers {
        position_m: vec![Vec::new(); header.names.len()],
        ..Markers::default()
    };
    let mut first_and_last = None;
    while lines.next()? && !is_blank(&lines.line) {
        let sample = match parse_sample(lines, &header) {
            Ok(sample) => sample,
            Err(error) => {
                let line = lines.number;
                if lines.next()? || !lines.reader.get_ref().is_unterminated() {
                    return Err(error);
                }
                let note =
                    format!("line {line}: the file is cut off in this line; the whole samples before it are used");
                markers.warnings.push(note);
                break;
            }
        };
        let (first, last) = *first_and_last.get_or_insert((sample.frame, sample.frame - 1));
        if sample.frame <= last {
            let problem = format!("frame {} comes after frame {last}", sample.frame);
            return lines.refuse(problem, "export it again with each frame once, in order");
        }
        first_and_last = Some((first, sample.frame));
        markers.time_s.push((sample.frame - first) as f64 / header.rate_hz);
        for (series, position_m) in markers.position_m.iter_mut().zip(sample.position_m) {
            series.push(position_m);
        }
    }
    markers.names = header.names;
    Ok(markers)
}

struct Sample {
    frame: i64,
    position_m: Vec<[f64; 3]>,
}

fn parse_sample<R: Read>(lines: &LineReader<'_, '_, R>, header: &Header) -> Result<Sample, ReadError> {
    let mut fields = lines.line.split(header.separator).map(clean);
    let mut whole = |what: &str| {
        let field = fields.next().unwrap_or("");
        // Frames beyond this have no exact time.
        let number = field.parse::<i64>().ok().filter(|number| number.abs() < 1 << 52);
        number.map_or_else(
            || lines.refuse(format!("{} is not a {what} number", quoted(field)), EXPORT_AGAIN),
            Ok,
        )
    };
    let frame = whole("frame")?;
    if whole("sub frame")? != 0 {
        return lines.refuse("a trajectory has sub frames", EXPORT_AGAIN);
    }
    let mut position_m = Vec::with_capacity(header.names.len());
    for (name, metres) in header.names.iter().zip(&header.metres) {
        let mut position = UNSEEN;
        for (axis, part) in position.iter_mut().enumerate() {
            let axis_name = ["X", "Y", "Z"][axis];
            let Some(field) = fields.next() else {
                return lines.refuse(format!("the row ends before {axis_name} of {name}"), EXPORT_AGAIN);
            };
            if field.is_empty() {
                continue;
            }
            let number = if header.separator == ';' {
                field.replace(',', ".").parse()
            } else {
                field.parse::<f64>()
            };
            *part = match number {
                Ok(number) if !number.is_infinite() => number * metres,
                _ => {
                    return lines.refuse(
                        format!("{axis_name} of {name}: {} is not a number", quoted(field)),
                        EXPORT_AGAIN,
                    );
                }
            };
        }
        // A marker with a missing coordinate was not seen.
        position_m.push(if position.iter().any(|part| part.is_nan()) {
            UNSEEN
        } else {
            position
        });
    }
    if let Some(extra) = fields.find(|field| !field.is_empty()) {
        let problem = format!("the row has more fields than markers, such as {}", quoted(extra));
        return lines.refuse(problem, "with a decimal comma, fields must be separated by semicolons");
    }
    Ok(Sample { frame, position_m })
}

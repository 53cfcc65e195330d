//! A servo's recording as a CSV file, with a row for each reading.
//!
//! | column | what |
//! |---|---|
//! | `time_s` | time of the reading, s, growing |
//! | `goal_rad` | goal position that was written then, rad |
//! | `position_rad`, `velocity_rad_s` | as read |
//! | `current_ma` | present current as read, a signed number |
//! | `input_v`, `temperature_c` | as read; either may be missing |
//! | `torque_enabled` | 1, or 0 where the servo was switched off; 1 throughout where it is missing |

use super::checks;
use super::recording::ServoRecording;
use crate::recording::text::Text;
use csv::StringRecord;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use worm_log::ReadError;

/// Largest file, bytes.
const MAX_BYTES: u64 = 256 << 20;
/// Fewest readings.
const MIN_READINGS: usize = 100;
/// Columns that every recording has, and those that it may have.
const NEEDED: [&str; 5] = ["time_s", "goal_rad", "position_rad", "velocity_rad_s", "current_ma"];
const OPTIONAL: [&str; 3] = ["input_v", "temperature_c", "torque_enabled"];
const REMEDY: &str = "a servo's recording is a CSV file with the columns time_s, goal_rad, position_rad, velocity_rad_s and current_ma, \
                      and possibly input_v, temperature_c and torque_enabled";

impl ServoRecording {
    /// Reads a file.
    ///
    /// # Errors
    /// [`ReadError`] names file, line and remedy: for a file that is none, a missing column, time that does not grow, a current without
    /// sign, and values on another servo's scale.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let failed = |error: std::io::Error| ReadError::whole(path, error.to_string(), "give an existing CSV file");
        let file = File::open(path).map_err(failed)?;
        let metadata = file.metadata().map_err(failed)?;
        if !metadata.is_file() {
            return Err(ReadError::whole(path, "it is not a file", REMEDY));
        }
        if metadata.len() > MAX_BYTES {
            return Err(ReadError::whole(
                path,
                format!("longer than {MAX_BYTES} bytes"),
                "record for a shorter time",
            ));
        }
        Self::read(file.take(MAX_BYTES), path)
    }

    /// As [`open`](Self::open), from any reader; errors call it `path`.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn read(from: impl Read, path: &Path) -> Result<Self, ReadError> {
        // It is read in a moment: nobody waits for its progress.
        let mut progress = |_| ();
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(Text::new(from, MAX_BYTES, &mut progress));
        let header = reader
            .headers()
            .map_err(|error| ReadError::at(path, "line 1", error.to_string(), REMEDY))?
            .clone();
        let place = |name: &str| header.iter().position(|column| column == name);
        let mut needed = [0; NEEDED.len()];
        for (place_of, name) in needed.iter_mut().zip(NEEDED) {
            *place_of = place(name).ok_or_else(|| missing(path, name))?;
        }
        let optional = OPTIONAL.map(place);
        let mut recording = Self::empty(path);
        let mut row = StringRecord::new();
        loop {
            let more = reader
                .read_record(&mut row)
                .map_err(|error| ReadError::whole(path, error.to_string(), REMEDY))?;
            if !more {
                break;
            }
            // The reader stands behind the row; before it there may have been comments.
            let line = reader.position().line().saturating_sub(1);
            recording.push(&row, line, &needed, &optional)?;
        }
        recording.check()?;
        Ok(recording)
    }

    fn empty(path: &Path) -> Self {
        Self {
            source: path.to_path_buf(),
            time_s: Vec::new(),
            goal_rad: Vec::new(),
            position_rad: Vec::new(),
            velocity_rad_s: Vec::new(),
            current_a: Vec::new(),
            input_v: Vec::new(),
            temperature_c: Vec::new(),
            torque_enabled: Vec::new(),
        }
    }

    fn push(
        &mut self,
        row: &StringRecord,
        line: u64,
        needed: &[usize; NEEDED.len()],
        optional: &[Option<usize>; OPTIONAL.len()],
    ) -> Result<(), ReadError> {
        let path = self.source.clone();
        let number = |place: usize, name: &str| -> Result<f64, ReadError> {
            let text = row.get(place).unwrap_or("");
            match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err(ReadError::at(
                    &path,
                    format!("line {line}"),
                    format!("{name} is `{text}`"),
                    "give a number in every row, or leave the row out",
                )),
            }
        };
        let mut values = [0.0; NEEDED.len()];
        for ((value, &place), name) in values.iter_mut().zip(needed).zip(NEEDED) {
            *value = number(place, name)?;
        }
        let [time_s, goal_rad, position_rad, velocity_rad_s, current_ma] = values;
        if let Some(&before_s) = self.time_s.last()
            && time_s <= before_s
        {
            return Err(ReadError::at(
                &path,
                format!("line {line}"),
                format!("time runs backward or stands still: {time_s} s after {before_s} s"),
                "list the readings in their order, each with its own time",
            ));
        }
        checks::signed_current(&path, line, current_ma)?;
        self.time_s.push(time_s);
        self.goal_rad.push(goal_rad);
        self.position_rad.push(position_rad);
        self.velocity_rad_s.push(velocity_rad_s);
        self.current_a.push(1e-3 * current_ma);
        let [input_v, temperature_c, torque_enabled] = optional;
        if let Some(place) = input_v {
            self.input_v.push(number(*place, OPTIONAL[0])?);
        }
        if let Some(place) = temperature_c {
            self.temperature_c.push(number(*place, OPTIONAL[1])?);
        }
        let is_enabled = match torque_enabled {
            Some(place) => number(*place, OPTIONAL[2])? != 0.0,
            None => true,
        };
        self.torque_enabled.push(is_enabled);
        Ok(())
    }

    fn check(&self) -> Result<(), ReadError> {
        let readings = self.time_s.len();
        if readings < MIN_READINGS {
            return Err(ReadError::whole(
                &self.source,
                format!("{readings} readings, at least {MIN_READINGS} are needed"),
                "record for some seconds",
            ));
        }
        checks::scale(self)?;
        checks::current_of_both_signs(self)
    }
}

fn missing(path: &Path, name: &str) -> ReadError {
    let problem = match name {
        "goal_rad" => "no column goal_rad: without the goal nobody can tell what the servo was to do".to_owned(),
        _ => format!("no column {name}"),
    };
    ReadError::at(path, "line 1", problem, REMEDY)
}

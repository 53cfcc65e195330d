//! A route: legs of a length and a slope, as CSV.

use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};
use worm_estimator::abridged::abridged;

/// Most legs of a route.
pub const MAX_LEGS: usize = 10_000;
/// Longest leg, m.
const MAX_LENGTH_M: f64 = 1e5;
/// The columns that a route must have …
const COLUMNS: [&str; 2] = ["length_m", "slope_deg"];
/// … and the one that it may have.
const CYCLE_COLUMN: &str = "cycle_s";
/// Shortest and longest gait cycle, s, as in the configuration.
const CYCLES_S: [f64; 2] = [0.5, 120.0];
/// Longest foreign text in an error, bytes.
const MAX_QUOTED: usize = 60;

/// One leg.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Leg {
    /// Length along the canal, m; above 0.
    pub length_m: f64,
    /// Slope, degrees, positive uphill; −90 to 90.
    pub slope_deg: f64,
    /// Time of a gait cycle on this leg, s; none where it is that of the design.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycle_s: Option<f64>,
}

impl Leg {
    /// Time of a gait cycle on this leg, s, where one of `usual_s` is what has no other.
    pub fn cycle_s(&self, usual_s: f64) -> f64 {
        self.cycle_s.unwrap_or(usual_s)
    }
}

/// The legs of a trip, in their order; at least one.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    legs: Vec<Leg>,
}

/// What is wrong with a route, and where.
#[derive(Debug, thiserror::Error)]
#[error("{}{place}: {problem}: {remedy}", file.display())]
pub struct RouteError {
    file: PathBuf,
    place: Place,
    problem: String,
    remedy: String,
}

#[derive(Debug)]
enum Place {
    File,
    Line(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ":{line}"),
        }
    }
}

impl Route {
    /// Reads the text of a route; errors call it `file`. Columns may be in any order, and `#` begins a comment line.
    ///
    /// # Errors
    /// [`RouteError`], with the line, for a column that is missing or unknown, a field that is no number or out of range, and a route
    /// without legs or with more than [`MAX_LEGS`].
    pub fn from_csv(text: &str, file: &Path) -> Result<Self, RouteError> {
        let wrong = |place, problem: String, remedy: &str| RouteError {
            file: file.to_owned(),
            place,
            problem,
            remedy: remedy.to_owned(),
        };
        let damaged = |error: csv::Error| {
            let place = error.position().map_or(Place::File, |at| Place::Line(at.line()));
            let problem = match error.kind() {
                csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                    format!("{len} fields where the head has {expected_len}")
                }
                other => abridged(format!("{other:?}"), MAX_QUOTED),
            };
            wrong(place, problem, "give one field for each column")
        };
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(text.trim_start_matches('\u{feff}').as_bytes());
        let head = reader.headers().map_err(damaged)?.clone();
        let head_line = head.position().map_or(1, csv::Position::line);
        let is_known = |name: &str| COLUMNS.contains(&name) || name == CYCLE_COLUMN;
        if let Some(unknown) = head.iter().find(|name| !is_known(name)) {
            let problem = format!("unknown column `{}`", abridged(unknown.to_owned(), MAX_QUOTED));
            return Err(wrong(
                Place::Line(head_line),
                problem,
                "the columns are length_m and slope_deg, and cycle_s where a leg has a speed of its own",
            ));
        }
        let mut columns = [0; COLUMNS.len()];
        for (name, column) in COLUMNS.iter().zip(&mut columns) {
            let mut places = head.iter().enumerate().filter(|(_, head)| head == name);
            let (Some((place, _)), None) = (places.next(), places.next()) else {
                let problem = format!("column `{name}` is not there exactly once");
                return Err(wrong(
                    Place::Line(head_line),
                    problem,
                    "begin with a line `length_m,slope_deg`",
                ));
            };
            *column = place;
        }
        let cycle_columns: Vec<usize> = (0..head.len()).filter(|&at| &head[at] == CYCLE_COLUMN).collect();
        if cycle_columns.len() > 1 {
            let problem = format!("column `{CYCLE_COLUMN}` is there {} times", cycle_columns.len());
            return Err(wrong(Place::Line(head_line), problem, "give it once"));
        }
        let mut legs = Vec::new();
        for record in reader.records() {
            let record = record.map_err(damaged)?;
            let line = Place::Line(record.position().map_or(0, csv::Position::line));
            let number = |column: usize, low: f64, high: f64, unit: &str| {
                let text = record.get(column).unwrap_or_default();
                let value: Option<f64> = text.parse().ok();
                value.filter(|value| (low..=high).contains(value)).ok_or_else(|| {
                    let problem = format!("{} = '{}'", &head[column], abridged(text.to_owned(), MAX_QUOTED));
                    (problem, format!("give a number from {low} to {high} {unit}"))
                })
            };
            let cycle_column = cycle_columns.first().filter(|&&at| !record[at].is_empty());
            let leg = number(columns[0], 1e-3, MAX_LENGTH_M, "m").and_then(|length_m| {
                Ok(Leg {
                    length_m,
                    slope_deg: number(columns[1], -90.0, 90.0, "degrees")?,
                    cycle_s: cycle_column
                        .map(|&column| number(column, CYCLES_S[0], CYCLES_S[1], "s"))
                        .transpose()?,
                })
            });
            let leg = leg.map_err(|(problem, remedy)| wrong(line, problem, &remedy))?;
            if legs.len() == MAX_LEGS {
                let line = Place::Line(record.position().map_or(0, csv::Position::line));
                let problem = format!("more than {MAX_LEGS} legs");
                return Err(wrong(line, problem, "join neighbouring legs of one slope"));
            }
            legs.push(leg);
        }
        if legs.is_empty() {
            let remedy = "give a line for each leg below `length_m,slope_deg`";
            return Err(wrong(Place::File, "no leg".to_owned(), remedy));
        }
        Ok(Self { legs })
    }

    /// The legs; at least one.
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Length of all legs, m.
    pub fn length_m(&self) -> f64 {
        self.legs.iter().map(|leg| leg.length_m).sum()
    }

    /// The same legs with slopes that are this many times theirs: −1 for the way back.
    pub(crate) fn scaled_slopes(&self, factor: f64) -> Self {
        let scaled = |leg: &Leg| Leg {
            slope_deg: factor * leg.slope_deg,
            ..*leg
        };
        Self {
            legs: self.legs.iter().map(scaled).collect(),
        }
    }

    /// Every slope of the route once, growing, and for each leg which of them it has.
    pub fn slopes(&self) -> (Vec<f64>, Vec<usize>) {
        let mut slopes_deg: Vec<f64> = self.legs.iter().map(|leg| leg.slope_deg).collect();
        slopes_deg.sort_by(f64::total_cmp);
        slopes_deg.dedup();
        let slope_of = |leg: &Leg| slopes_deg.partition_point(|slope| *slope < leg.slope_deg);
        let of_leg = self.legs.iter().map(slope_of).collect();
        (slopes_deg, of_leg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Route, RouteError> {
        Route::from_csv(text, Path::new("route.csv"))
    }

    #[test]
    fn legs_are_read_in_their_order() {
        let route = read("# home to pipe\n slope_deg , length_m\n0,1.5\n\n30, 0.5\n0,2\n-10,1\n").expect("a route");
        let legs: Vec<_> = route.legs().iter().map(|leg| (leg.length_m, leg.slope_deg)).collect();
        assert_eq!(legs, [(1.5, 0.0), (0.5, 30.0), (2.0, 0.0), (1.0, -10.0)]);
        assert_eq!(route.slopes(), (vec![-10.0, 0.0, 30.0], vec![1, 2, 1, 0]));
        assert!((route.length_m() - 5.0).abs() < 1e-12);
        let route = read("length_m,cycle_s,slope_deg\n1,4,0\n1,,30\n").expect("a route");
        assert_eq!(route.legs()[0].cycle_s(2.5), 4.0);
        assert_eq!(route.legs()[1].cycle_s(2.5), 2.5);
    }

    #[test]
    fn errors_name_line_and_remedy() {
        for (text, expected) in [
            (
                "",
                "route.csv:1: column `length_m` is not there exactly once: begin with",
            ),
            ("length_m,slope_deg\n", "route.csv: no leg: give a line"),
            (
                "length_m,slope\n1,2\n",
                "route.csv:1: unknown column `slope`: the columns are",
            ),
            (
                "length_m,length_m,slope_deg\n1,1,2\n",
                "route.csv:1: column `length_m` is not there exactly once",
            ),
            (
                "length_m,slope_deg\n1,0\n2\n",
                "route.csv:3: 1 fields where the head has 2",
            ),
            (
                "length_m,slope_deg\n1,0\nfar,0\n",
                "route.csv:3: length_m = 'far': give a number from 0.001 to 100000 m",
            ),
            ("length_m,slope_deg\n-1,0\n", "route.csv:2: length_m = '-1'"),
            (
                "length_m,slope_deg\n1,91\n",
                "route.csv:2: slope_deg = '91': give a number from -90 to 90 degrees",
            ),
            (
                "length_m,slope_deg,cycle_s\n1,0,0\n",
                "route.csv:2: cycle_s = '0': give a number from 0.5 to 120 s",
            ),
            (
                "length_m,slope_deg,cycle_s,cycle_s\n1,0,2,2\n",
                "route.csv:1: column `cycle_s` is there 2 times",
            ),
            ("length_m,slope_deg\n1,nan\n", "route.csv:2: slope_deg = 'nan'"),
        ] {
            let error = read(text).expect_err(text).to_string();
            assert!(
                error.contains(expected),
                "for {text:?}\n  expected … {expected}\n  got      {error}"
            );
        }
    }
}

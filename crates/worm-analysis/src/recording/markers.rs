//! Motion capture: named markers in space.

/// Tracks of markers in space, before it is known which of them are a worm's cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Markers {
    /// Names of the markers.
    pub names: Vec<String>,
    /// Time of each sample, s, strictly increasing.
    pub time_s: Vec<f64>,
    /// Positions in the laboratory's space, m: `position_m[marker][sample]`; `NaN` in all three where not seen.
    pub position_m: Vec<Vec<[f64; 3]>>,
    /// What the reader noticed.
    pub warnings: Vec<String>,
}

/// A marker that was not seen.
pub(super) const UNSEEN: [f64; 3] = [f64::NAN; 3];

/// Metres in one of the named unit of length.
pub(super) fn metres_in(unit: &str) -> Option<f64> {
    match unit.trim().to_ascii_lowercase().as_str() {
        "mm" => Some(1e-3),
        "cm" => Some(1e-2),
        "m" => Some(1.0),
        _ => None,
    }
}

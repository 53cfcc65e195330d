//! Tiles: what was found, large, in rows with a name before each.

use super::number::NONE;
use super::page::escaped;
use std::fmt::Write;

/// One figure of an answer.
#[derive(Debug, Clone)]
pub struct Tile {
    /// What it is: HTML already.
    pub name: String,
    /// Its value, with its error behind ` ± ` where it has one.
    pub value: String,
    /// The unit of both; left out where there is no value.
    pub unit: String,
    /// How it is counted.
    pub how: String,
}

/// Adds a row of tiles; `place` before them and `foot` below them are HTML already.
pub fn push_row(html: &mut String, place: &str, tiles: &[Tile], foot: &str) {
    let _ = write!(html, "<div class=\"row\"><div class=\"place\">{place}</div><ul>"); // A String takes all.
    for Tile { name, value, unit, how } in tiles {
        let unit = if value == NONE { "" } else { unit };
        let (value, error) = value.split_once(" ± ").unwrap_or((value, ""));
        let error = match error {
            "" => String::new(),
            error => format!("<em>± {}</em>", escaped(error)),
        };
        let (value, unit, how) = (escaped(value), escaped(unit), escaped(how));
        let _ = write!(
            html,
            "<li><span>{name}</span><strong>{value}<small>{unit}</small></strong>{error}<span class=\"how\">{how}</span></li>"
        ); // As above.
    }
    let _ = writeln!(html, "</ul>{foot}</div>"); // As above.
}

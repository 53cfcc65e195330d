//! Tiles: the most important values, large, in rows with a name before each; as text, one line for each value.

use super::table::aligned;
use crate::report::plot::{Colour, Svg, css};
use maud::{Markup, Render, html};
use std::fmt;
use worm_estimator::number::NONE;

/// One value.
#[derive(Debug, Clone, Default)]
pub struct Tile {
    /// Colour of the dot before its name.
    pub dot: Option<Colour>,
    /// What it is.
    pub name: String,
    /// Its value, with its error behind ` ± ` where it has one.
    pub value: String,
    /// The unit of both; left out where there is no value.
    pub unit: String,
    /// What it is counted from, or compared with.
    pub how: String,
}

impl Tile {
    /// A tile without a dot.
    pub fn new(
        name: impl Into<String>,
        value: impl Into<String>,
        unit: impl Into<String>,
        how: impl Into<String>,
    ) -> Self {
        Self {
            dot: None,
            name: name.into(),
            value: value.into(),
            unit: unit.into(),
            how: how.into(),
        }
    }

    fn shown_unit(&self) -> &str {
        if self.value == NONE { "" } else { &self.unit }
    }
}

/// A part of a sentence below the tiles.
#[derive(Debug, Clone)]
pub enum Text {
    /// Plain words.
    Plain(String),
    /// Emphasised words.
    Strong(String),
    /// A formula.
    Formula(String),
}

/// A row of tiles.
#[derive(Debug, Clone, Default)]
pub struct TileRow {
    /// A picture above its name.
    pub picture: Option<Svg>,
    /// What the values belong to.
    pub name: String,
    /// Colour of the dot before the note.
    pub dot: Option<Colour>,
    /// What to know of it, below its name.
    pub note: String,
    /// The values.
    pub tiles: Vec<Tile>,
    /// Paragraphs below the values.
    pub foot: Vec<Vec<Text>>,
}

fn dot(colour: Option<Colour>) -> Markup {
    html! { @if let Some(colour) = colour { i style={ "--c:" (css(colour)) } {} } }
}

impl Render for Tile {
    fn render(&self) -> Markup {
        let (value, error) = self.value.split_once(" ± ").unwrap_or((&self.value, ""));
        html! {
            li {
                span { (dot(self.dot)) (self.name) }
                strong { (value) small { (self.shown_unit()) } }
                @if !error.is_empty() { em { "± " (error) } }
                span.how { (self.how) }
            }
        }
    }
}

impl Render for Text {
    fn render(&self) -> Markup {
        match self {
            Self::Plain(text) => html! { (text) },
            Self::Strong(text) => html! { b { (text) } },
            Self::Formula(text) => html! { span.formula { (text) } },
        }
    }
}

impl Render for TileRow {
    fn render(&self) -> Markup {
        html! {
            div.row {
                div.place {
                    @if let Some(picture) = &self.picture { (picture) }
                    b { (self.name) }
                    small { (dot(self.dot)) (self.note) }
                }
                ul { @for tile in &self.tiles { (tile) } }
                @if !self.foot.is_empty() {
                    div.foot { @for paragraph in &self.foot { p { @for text in paragraph { (text) } } } }
                }
            }
        }
    }
}

impl fmt::Display for TileRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.name)?;
        if !self.note.is_empty() {
            write!(f, ", {}", self.note)?;
        }
        let line = |tile: &Tile| {
            let value = format!("{} {}", tile.value, tile.shown_unit());
            [tile.name.clone(), value.trim_end().to_owned(), tile.how.clone()]
        };
        let lines: Vec<_> = self.tiles.iter().map(line).collect();
        let lines: Vec<&[String]> = lines.iter().map(|line| &line[..]).collect();
        write!(f, "\n{}", aligned(&lines, |_| true))?;
        for paragraph in &self.foot {
            write!(f, "\n  ")?;
            for Text::Plain(text) | Text::Strong(text) | Text::Formula(text) in paragraph {
                write!(f, "{text}")?;
            }
        }
        Ok(())
    }
}

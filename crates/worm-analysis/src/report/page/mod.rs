//! A page: one self-contained HTML file that fetches nothing, for a screen, a telephone and paper.
//!
//! What a page shows is data first: a [`Figure`], a [`Table`], a [`TileRow`]. Each renders itself through `maud`, which
//! escapes all text, so no report writes HTML by hand. Tables and tiles also print as text for the terminal.

mod figure;
mod table;
mod tile;

pub use figure::{Figure, Key, Mark, Panel};
pub use table::{QuantityRow, Table};
pub use tile::{Text, Tile, TileRow};

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

/// A page under construction.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    style: &'static str,
    body: Vec<Markup>,
    figures: usize,
}

impl Page {
    /// A page with a title and a line below it that says what the page is about.
    pub fn new(title: &str, lead: &str) -> Self {
        let head = html! { h1 { (title) } p.lead { (lead) } };
        Self {
            title: title.to_owned(),
            style: "",
            body: vec![head],
            figures: 0,
        }
    }

    /// The page with CSS of its own after the common one.
    pub fn with_style(self, style: &'static str) -> Self {
        Self { style, ..self }
    }

    /// Adds anything that renders itself.
    pub fn add(&mut self, part: impl Render) {
        self.body.push(part.render());
    }

    /// Begins a section.
    pub fn heading(&mut self, heading: &str) {
        self.add(html! { h2 { (heading) } });
    }

    /// Adds a paragraph.
    pub fn paragraph(&mut self, text: &str) {
        self.add(html! { p { (text) } });
    }

    /// Adds a paragraph of a CSS class.
    pub fn paragraph_of(&mut self, class: &str, text: &str) {
        self.add(html! { p class=(class) { (text) } });
    }

    /// Adds warnings, if there are any.
    pub fn warnings(&mut self, warnings: &[String]) {
        if warnings.is_empty() {
            return;
        }
        self.add(html! {
            aside.warnings {
                strong { "To know when reading this" }
                ul { @for warning in warnings { li { (warning) } } }
            }
        });
    }

    /// Adds rows of tiles, if there are any.
    pub fn tiles(&mut self, rows: &[TileRow]) {
        if rows.is_empty() {
            return;
        }
        self.add(html! { section.answer { @for row in rows { (row) } } });
    }

    /// Adds a figure with the next number.
    pub fn figure(&mut self, figure: &Figure) {
        self.figures += 1;
        self.add(figure.numbered(self.figures));
    }

    /// The whole file.
    pub fn finish(self) -> String {
        // The style is the program's own, and CSS has no entities: it goes in as it is.
        let style = PreEscaped([include_str!("style.css"), self.style].concat());
        let page = html! {
            (DOCTYPE) "\n"
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { (self.title) }
                    style { (style) }
                }
                body { main { @for part in &self.body { (part) "\n" } } }
            }
        };
        // HTML may not hold control characters, escaped or not.
        let is_forbidden = |character: char| character.is_control() && character != '\n';
        page.into_string().replace(is_forbidden, " ")
    }
}

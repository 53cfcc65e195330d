//! A page: one self-contained file that fetches nothing, to be looked at on a screen, on a telephone and on paper.

use super::plot::{Colour, css};
use super::table::Table;
use std::fmt::Write;

/// Text made safe for HTML, between tags and in attributes. Control characters, which no page may hold, become spaces.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            control if control.is_control() => safe.push(' '),
            other => safe.push(other),
        }
    }
    safe
}

/// What an entry of a legend looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A thin line.
    Line,
    /// A thick line.
    Thick,
    /// A dashed line.
    Dashed,
    /// A dot.
    Dot,
    /// A ring.
    Ring,
    /// A diamond.
    Diamond,
    /// A filled box.
    Box,
    /// An empty box.
    Frame,
    /// A pale band.
    Band,
}

impl Mark {
    fn class(self) -> &'static str {
        match self {
            Self::Line => "line",
            Self::Thick => "thick",
            Self::Dashed => "dashed",
            Self::Dot => "dot",
            Self::Ring => "ring",
            Self::Diamond => "diamond",
            Self::Box => "box",
            Self::Frame => "frame",
            Self::Band => "band",
        }
    }
}

/// An entry of a legend.
#[derive(Debug, Clone)]
pub struct Key {
    /// What it looks like.
    pub mark: Mark,
    /// Its colour.
    pub colour: Colour,
    /// What it means.
    pub text: String,
}

impl Key {
    /// An entry.
    pub fn new(mark: Mark, colour: Colour, text: impl Into<String>) -> Self {
        Self {
            mark,
            colour,
            text: text.into(),
        }
    }
}

/// One picture of a figure.
#[derive(Debug, Clone)]
pub struct Panel {
    /// What sets it apart from the others.
    pub title: String,
    /// What its vertical axis shows, with the unit.
    pub quantity: String,
    /// The picture, inline SVG.
    pub svg: String,
}

/// A figure: panels with one legend and one caption.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Name of its anchor in the page.
    pub id: &'static str,
    /// What it shows, in a few words.
    pub title: String,
    /// Its legend.
    pub keys: Vec<Key>,
    /// Its pictures.
    pub panels: Vec<Panel>,
    /// What to see in it.
    pub caption: String,
}

/// A page in the making.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    style: &'static str,
    body: String,
    figures: usize,
}

impl Page {
    /// A page with a title and nothing on it yet.
    pub fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            style: "",
            body: String::new(),
            figures: 0,
        }
    }

    /// The page with a style of its own beyond the common one.
    pub fn with_style(self, style: &'static str) -> Self {
        Self { style, ..self }
    }

    /// Adds what is HTML already.
    pub fn html(&mut self, html: &str) {
        self.body.push_str(html);
        self.body.push('\n');
    }

    /// Begins a section.
    pub fn heading(&mut self, heading: &str) {
        self.html(&format!("<h2>{}</h2>", escaped(heading)));
    }

    /// Adds a paragraph.
    pub fn paragraph(&mut self, text: &str) {
        self.html(&format!("<p>{}</p>", escaped(text)));
    }

    /// Adds warnings, where there are any.
    pub fn warnings(&mut self, warnings: &[String]) {
        if warnings.is_empty() {
            return;
        }
        let items: String = warnings
            .iter()
            .map(|warning| format!("<li>{}</li>", escaped(warning)))
            .collect();
        self.html(&format!(
            "<aside class=\"warnings\"><strong>To know when reading this</strong><ul>{items}</ul></aside>"
        ));
    }

    /// Adds a table.
    pub fn table(&mut self, table: &Table) {
        self.html(&table.html());
    }

    /// Adds a figure with the next number.
    pub fn figure(&mut self, figure: &Figure) {
        self.figures += 1;
        let number = self.figures;
        let id = figure.id;
        // A single panel is large, with legend and caption beside it. With an odd number of panels the caption takes the free
        // place beside the last.
        let place = match figure.panels.len() {
            1 => "single",
            panels if panels % 2 == 1 => "beside",
            _ => "below",
        };
        let mut html = format!(
            "<figure id=\"{id}\" class=\"{place}\"><h3><span>{number}</span>{}</h3>\n<ul class=\"keys\">",
            escaped(&figure.title)
        );
        for key in &figure.keys {
            let (class, colour) = (key.mark.class(), css(key.colour));
            let text = escaped(&key.text);
            let _ = write!(html, "<li><i class=\"{class}\" style=\"--c:{colour}\"></i>{text}</li>"); // A String takes all.
        }
        html.push_str("</ul>\n");
        for panel in &figure.panels {
            let (title, quantity) = (escaped(&panel.title), escaped(&panel.quantity));
            let svg = &panel.svg;
            let _ = writeln!(html, "<div><h4>{title} <span>{quantity}</span></h4>{svg}</div>"); // As above.
        }
        let _ = write!(html, "<figcaption>{}</figcaption></figure>", escaped(&figure.caption)); // As above.
        self.html(&html);
    }

    /// The whole file.
    pub fn finish(self) -> String {
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{}</title>\n<style>\n{}{}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</html>\n",
            escaped(&self.title),
            include_str!("style.css"),
            self.style,
            self.body
        )
    }
}

//! Figures: panels with one legend and one caption.

use crate::report::plot::{Colour, Svg, css};
use maud::{Markup, html};

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
    /// The picture.
    pub svg: Svg,
}

impl Panel {
    /// A panel.
    pub fn new(title: impl Into<String>, quantity: impl Into<String>, svg: Svg) -> Self {
        Self {
            title: title.into(),
            quantity: quantity.into(),
            svg,
        }
    }
}

/// A figure.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Its anchor in the page.
    pub id: &'static str,
    /// What it shows, in a few words.
    pub title: &'static str,
    /// Its legend.
    pub keys: Vec<Key>,
    /// Its pictures.
    pub panels: Vec<Panel>,
    /// What to see in it.
    pub caption: String,
}

impl Figure {
    /// The figure under a number of the page.
    pub(super) fn numbered(&self, number: usize) -> Markup {
        // A single panel is large, with legend and caption beside it. With an odd number of panels the caption takes the free
        // place beside the last.
        let place = match self.panels.len() {
            1 => "single",
            panels if panels % 2 == 1 => "beside",
            _ => "below",
        };
        html! {
            figure id=(self.id) class=(place) {
                h3 { span { (number) } (self.title) }
                ul.keys {
                    @for key in &self.keys {
                        li { i class=(key.mark.class()) style={ "--c:" (css(key.colour)) } {} (key.text) }
                    }
                }
                @for panel in &self.panels {
                    div { h4 { (panel.title) " " span { (panel.quantity) } } (panel.svg) }
                }
                figcaption { (self.caption) }
            }
        }
    }
}

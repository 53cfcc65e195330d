//! Tables, for a page and for the terminal.

use maud::{Markup, Render, html};
use std::fmt;
use worm_estimator::number::count;

/// Most rows that the terminal shows of a table.
const MAX_TERMINAL_ROWS: usize = 40;

/// A table: a caption, names of columns, and rows of text. The first column names the rows.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// What it holds, with the units.
    pub title: String,
    /// Names of the columns.
    pub head: Vec<String>,
    /// The rows.
    pub rows: Vec<Vec<String>>,
    /// How many of the first columns hold words rather than numbers; the first always does.
    pub word_columns: usize,
    /// What to know when reading it.
    pub note: Option<String>,
}

impl Table {
    /// A table without rows yet.
    pub fn new(title: impl Into<String>, head: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self {
            title: title.into(),
            head: head.into_iter().map(Into::into).collect(),
            word_columns: 1,
            ..Self::default()
        }
    }

    /// The table with so many columns of words at its left.
    pub fn with_word_columns(self, word_columns: usize) -> Self {
        Self { word_columns, ..self }
    }

    /// A table with a column for each item, under its name, and a row for each quantity of the items.
    pub fn of_items<T>(title: &str, names: Vec<String>, items: &[T], quantities: &[QuantityRow<'_, T>]) -> Self {
        let head = std::iter::once(String::new()).chain(names);
        let row = |(name, of): &QuantityRow<'_, T>| {
            let values = items.iter().map(of);
            std::iter::once((*name).to_owned()).chain(values).collect()
        };
        Self {
            rows: quantities.iter().map(row).collect(),
            ..Self::new(title, head)
        }
    }

    fn holds_words(&self, column: usize) -> bool {
        column < self.word_columns.max(1)
    }
}

/// The name of a quantity, and how to write its value for an item.
pub type QuantityRow<'a, T> = (&'a str, &'a dyn Fn(&T) -> String);

impl Render for Table {
    fn render(&self) -> Markup {
        let class = |column: usize| (column > 0 && self.holds_words(column)).then_some("words");
        html! {
            div.table {
                table {
                    caption { (self.title) }
                    thead { tr { @for (column, name) in self.head.iter().enumerate() { th class=[class(column)] { (name) } } } }
                    tbody {
                        @for row in &self.rows {
                            tr {
                                @for (column, text) in row.iter().enumerate() {
                                    @if column == 0 { th { (text) } } @else { td class=[class(column)] { (text) } }
                                }
                            }
                        }
                    }
                }
            }
            @if let Some(note) = &self.note { p.note { (note) } }
        }
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = &self.rows[..self.rows.len().min(MAX_TERMINAL_ROWS)];
        let lines: Vec<&[String]> = std::iter::once(&self.head).chain(shown).map(Vec::as_slice).collect();
        write!(
            f,
            "{}\n{}",
            self.title,
            aligned(&lines, |column| self.holds_words(column))
        )?;
        if shown.len() < self.rows.len() {
            write!(f, "\n  … {} more", count(self.rows.len() - shown.len(), "row"))?;
        }
        match &self.note {
            Some(note) => write!(f, "\n  {note}"),
            None => Ok(()),
        }
    }
}

/// Lines with their fields in columns: words to the left, numbers to the right.
pub(super) fn aligned(lines: &[&[String]], holds_words: impl Fn(usize) -> bool) -> String {
    let columns = lines.iter().map(|line| line.len()).max().unwrap_or(0);
    let width = |column: usize| {
        let fields = lines.iter().filter_map(|line| line.get(column));
        fields.map(|field| field.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |fields: &&[String]| {
        let fields = fields.iter().zip(&widths).enumerate();
        let aligned = fields.map(|(column, (field, width))| match holds_words(column) {
            true => format!("  {field:<width$}"),
            false => format!("  {field:>width$}"),
        });
        aligned.collect::<String>().trim_end().to_owned()
    };
    lines.iter().map(line).collect::<Vec<_>>().join("\n")
}

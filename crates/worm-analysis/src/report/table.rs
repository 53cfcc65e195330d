//! Tables of a page.

use super::page::escaped;
use std::fmt::Write;

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
            ..Self::default()
        }
    }

    /// The table as HTML.
    pub fn html(&self) -> String {
        let mut html = format!(
            "<div class=\"table\"><table><caption>{}</caption><thead><tr>",
            escaped(&self.title)
        );
        self.push_row(&mut html, &self.head, "th");
        html.push_str("</tr></thead><tbody>\n");
        for row in &self.rows {
            html.push_str("<tr>");
            self.push_row(&mut html, row, "td");
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody></table></div>\n");
        if let Some(note) = &self.note {
            let _ = writeln!(html, "<p class=\"note\">{}</p>", escaped(note)); // A String takes all.
        }
        html
    }

    fn push_row(&self, html: &mut String, row: &[String], tag: &str) {
        for (column, text) in row.iter().enumerate() {
            let tag = if column == 0 { "th" } else { tag };
            let class = if column > 0 && column < self.word_columns {
                " class=\"words\""
            } else {
                ""
            };
            let _ = write!(html, "<{tag}{class}>{}</{tag}>", escaped(text)); // A String takes all.
        }
    }
}

//! What `wormd explain` shows: which effect the model misses, how sure that is, and what to do next.
//!
//! Someone who runs a worm reads it from the top: the answer in a sentence, then where the gap is, why this effect and no
//! other, how the model follows the data before and after, what was changed in it, and which experiment comes next. A part
//! that the search did not give says why it is missing.
//!
//! - [`view`]: the answer as headings, sentences and tables: all wording, and no drawing.
//! - `figure`: the figures of the page.
//! - [`page`] and [`text`]: the view as a page, and for the terminal.

mod figure;
pub mod view;

use super::page::Page;
use super::plot::DrawError;
use super::{ReportError, file};
use crate::explain::Answer;
use maud::html;
use std::path::{Path, PathBuf};
use view::{Block, View};

/// The page on an answer, as the text of one self-contained HTML file.
///
/// # Errors
/// [`DrawError`] where a figure could not be drawn.
pub fn page(answer: &Answer, title: &str) -> Result<String, DrawError> {
    let view = View::of(answer);
    let mut page = Page::new(title, &view.lead).with_style(include_str!("style.css"));
    page.add(html! {
        section class={ "verdict " (view.class) } {
            p.badge { (view.badge) }
            p.headline { (view.headline) }
            p { (view.sentence) }
        }
    });
    page.tiles(&view.rows);
    page.paragraph_of("note", &view.note);
    for section in &view.sections {
        page.heading(section.heading);
        for block in &section.blocks {
            match block {
                Block::Paragraph(text) => page.paragraph(text),
                Block::Table(table) | Block::LongTable(table) => page.add(table),
                Block::Figure(kind) => {
                    if let Some(drawn) = figure::draw(*kind, answer)? {
                        page.figure(&drawn);
                    }
                }
                Block::Difference(lines) => page.add(html! {
                    pre.diff {
                        @for line in lines {
                            @match line.kind {
                                view::LineKind::Heading => s { (line.text) },
                                view::LineKind::Added => ins { (line.text) },
                                view::LineKind::Removed => del { (line.text) },
                                view::LineKind::Kept => span { (line.text) },
                            }
                        }
                    }
                }),
            }
        }
    }
    page.warnings(&answer.warnings);
    Ok(page.finish())
}

/// The same for the terminal, without figures and long tables. Warnings are left to the caller, who logs them.
pub fn text(answer: &Answer) -> String {
    let view = View::of(answer);
    let mut parts = vec![format!("{}. {}", view.badge, view.headline), view.sentence, view.lead];
    parts.extend(view.rows.iter().map(|row| row.to_string()));
    parts.push(view.note);
    for section in view.sections {
        let blocks = section.blocks.into_iter().filter_map(|block| match block {
            Block::Paragraph(text) => Some(text),
            Block::Table(table) => Some(table.to_string()),
            Block::Difference(lines) => {
                let lines = lines
                    .iter()
                    .map(|line| format!("  {}", line.text).trim_end().to_owned());
                Some(lines.collect::<Vec<_>>().join("\n"))
            }
            Block::LongTable(_) | Block::Figure(_) => None,
        });
        let blocks: Vec<String> = blocks.collect();
        if !blocks.is_empty() {
            let underline = "─".repeat(section.heading.chars().count());
            parts.push(format!("{}\n{underline}", section.heading));
            parts.extend(blocks);
        }
    }
    parts.retain(|part| !part.is_empty());
    parts.join("\n\n")
}

/// Writes the page as `report.html` into a directory, which is made if need be. An earlier page is replaced at once; other
/// files are left alone. Returns where the page is.
///
/// # Errors
/// [`ReportError::Drawing`] before anything is written; [`ReportError::File`].
pub fn write(answer: &Answer, title: &str, dir: &Path) -> Result<PathBuf, ReportError> {
    let page = page(answer, title)?;
    file::make_directory(dir)?;
    file::replace(dir.join("report.html"), page.as_bytes())
}

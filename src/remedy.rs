//! What alarms and faults mean, and what to do about them, from the page that describes them: the words are there, and nowhere else.

use worm_estimator::message::{AlarmKind, Fault};

const PAGE: &str = include_str!("../docs/alarms.md");

/// The lines of an alarm's section.
fn section(kind: AlarmKind) -> impl Iterator<Item = &'static str> {
    PAGE.lines()
        .skip_while(move |line| line.strip_prefix("## ") != Some(kind.name()))
        .skip(1)
        .take_while(|line| !line.starts_with("## "))
}

/// What an alarm of this kind says, as plain text.
pub(crate) fn meaning(kind: AlarmKind) -> String {
    let said = section(kind).find_map(|line| line.strip_prefix("**")?.split_once("**"));
    without_markup(said.map_or("", |(said, _)| said).trim_end_matches([',', '.']))
}

/// What a fault means, and what to do about it: the row of the table of faults.
pub(crate) fn of_fault(fault: Fault) -> Option<(String, String)> {
    let name = format!("| `{}` |", fault.name());
    let rows = PAGE
        .lines()
        .skip_while(|line| !line.starts_with("## Faults of the controller"));
    let row = rows.skip(1).find_map(|line| line.strip_prefix(name.as_str()))?;
    let mut cells = row.split('|').map(str::trim);
    let (meaning, _, remedy) = (cells.next()?, cells.next()?, cells.next()?);
    Some((without_markup(meaning), without_markup(remedy)))
}

/// What to do about an alarm of this kind, as plain text on one line.
pub(crate) fn of(kind: AlarmKind) -> String {
    let mut lines = section(kind).skip_while(|line| !line.starts_with("- Do: "));
    let mut text = lines.next().unwrap_or_default().trim_start_matches("- Do: ").to_owned();
    // The lines that belong to it are indented.
    for line in lines.take_while(|line| line.starts_with("  ")) {
        text.push(' ');
        text.push_str(line.trim());
    }
    without_markup(&text)
}

/// Markdown without code marks, and with links as their text.
fn without_markup(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, link)) = rest.split_once('[') {
        plain.push_str(before);
        let Some((label, target)) = link.split_once("](") else {
            plain.push('[');
            rest = link;
            continue;
        };
        plain.push_str(label);
        rest = target.split_once(')').map_or("", |(_, after)| after);
    }
    plain.push_str(rest);
    plain.replace('`', "")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How an instruction begins.
    const IMPERATIVES: &[&str] = &[
        "charge", "check", "find", "keep", "let", "look", "release", "remove", "see", "start",
    ];

    /// The headings of all pages: nobody at a terminal can follow one.
    fn headings() -> Vec<String> {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/docs");
        let pages = std::fs::read_dir(folder).expect("the docs").flatten();
        let texts = pages.filter_map(|page| std::fs::read_to_string(page.path()).ok());
        let of_page = |text: String| {
            let headings = text.lines().filter_map(|line| line.strip_prefix('#'));
            let plain = headings.map(|line| without_markup(line.trim_start_matches('#').trim()));
            plain.collect::<Vec<_>>()
        };
        // Names of alarms and single words are no references.
        let mut headings: Vec<_> = texts.flat_map(of_page).collect();
        headings.retain(|heading| heading.split(' ').count() > 2);
        headings
    }

    #[test]
    fn the_page_says_of_every_alarm_and_fault_what_to_do() {
        let headings = headings();
        assert!(headings.iter().any(|heading| heading == "When the computer pauses"));
        let is_followed = |remedy: &str| !headings.iter().any(|heading| remedy.contains(heading.as_str()));
        for &kind in AlarmKind::ALL {
            let text = of(kind);
            println!("{kind}: {text}");
            assert!(text.len() > 20 && text.ends_with('.'), "{kind}: {text:?}");
            assert!(!text.contains(['`', '[', ']', '\n']), "{kind}: {text:?}");
            assert!(is_followed(&text), "{kind}: {text:?}");
            let meaning = meaning(kind);
            assert!(
                meaning.len() > 15 && !meaning.contains(['`', '*']),
                "{kind}: {meaning:?}"
            );
        }
        for &fault in Fault::ALL {
            let (meaning, remedy) = of_fault(fault).expect("a row of the table");
            if fault == Fault::None {
                continue;
            }
            assert!(meaning.len() > 15, "{fault}: {meaning:?}");
            let first = remedy.split([' ', ';', ',']).next().unwrap_or_default();
            assert!(
                IMPERATIVES.contains(&first) && is_followed(&remedy),
                "{fault}: {remedy:?}"
            );
        }
        assert!(of(AlarmKind::MotorStall).contains("wormd command reset"));
        assert!(of(AlarmKind::ModelMismatch).starts_with("wormd explain --live"));
    }
}

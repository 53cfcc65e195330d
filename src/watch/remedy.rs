//! What to do about an alarm, from the page that describes it: the words are there, and nowhere else.

use worm_estimator::message::AlarmKind;

const PAGE: &str = include_str!("../../docs/alarms.md");

/// What to do about an alarm of this kind, as plain text on one line.
pub(crate) fn of(kind: AlarmKind) -> String {
    let mut lines = PAGE
        .lines()
        .skip_while(|line| line.strip_prefix("## ") != Some(kind.name()))
        .skip(1)
        .take_while(|line| !line.starts_with("## "))
        .skip_while(|line| !line.starts_with("- Do: "));
    let mut text = lines.next().unwrap_or_default().trim_start_matches("- Do: ").to_owned();
    // The lines that belong to it are indented.
    for line in lines.take_while(|line| line.starts_with("  ")) {
        text.push(' ');
        text.push_str(line.trim());
    }
    without_markup(&text)
}

/// What to do about a fault of the controller; nothing where the page has no word for it.
#[cfg(feature = "dashboard")]
pub(crate) fn of_fault(fault: worm_estimator::message::Fault) -> String {
    let head = format!("| `{}` |", fault.name());
    let row = PAGE
        .lines()
        .skip_while(|line| *line != "## Faults of the controller")
        .find(|line| line.starts_with(&head));
    // Name, meaning, watched while, do.
    let text = row.and_then(|row| row.trim_matches(['|', ' ']).split('|').nth(3));
    without_markup(text.unwrap_or_default().trim())
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

    #[test]
    fn the_page_says_of_every_alarm_what_to_do() {
        for &kind in AlarmKind::ALL {
            let text = of(kind);
            println!("{kind}: {text}");
            assert!(text.len() > 20 && text.ends_with(['.', '?']), "{kind}: {text:?}");
            assert!(!text.contains(['`', '[', ']', '\n']), "{kind}: {text:?}");
        }
        #[cfg(feature = "dashboard")]
        for &fault in worm_estimator::message::Fault::ALL {
            let is_none = fault == worm_estimator::message::Fault::None;
            assert_eq!(of_fault(fault).is_empty(), is_none, "{fault}: {:?}", of_fault(fault));
        }
        assert!(of(AlarmKind::MotorStall).contains("wormd command reset"));
        assert!(of(AlarmKind::ModelMismatch).ends_with("Which effect does the model miss?"));
    }
}

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
        assert!(of(AlarmKind::MotorStall).contains("wormd command reset"));
        assert!(of(AlarmKind::ModelMismatch).ends_with("Which effect does the model miss?"));
    }
}

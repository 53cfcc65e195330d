//! A driver that is gone: in the name by which the relay then makes the worm hold, so that every recording of the command says who and why.

use std::fmt;
use worm_estimator::message::{CommandKind, CommandRecord, ShortText};
use worm_estimator::time::seconds;

/// Longest name of a watcher, characters.
const MAX_NAME: usize = 64;

/// Begins the relay's own name.
const RELAY: &str = "relay: ";

/// How a driver has gone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Departure {
    /// The driver's name; in a recording as much of it as there is room for.
    pub(crate) name: String,
    /// How.
    pub(crate) way: Way,
}

/// See [`Departure`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Way {
    /// It closed its connection.
    Left,
    /// Nothing was heard of it for so long, in words, s.
    Silent(String),
}

impl Departure {
    /// A driver that closed its connection.
    pub(super) fn left(name: String) -> Self {
        let way = Way::Left;
        Self { name, way }
    }

    /// A driver of which nothing was heard for so long.
    pub(super) fn silent(name: String, silent_ns: u64) -> Self {
        let way = Way::Silent(format!("{:.1}", seconds(silent_ns)));
        Self { name, way }
    }

    /// The sender of the hold.
    pub(super) fn sender(&self) -> ShortText {
        let what = match &self.way {
            Way::Left => " left".to_owned(),
            Way::Silent(s) => format!(" silent {s} s"),
        };
        let room = ShortText::MAX_BYTES.saturating_sub(RELAY.len() + what.len());
        let name = name_within(&self.name, room);
        ShortText::new(&format!("{RELAY}{name}{what}"))
    }

    /// What a recorded hold says of the driver; none for another command.
    pub(crate) fn of(record: &CommandRecord) -> Option<Self> {
        if record.kind != CommandKind::Hold.code() {
            return None;
        }
        let text = record.sender.as_str().strip_prefix(RELAY)?;
        if let Some(name) = text.strip_suffix(" left") {
            return Some(Self::left(name.to_owned()));
        }
        let (name, s) = text.strip_suffix(" s")?.rsplit_once(" silent ")?;
        let (name, way) = (name.to_owned(), Way::Silent(s.to_owned()));
        Some(Self { name, way })
    }

    /// Whether the driver fell silent, which nobody wants.
    pub(crate) fn is_silence(&self) -> bool {
        matches!(self.way, Way::Silent(_))
    }
}

impl fmt::Display for Departure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = &self.name;
        match &self.way {
            Way::Left => write!(f, "{name}, who drove, has left"),
            Way::Silent(s) => write!(f, "nothing was heard for {s} s from {name}, who drove"),
        }
    }
}

/// A watcher's name, as far as logs and terminals of others may show it.
pub(super) fn printable(name: &str) -> String {
    name.chars().filter(|it| !it.is_control()).take(MAX_NAME).collect()
}

/// As much of a watcher's name as `room` bytes hold.
pub(super) fn name_within(name: &str, room: usize) -> String {
    // A page is called by its user and, after a comma, its browser.
    let name = match name.split_once(',') {
        Some((user, _)) if name.len() > room => user,
        _ => name,
    };
    // As many whole letters as there is room for.
    let fits = |(at, letter): &(usize, char)| at + letter.len_utf8() <= room;
    name.char_indices().take_while(fits).map(|(_, letter)| letter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use worm_estimator::message::{Command, Reply};

    fn recorded(sender: ShortText) -> CommandRecord {
        let command = Command {
            sender,
            ..Command::new(CommandKind::Hold)
        };
        let reply = Reply {
            sequence: 1,
            verdict: 0,
            mode: 0,
            fault: 0,
            alarm_mask: 0,
        };
        CommandRecord::new(0, (1, 0.0), false, &command, &reply)
    }

    #[test]
    fn the_record_says_who_and_how_as_far_as_there_is_room() {
        let silent = |name: &str| Departure::silent(name.to_owned(), 800_000_000);
        for (departure, name) in [
            (silent("Zoe"), "Zoe"),
            (silent("Zoe, Chrome on Windows"), "Zoe"),
            (silent("Ångström-Ångström"), "Ångström-"),
            (silent("a silent 3 s b"), "a silent 3 s"),
            (Departure::left("Zoe".to_owned()), "Zoe"),
        ] {
            let found = Departure::of(&recorded(departure.sender())).expect("is one");
            assert_eq!((found.name.trim_end(), found.way), (name, departure.way));
        }
        for sender in ["", "Zoe", "relay", "relay: Zoe", "Zoe silent 0.8 s"] {
            assert_eq!(Departure::of(&recorded(ShortText::new(sender))), None, "{sender}");
        }
    }
}

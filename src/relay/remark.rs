//! What never comes as far as the controller and every recording is to say all the same: who took over, who was refused because another
//! drives, because it was too late or because too many were before it, and whom a bridge has refused.

use super::departure::{name_within, printable};
use super::drive::WatcherId;
use super::wire::NetworkRefusal;
use std::time::{Duration, Instant};
use worm_estimator::message::{Command, CommandKind, CommandRecord, ShortText};

/// How long the same refusal of the same watcher is not recorded again: a program that asks on and on must not fill the records.
const SAME: Duration = Duration::from_secs(1);

/// The record of a take-over.
pub(super) fn take_over(name: &str, user: u32) -> Command {
    Command {
        user,
        sender: ShortText::new(&name_within(name, ShortText::MAX_BYTES)),
        ..Command::new(CommandKind::TakeOver)
    }
}

/// What a bridge has refused: the record, and the same in words.
pub(super) fn by_bridge(verdict: NetworkRefusal, name: &str, user: u32, command: &str) -> (Command, String) {
    let (name, command) = (printable(name), printable(command));
    let record = refused(verdict.kind(), &name, user, &command);
    (record, refused_by_bridge(verdict, &name, &command))
}

fn refused_by_bridge(verdict: NetworkRefusal, name: &str, command: &str) -> String {
    let why = match verdict {
        NetworkRefusal::NotPermitted => "the certificate may watch and hold, and nothing else",
        NetworkRefusal::Stale => "it came too late over the network",
        NetworkRefusal::Busy => "too many watchers of its laptop command already",
    };
    format!("{command} from {name} was refused by the bridge: {why}")
}

/// The record of a command that was refused, for the reason that the kind is.
fn refused(kind: CommandKind, name: &str, user: u32, command: &str) -> Command {
    let what = format!(": {command}");
    let name = name_within(name, ShortText::MAX_BYTES.saturating_sub(what.len()));
    Command {
        user,
        sender: ShortText::new(&format!("{name}{what}")),
        ..Command::new(kind)
    }
}

/// A recorded take-over or refusal in words; none for another command.
pub(crate) fn in_words(record: &CommandRecord) -> Option<String> {
    let (sender, user) = (record.sender, record.user);
    let (name, command) = sender
        .as_str()
        .rsplit_once(": ")
        .unwrap_or((sender.as_str(), "a command"));
    match CommandKind::try_from(record.kind) {
        Ok(CommandKind::TakeOver) => Some(format!("{sender} (user {user}) took over, and drives")),
        Ok(CommandKind::NotDriver) => Some(format!(
            "{command} from {name} (user {user}) was refused: another watcher drives"
        )),
        Ok(CommandKind::NotPermitted) => Some(refused_by_bridge(NetworkRefusal::NotPermitted, name, command)),
        // By the bridge or by the relay.
        Ok(CommandKind::Stale) => Some(format!(
            "{command} from {name} (user {user}) was refused: it came too late"
        )),
        Ok(CommandKind::Busy) => Some(format!(
            "{command} from {name} (user {user}) was refused: too many commands or watchers were before it"
        )),
        _ => None,
    }
}

/// The refusals that are recorded: not each of a watcher that asks on and on.
#[derive(Debug, Default)]
pub(super) struct Refusals(Option<(WatcherId, CommandKind, String, Instant)>);

impl Refusals {
    /// The record of a command that was refused, for the reason that the kind is, where there is to be one.
    pub(super) fn record(
        &mut self,
        kind: CommandKind,
        id: WatcherId,
        (name, user): (&str, u32),
        command: &str,
        now: Instant,
    ) -> Option<Command> {
        let is_same = |(watcher, why, what, since): &(WatcherId, CommandKind, String, Instant)| {
            (*watcher, *why, what.as_str()) == (id, kind, command) && now.saturating_duration_since(*since) < SAME
        };
        if self.0.as_ref().is_some_and(is_same) {
            return None;
        }
        self.0 = Some((id, kind, command.to_owned(), now));
        Some(refused(kind, name, user, command))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use worm_estimator::message::Reply;

    fn recorded(command: &Command) -> Option<String> {
        let reply = Reply {
            sequence: 1,
            verdict: 0,
            mode: 0,
            fault: 0,
            alarm_mask: 0,
        };
        in_words(&CommandRecord::new(0, (1, 0.0), false, command, &reply))
    }

    #[test]
    fn the_record_names_who_took_over_and_who_was_refused_what() {
        use CommandKind::{NotDriver, Stale};
        let mut refusals = Refusals::default();
        let now = Instant::now();
        let long = "Ångström-Ångström-Ångström, Chrome on Windows";
        let refused = refusals
            .record(NotDriver, 2, (long, 7), "take_over", now)
            .expect("is the first");
        let words = "take_over from Ångström-Ångström (user 7) was refused: another watcher drives";
        assert_eq!(recorded(&refused).as_deref(), Some(words));
        let taken = take_over("ben", 1000);
        assert_eq!(
            recorded(&taken).as_deref(),
            Some("ben (user 1000) took over, and drives")
        );
        let words = "crawl from hall at the\u{fffd} was refused by the bridge: the certificate may watch";
        let (record, said) = by_bridge(NetworkRefusal::NotPermitted, "hall at the\u{fffd}\n", 0, "crawl");
        assert!(said.contains(words), "{said}");
        assert_eq!(recorded(&record), Some(said));
        // The relay may have refused it as well.
        let (record, said) = by_bridge(NetworkRefusal::Stale, "hall at the\u{fffd}\n", 0, "crawl");
        assert!(said.contains("was refused by the bridge: it came too late"), "{said}");
        let words = "crawl from hall at the\u{fffd} (user 0) was refused: it came too late";
        assert_eq!(recorded(&record).as_deref(), Some(words));
        let (record, said) = by_bridge(NetworkRefusal::Busy, "hall", 0, "crawl");
        assert!(said.contains("refused by the bridge: too many watchers"), "{said}");
        let words = "crawl from hall (user 0) was refused: too many commands or watchers were before it";
        assert_eq!(recorded(&record).as_deref(), Some(words));
        assert_eq!(recorded(&Command::new(CommandKind::Hold)), None);
        // Who asks on and on stands there once a second, and not at the cost of others.
        let later = |ms| now + Duration::from_millis(ms);
        assert!(
            refusals
                .record(NotDriver, 2, (long, 7), "take_over", later(999))
                .is_none()
        );
        assert!(refusals.record(NotDriver, 2, (long, 7), "crawl", later(999)).is_some());
        assert!(refusals.record(NotDriver, 3, ("ann", 7), "crawl", later(999)).is_some());
        assert!(
            refusals
                .record(NotDriver, 3, ("ann", 7), "crawl", later(1_999))
                .is_some()
        );
        assert!(refusals.record(Stale, 3, ("ann", 7), "crawl", later(1_999)).is_some());
    }
}

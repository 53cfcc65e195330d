//! What happened, for people: among the events of all watchers, on standard error, and in the computer's log.

use super::remark;
use super::source::Worm;
use super::wire::Answer;
use crate::realtime::monotonic_ns;
use crate::supervisor::controller;
use crate::{print, syslog};
use worm_estimator::message::CommandRecord;

/// Puts what happens into words, each thing once.
pub(super) struct EventLog {
    /// The worm's name.
    worm: String,
    /// When this relay began, ns of `CLOCK_MONOTONIC`.
    begun_ns: u64,
    /// Recorded commands that are among the events.
    commands_noted: u64,
}

impl EventLog {
    /// That of a relay that begins now.
    pub(super) fn new(worm: &str) -> Self {
        Self {
            worm: worm.to_owned(),
            begun_ns: monotonic_ns(),
            commands_noted: 0,
        }
    }

    /// Records something.
    pub(super) fn note(&self, worm: &mut Worm, text: String) {
        self.log(&text);
        worm.note(monotonic_ns(), text);
    }

    /// Records what a watcher commanded and the controller did not get, and why.
    pub(super) fn note_answer(&self, worm: &mut Worm, who: &str, answer: &Answer) {
        let Answer { command, verdict, .. } = answer;
        let text = match &answer.refusal {
            Some(refusal) if refusal.starts_with(command.as_str()) => format!("{who}: {refusal}"),
            Some(refusal) => format!("{who}: {command} refused: {refusal}"),
            None => format!("{who}: {command} {verdict}"),
        };
        self.note(worm, text);
    }

    /// Records what the controller was told since the last call. What it was told before this relay began is shown, and not logged again.
    pub(super) fn note_commands(&mut self, worm: &mut Worm) {
        let records = &worm.telemetry.commands;
        let new: Vec<_> = records.since(self.commands_noted).copied().collect();
        self.commands_noted = records.total();
        for record in new {
            // It was noted when this relay decided it.
            if remark::in_words(&record).is_some() && record.time_ns >= self.begun_ns {
                continue;
            }
            let text = command_text(&record);
            if record.time_ns >= self.begun_ns {
                self.log(&text);
            }
            worm.note(record.time_ns, text);
        }
    }

    /// Writes a line to standard error, which may have no reader any more, and to the computer's log.
    fn log(&self, text: &str) {
        print::log_line(text);
        syslog::write("wormd-relay", &self.worm, text);
    }
}

/// A command in words: who gave it, and what the controller made of it.
fn command_text(record: &CommandRecord) -> String {
    if let Some(text) = remark::in_words(record) {
        return text;
    }
    let who = match record.sender.as_str() {
        "" => format!("user {}", record.user),
        name => format!("{name} (user {})", record.user),
    };
    match controller::Answer::recorded(record) {
        None => format!(
            "{who}: command {} (code {}), which is not known here",
            record.kind, record.outcome
        ),
        Some(answer) => match answer.refusal() {
            Some(refusal) => format!("{who}: {refusal}"),
            None => format!("{who}: {} accepted", answer.kind()),
        },
    }
}

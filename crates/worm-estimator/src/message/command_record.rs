//! The `command` topic: what the controller was told, by whom, and what it made of it.

use super::command::{Command, CommandKind, CommandOutcome, Reply};
use super::json::Name;
use super::short_text::ShortText;
use super::state::{Fault, Mode};
use super::{ZeroCopySend, message};

message! {
    /// One command that the controller took or refused, and its answer.
    CommandRecord = "wormd_command_record_v2", made: time_ns, cells: |_| 0, {
        /// Number of this command since the controller started.
        sequence: u64,
        /// When the tick that processed it had its readings, ns of `CLOCK_MONOTONIC`.
        time_ns: u64,
        /// The tick that processed it, as in the topic `state`.
        state_sequence: u64,
        /// Commanded gait cycles per second, negative for backward; 0 means the configured gait.
        cycles_per_s: f64,
        /// How long the worm was to crawl at most, s; 0 leaves it to the controller.
        limit_s: f64,
        /// The kind of command: [`CommandKind`] as a code.
        kind: u32 as Name<CommandKind>,
        /// What became of it: [`CommandOutcome`] as a code.
        outcome: u32 as Name<CommandOutcome>,
        /// Bit k set: the command concerned the alarm with code k.
        alarm_mask: u32,
        /// Bit k set: the alarm with code k stood in its way, or was acknowledged by it.
        answer_alarm_mask: u32,
        /// The mode after it: [`Mode`] as a code.
        mode: u32 as Name<Mode>,
        /// The fault after it: [`Fault`] as a code.
        fault: u32 as Name<Fault>,
        /// 1 while whoever started the controller watched over the worm: a crawl without a time of its own then lasts as long as that.
        supervised: u32,
        /// User ID of the sender, as the sender gave it.
        user: u32,
        /// Who sent it, as the sender says: a program, or the watcher whose command it passed on.
        sender: ShortText,
        // Since version 2, at the end: so the numbers of the others stay, and logs of version 1 can be read.
        /// Gait phase of the tick that processed it, cycles.
        phase: f64,
        /// For a mark, where the mean of the cells was said to be along the canal, m; `NaN` for other commands.
        position_m: f64,
        /// For a mark, the standard error of that, m; `NaN` for other commands.
        position_sigma_m: f64,
    }
}

impl CommandRecord {
    /// The record of a command, with the number `sequence`, that the tick at `time_ns` and `phase` answered; `supervised` says whether the lease was held.
    pub fn new(
        sequence: u64,
        (time_ns, phase): (u64, f64),
        supervised: bool,
        command: &Command,
        reply: &Reply,
    ) -> Self {
        let is_mark = command.kind == CommandKind::Mark.code();
        let (position_m, position_sigma_m) = command.mark().filter(|_| is_mark).unwrap_or((f64::NAN, f64::NAN));
        Self {
            sequence,
            time_ns,
            state_sequence: reply.sequence,
            cycles_per_s: command.cycles_per_s,
            limit_s: command.limit_s,
            kind: command.kind,
            outcome: reply.verdict,
            alarm_mask: command.alarm_mask,
            answer_alarm_mask: reply.alarm_mask,
            mode: reply.mode,
            fault: reply.fault,
            supervised: supervised.into(),
            user: command.user,
            // The memory is the sender's, which may have left anything in it.
            sender: ShortText::new(command.sender.as_str()),
            phase,
            position_m,
            position_sigma_m,
        }
    }

    /// Whether it only prolonged a crawl: four times a second while somebody attends to it.
    pub fn is_mere_renewal(&self) -> bool {
        self.kind == CommandKind::Renew.code() && self.outcome == CommandOutcome::Accepted.code()
    }
}

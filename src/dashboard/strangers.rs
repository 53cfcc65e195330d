//! Who asked for what needs the token, and did not have it: in the computer's log, and on standard error.

use super::caller::Caller;
use crate::syslog;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A line is written this often at most: whoever tries tokens must not fill the log.
const PAUSE: Duration = Duration::from_secs(1);
/// Longest name of a command in it, characters: longer ones are none.
const MAX_WHAT: usize = 20;

/// What was refused for want of the token.
#[derive(Debug)]
pub(super) struct Strangers {
    worm: String,
    told: Mutex<Told>,
}

#[derive(Debug, Default)]
struct Told {
    last: Option<Instant>,
    /// Refusals since then that no line tells of.
    untold: u64,
}

impl Told {
    /// The line about a refusal; none where one was written a moment ago.
    fn line(&mut self, who: &str, what: &str, why: &str, now: Instant) -> Option<String> {
        if self
            .last
            .is_some_and(|last| now.saturating_duration_since(last) < PAUSE)
        {
            self.untold += 1;
            return None;
        }
        self.last = Some(now);
        let more = match std::mem::take(&mut self.untold) {
            0 => String::new(),
            untold => format!(" (and {untold} more such requests before it)"),
        };
        Some(format!("{who}: {what} refused: {why}{more}"))
    }
}

impl Strangers {
    /// Of the dashboard of this worm.
    pub(super) fn new(worm: &str) -> Self {
        Self {
            worm: worm.to_owned(),
            told: Mutex::default(),
        }
    }

    /// Tells of a refusal.
    pub(super) fn note(&self, caller: &Caller, what: &str, why: &str) {
        // Of a path that anybody may write.
        let what: String = what.chars().filter(|it| !it.is_control()).take(MAX_WHAT).collect();
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(line) = told.line(&caller.name, &what, why, Instant::now()) {
            tracing::warn!("{line}");
            syslog::write("wormd-dashboard", &self.worm, &line);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_tries_on_and_on_is_counted_and_does_not_fill_the_log() {
        let (mut told, now) = (Told::default(), Instant::now());
        let mut at = |ms| {
            told.line(
                "ben, curl",
                "stop",
                "the token is wrong",
                now + Duration::from_millis(ms),
            )
        };
        assert_eq!(at(0).as_deref(), Some("ben, curl: stop refused: the token is wrong"));
        assert_eq!((at(1), at(999)), (None, None));
        let later = at(1_000).expect("a second later");
        assert!(later.ends_with("(and 2 more such requests before it)"), "{later}");
    }
}

//! Requests that are read long after they were asked for, when whoever asked is perhaps not there any more, or after a hold that was
//! asked for later.
//!
//! Pure: times are arguments, ns of one clock.

use super::wire::Request;
use crate::trip::wire::Ask;
use worm_estimator::time::seconds;

/// A request that was asked for longer ago, or is to be asked for later than this, is not carried out, ns.
const LIMIT_NS: u64 = 1_000_000_000;

/// Why a request is not carried out at this time; none where it is. `sent_ns` is when it was asked for.
pub(crate) fn refusal(request: &Request, sent_ns: u64, now_ns: u64) -> Option<String> {
    let (late_ns, early_ns) = (now_ns.saturating_sub(sent_ns), sent_ns.saturating_sub(now_ns));
    if is_always_taken(request) || late_ns.max(early_ns) <= LIMIT_NS {
        return None;
    }
    Some(match early_ns {
        0 => format!(
            "asked for {:.0} s ago, when nobody answered: ask again",
            seconds(late_ns)
        ),
        _ => format!(
            "its sent_ns is {:.0} s in the future: give CLOCK_MONOTONIC of this computer",
            seconds(early_ns)
        ),
    })
}

/// Whether it halts the worm or moves nothing, so that it is done however late.
pub(crate) fn is_always_taken(request: &Request) -> bool {
    match request {
        Request::Hello { .. }
        | Request::Alive
        | Request::Hold
        | Request::Acknowledge { .. }
        | Request::Mark { .. }
        | Request::NoteRefusal { .. }
        | Request::Trip {
            action: Ask::Alive | Ask::Status | Ask::Pause,
        } => true,
        Request::Drive
        | Request::TakeOver
        | Request::Arm
        | Request::Crawl { .. }
        | Request::Stop
        | Request::Reset
        | Request::Trip { .. } => false,
    }
}

/// The last word of all who ask: a hold voids what was asked for before it, however the two arrive. They come over different connections,
/// and one that was held up brings the crawl after the hold.
#[derive(Debug, Default)]
pub(crate) struct LastHold {
    asked_ns: Option<u64>,
}

impl LastHold {
    /// Why a request is not carried out at this time, because of its age or of a hold after it; none where it is.
    pub(crate) fn refusal(&mut self, request: &Request, sent_ns: u64, now_ns: u64) -> Option<String> {
        if let Some(refusal) = refusal(request, sent_ns, now_ns) {
            return Some(refusal);
        }
        if matches!(request, Request::Hold | Request::Trip { action: Ask::Pause }) {
            self.asked_ns = self.asked_ns.max(Some(sent_ns.min(now_ns)));
        }
        let is_void = !is_always_taken(request) && Some(sent_ns) < self.asked_ns;
        is_void.then(|| "a hold was asked for after it: ask again, if that is still wanted".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_late_is_refused_in_words_unless_it_halts_or_moves_nothing() {
        let now_ns = 100_000_000_000;
        let crawl = || Request::Crawl { cycles_per_s: None };
        let trip = |action| Request::Trip { action };
        for request in [
            crawl(),
            Request::Drive,
            Request::TakeOver,
            Request::Arm,
            Request::Stop,
            Request::Reset,
            trip(Ask::Resume),
            trip(Ask::Return),
        ] {
            assert_eq!(refusal(&request, now_ns - LIMIT_NS, now_ns), None, "{request:?}");
            assert_eq!(refusal(&request, now_ns + LIMIT_NS, now_ns), None, "{request:?}");
            let late = refusal(&request, now_ns - 13 * LIMIT_NS, now_ns);
            let expected = "asked for 13 s ago, when nobody answered: ask again";
            assert_eq!(late.as_deref(), Some(expected), "{request:?}");
            let early = refusal(&request, now_ns + 13 * LIMIT_NS, now_ns);
            assert!(
                early.is_some_and(|why| why.contains("13 s in the future")),
                "{request:?}"
            );
        }
        for request in [
            Request::Hold,
            Request::Alive,
            Request::Acknowledge { alarms: Vec::new() },
            trip(Ask::Pause),
            trip(Ask::Status),
        ] {
            assert_eq!(refusal(&request, 0, now_ns), None, "{request:?}");
        }
    }

    #[test]
    fn a_hold_voids_what_was_asked_for_before_it() {
        let crawl = || Request::Crawl { cycles_per_s: None };
        let pause = || Request::Trip { action: Ask::Pause };
        let resume = || Request::Trip { action: Ask::Resume };
        let now_ns = 100_000_000_000;
        let mut last = LastHold::default();
        // Milliseconds before now at which each was asked for, in the order of arrival.
        for (request, before_ms, is_done) in [
            (crawl(), 900, true),
            (Request::Hold, 500, true),
            (crawl(), 501, false),
            (Request::Arm, 800, false),
            (Request::Acknowledge { alarms: Vec::new() }, 800, true),
            (crawl(), 500, true),
            // An older hold takes nothing back.
            (Request::Hold, 700, true),
            (crawl(), 499, true),
            (resume(), 300, true),
            (pause(), 200, true),
            (resume(), 300, false),
            (resume(), 100, true),
        ] {
            let refusal = last.refusal(&request, now_ns - before_ms * 1_000_000, now_ns);
            assert_eq!(
                refusal.is_none(),
                is_done,
                "{request:?} {before_ms} ms ago: {refusal:?}"
            );
        }
        // One that claims to be of the future forbids nothing for longer than until now.
        assert_eq!(last.refusal(&Request::Hold, now_ns + LIMIT_NS, now_ns), None);
        assert_eq!(last.refusal(&crawl(), now_ns, now_ns), None);
    }
}

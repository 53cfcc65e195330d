//! Requests that are read long after they were asked for: whoever asked is perhaps not there any more.
//!
//! Pure: times are arguments, ns of one clock.

use super::wire::Request;
use crate::trip::wire::Ask;
use worm_estimator::time::seconds;

/// A request that was asked for longer ago, or is to be asked for later than this, is not carried out, ns.
const LIMIT_NS: u64 = 1_000_000_000;

/// Why a request is not carried out at this time; none where it is. `sent_ns` is when it was asked for.
///
/// What halts the worm, and what moves nothing, is done however late.
pub(crate) fn refusal(request: &Request, sent_ns: u64, now_ns: u64) -> Option<String> {
    let is_always_taken = match request {
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
    };
    let (late_ns, early_ns) = (now_ns.saturating_sub(sent_ns), sent_ns.saturating_sub(now_ns));
    if is_always_taken || late_ns.max(early_ns) <= LIMIT_NS {
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
}

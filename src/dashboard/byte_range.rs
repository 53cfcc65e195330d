//! Which bytes of a file a request asks for (RFC 9110, section 14). Pure.

use std::ops::Range;

/// What to send.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Wanted {
    /// All of it.
    Whole,
    /// These bytes.
    Part(Range<u64>),
    /// Bytes that it does not have.
    Beyond,
}

/// What a header `Range` asks for, of a file of so many bytes. One that is not understood, or asks for several parts, counts as none, as the
/// standard permits.
pub(super) fn wanted(range: Option<&str>, length: u64) -> Wanted {
    let Some((first, last)) = range
        .and_then(|range| range.trim().strip_prefix("bytes="))
        .and_then(|range| range.trim().split_once('-'))
    else {
        return Wanted::Whole;
    };
    let number = |text: &str| {
        text.bytes()
            .all(|byte| byte.is_ascii_digit())
            .then(|| text.parse::<u64>().ok())
    };
    match (number(first), number(last)) {
        (Some(Some(first)), Some(last)) if !first_is_after(first, last) => {
            let end = last.map_or(length, |last| last.saturating_add(1).min(length));
            if first < length {
                Wanted::Part(first..end)
            } else {
                Wanted::Beyond
            }
        }
        // The last so many bytes.
        (Some(None), Some(Some(count))) => match count.min(length) {
            0 => Wanted::Beyond,
            count => Wanted::Part(length - count..length),
        },
        _ => Wanted::Whole,
    }
}

fn first_is_after(first: u64, last: Option<u64>) -> bool {
    last.is_some_and(|last| first > last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_what_the_standard_says() {
        for (range, expected) in [
            (None, Wanted::Whole),
            (Some("bytes=0-"), Wanted::Part(0..100)),
            (Some("bytes=40-"), Wanted::Part(40..100)),
            (Some("bytes=40-49"), Wanted::Part(40..50)),
            (Some("bytes=40-40"), Wanted::Part(40..41)),
            (Some("bytes=40-400"), Wanted::Part(40..100)),
            (Some("bytes=-10"), Wanted::Part(90..100)),
            (Some("bytes=-1000"), Wanted::Part(0..100)),
            (Some("bytes=100-"), Wanted::Beyond),
            (Some("bytes=-0"), Wanted::Beyond),
            (Some("bytes=50-40"), Wanted::Whole),
            (Some("bytes=0-1,5-6"), Wanted::Whole),
            (Some("bytes=-"), Wanted::Whole),
            (Some("bytes=+4-"), Wanted::Whole),
            (Some("bytes=99999999999999999999-"), Wanted::Whole),
            (Some("lines=1-2"), Wanted::Whole),
            (Some("nonsense"), Wanted::Whole),
        ] {
            assert_eq!(wanted(range, 100), expected, "{range:?}");
        }
        assert_eq!(wanted(Some("bytes=0-"), 0), Wanted::Beyond);
    }
}

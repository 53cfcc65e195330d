//! Line ends of other systems, truncated files, progress.

use super::{REPORT_EVERY, Text};
use std::io::{Cursor, Read};

/// What comes out of a text that is read `at_once` bytes at a time, and whether its last line had no end.
fn passed(bytes: &[u8], at_once: usize) -> (Vec<u8>, bool) {
    let mut ignored = |_| {};
    let mut text = Text::new(Cursor::new(bytes), bytes.len() as u64, &mut ignored);
    let mut passed = Vec::new();
    let mut buffer = vec![0; at_once];
    loop {
        let count = text.read(&mut buffer).expect("memory can be read");
        if count == 0 {
            return (passed, text.is_unterminated());
        }
        passed.extend_from_slice(&buffer[..count]);
    }
}

#[test]
fn lines_end_as_on_unix_however_they_are_read() {
    let table: &[(&str, &str, bool)] = &[
        ("", "", false),
        ("a\nb\n", "a\nb\n", false),
        ("a\r\nb\r\n", "a\nb\n", false),
        ("a\nb", "a\nb\n", true),
        ("a\r\nb\r", "a\nb\n", true),
        ("\r\r\r", "", false),
        ("\n", "\n", false),
        ("1,\r\n\r\n2", "1,\n\n2\n", true),
    ];
    for &(text, expected, unterminated) in table {
        for at_once in [1, 2, 3, 100] {
            let (bytes, is_unterminated) = passed(text.as_bytes(), at_once);
            assert_eq!(String::from_utf8_lossy(&bytes), expected, "{text:?}, {at_once} at once");
            assert_eq!(is_unterminated, unterminated, "{text:?}, {at_once} at once");
        }
    }
}

#[test]
fn an_empty_buffer_is_no_end() {
    let mut ignored = |_| {};
    let mut text = Text::new(Cursor::new(b"a"), 1, &mut ignored);
    assert_eq!(text.read(&mut []).expect("memory can be read"), 0);
    let mut rest = String::new();
    text.read_to_string(&mut rest).expect("memory can be read");
    assert_eq!(rest, "a\n");
}

#[test]
fn progress_is_reported_now_and_then_and_never_beyond_one() {
    let bytes = vec![b'x'; 10 * REPORT_EVERY as usize];
    for (total, last) in [
        (bytes.len() as u64, 1.0),
        (2 * bytes.len() as u64, 0.5),
        (1, 1.0),
        (0, 1.0),
    ] {
        let mut fractions = Vec::new();
        let mut note = |fraction| fractions.push(fraction);
        let mut text = Text::new(Cursor::new(&bytes), total, &mut note);
        let mut buffer = [0; 1000];
        while text.read(&mut buffer).expect("memory can be read") > 0 {}
        assert!((5..=10).contains(&fractions.len()), "{} reports", fractions.len());
        assert!(
            fractions.is_sorted() && fractions.iter().all(|fraction| *fraction <= 1.0),
            "{fractions:?}"
        );
        let reached = fractions.last().copied().expect("a report");
        assert!((reached - last).abs() < 0.1, "{reached} of {total} bytes");
    }
}

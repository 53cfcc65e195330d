//! Sets of CPUs, as the kernel writes them and as people read them: `0-3,8`.

use std::fmt::Write;

/// CPUs that are on line, ascending (kernel doc cputopology).
pub(super) fn online() -> Vec<usize> {
    std::fs::read_to_string("/sys/devices/system/cpu/online").map_or_else(|_| Vec::new(), |text| parse(&text))
}

/// CPUs of a list by the kernel, ascending. What is no number is left out: an empty set is `(null)` on some kernels.
pub(super) fn parse(text: &str) -> Vec<usize> {
    let mut cpus = Vec::new();
    for part in text.trim().split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        if let (Ok(first), Ok(last)) = (first.parse::<usize>(), last.parse::<usize>()) {
            cpus.extend(first..=last);
        }
    }
    cpus
}

/// Ascending CPUs as a list by the kernel.
pub(super) fn list(cpus: &[usize]) -> String {
    let mut text = String::new();
    for run in cpus.chunk_by(|before, after| before + 1 == *after) {
        let comma = if text.is_empty() { "" } else { "," };
        // Writing to a String cannot fail.
        let _ = match run {
            [one] => write!(text, "{comma}{one}"),
            [first, .., last] => write!(text, "{comma}{first}-{last}"),
            [] => Ok(()),
        };
    }
    text
}

/// CPUs with their noun: `CPU 1`, `CPUs 0-3`.
pub(super) fn named(cpus: &[usize]) -> String {
    let noun = if cpus.len() == 1 { "CPU" } else { "CPUs" };
    format!("{noun} {}", list(cpus))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_read_and_written_as_the_kernel_does() {
        for (text, cpus) in [
            ("0", vec![0]),
            ("0-3", vec![0, 1, 2, 3]),
            ("0-2,5,7-8", vec![0, 1, 2, 5, 7, 8]),
            ("", vec![]),
        ] {
            assert_eq!(parse(&format!("{text}\n")), cpus, "{text}");
            assert_eq!(list(&cpus), text);
        }
        assert_eq!(parse("(null)\n"), Vec::<usize>::new());
        assert_eq!(
            (named(&[2]), named(&[0, 1])),
            ("CPU 2".to_owned(), "CPUs 0-1".to_owned())
        );
    }
}

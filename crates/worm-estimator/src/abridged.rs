//! Texts from outside, made short enough to be shown.

/// Stands for what was left out.
const ELLIPSIS: &str = "…";

/// The text, or where it is longer than about `max_len` bytes its beginning and its end: an error quotes what it found in a file, and
/// that can be as long as the file.
#[must_use]
pub fn abridged(text: String, max_len: usize) -> String {
    if text.len() <= max_len {
        return text;
    }
    let beginning = boundary((0..=max_len - max_len / 4).rev(), &text);
    let end = boundary(text.len() - max_len / 4..=text.len(), &text);
    [&text[..beginning], ELLIPSIS, &text[end..]].concat()
}

/// The first of these indices at which a character begins or the text ends.
fn boundary(mut indices: impl Iterator<Item = usize>, text: &str) -> usize {
    indices.find(|&index| text.is_char_boundary(index)).unwrap_or_default()
}

/// The first of some names, and how many more there are: `a, b and 3 more`.
#[must_use]
pub fn first_of(names: &[String], max_names: usize, max_len: usize) -> String {
    let shown: Vec<String> = names
        .iter()
        .take(max_names)
        .map(|name| abridged(name.clone(), max_len))
        .collect();
    match names.len() - shown.len() {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_keeps_its_beginning_and_its_end() {
        assert_eq!(abridged("short".to_owned(), 5), "short");
        assert_eq!(abridged("0123456789".to_owned(), 8), "012345…89");
        assert_eq!(abridged("éééééééééé".to_owned(), 8), "ééé…é", "cut between characters");
        assert_eq!(abridged("longer".to_owned(), 0), "…");
    }

    #[test]
    fn a_long_list_says_how_long_it_is() {
        let names = ["a", "b", "long name"].map(str::to_owned);
        assert_eq!(first_of(&names[..2], 2, 9), "a, b");
        assert_eq!(first_of(&names, 2, 9), "a, b and 1 more");
        assert_eq!(first_of(&names[2..], 2, 4), "lon…e");
    }
}

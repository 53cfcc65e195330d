//! What must not leave the computer.

/// What the manifest says of it.
pub(super) const LEFT_OUT: &str =
    "values of keys and arguments that are named like a token, password, secret or key, and of Authorization headers";

const NAMES: [&str; 5] = ["token", "password", "passphrase", "secret", "private_key"];
const PLACEHOLDER: &str = "(left out)";

/// A text with secrets left out: what follows a name like `token` and `=`, `:` or a space, to the end of the line or the next space where
/// it is an argument.
pub(super) fn redacted(text: &str) -> String {
    let lines: Vec<String> = text.lines().map(redacted_line).collect();
    let end = if text.ends_with('\n') { "\n" } else { "" };
    lines.join("\n") + end
}

fn redacted_line(line: &str) -> String {
    let lower = line.to_ascii_lowercase();
    if let Some(place) = lower.find("bearer ") {
        return format!("{}{PLACEHOLDER}", &line[..place + "bearer ".len()]);
    }
    let found = NAMES
        .iter()
        .filter_map(|name| Some((lower.find(name)?, name.len())))
        .min();
    let Some((place, length)) = found else {
        return line.to_owned();
    };
    // What else belongs to the name, as in `token_file`, and what stands between it and the value.
    let rest = &line[place + length..];
    let name_ends = rest
        .find(|letter: char| !(letter.is_ascii_alphanumeric() || "_-\"'".contains(letter)))
        .unwrap_or(rest.len());
    let value_at = rest[name_ends..].find(|letter: char| !" =:\t".contains(letter));
    let separator = rest[name_ends..].chars().next();
    match (separator, value_at) {
        (Some('=' | ':'), Some(value_at)) | (Some(' ' | '\t'), Some(value_at))
            if separator != Some(' ') || has_assignment(&rest[name_ends..]) || line[..place].ends_with('-') =>
        {
            let kept = place + length + name_ends + value_at;
            format!("{}{PLACEHOLDER}", &line[..kept])
        }
        _ => line.to_owned(),
    }
}

/// Whether the next letter that is no space assigns.
fn has_assignment(rest: &str) -> bool {
    rest.trim_start().starts_with(['=', ':'])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_are_left_out_and_other_lines_stay() {
        for (line, kept) in [
            ("token = \"abc def\"", "token = (left out)"),
            (
                "[dashboard]\nTOKEN=\"abc\"\nport = 1\n",
                "[dashboard]\nTOKEN=(left out)\nport = 1\n",
            ),
            (
                "wormd dashboard --token abc --listen x",
                "wormd dashboard --token (left out)",
            ),
            ("\"password\": \"abc\",", "\"password\": (left out)"),
            ("authorization: Bearer abc", "authorization: Bearer (left out)"),
            ("name = \"worm1\" # no secret here", "name = \"worm1\" # no secret here"),
            ("the token was refused", "the token was refused"),
        ] {
            assert_eq!(redacted(line), kept, "{line}");
        }
    }
}

//! The token that permits to drive.

use crate::failure::Failure;
use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use subtle::ConstantTimeEq;

/// The variable that may hold the token.
pub(crate) const VARIABLE: &str = "WORMD_DASHBOARD_TOKEN";
/// Shortest token that is taken, characters: what cannot be guessed.
const MIN_LENGTH: usize = 16;
/// Longest, characters: it has to fit into a header.
const MAX_LENGTH: usize = 256;
/// Bytes of a token that is made here.
const RANDOM: usize = 16;

/// A token. It is never printed by accident, and how long a comparison takes gives away nothing of it.
#[derive(Clone)]
pub(crate) struct Token {
    text: String,
    /// Whether it was made for this run alone.
    is_random: bool,
}

impl Token {
    /// The token of a file or of the environment; none where neither is given.
    ///
    /// # Errors
    /// [`Failure::Unusable`] when the file cannot be read, or what it holds is no token.
    pub(crate) fn configured(file: Option<&Path>) -> Result<Option<Self>, Failure> {
        let (text, origin) = match file {
            Some(file) => (read(file)?, file.display().to_string()),
            None => match std::env::var(VARIABLE) {
                Ok(text) => (text, VARIABLE.to_owned()),
                Err(std::env::VarError::NotPresent) => return Ok(None),
                Err(error) => return Err(Failure::unusable(format!("{VARIABLE}: {error}"))),
            },
        };
        Self::new(text.trim(), &origin).map(Some)
    }

    fn new(text: &str, origin: &str) -> Result<Self, Failure> {
        let is_plain = text.bytes().all(|byte| byte.is_ascii_graphic());
        if !is_plain || !(MIN_LENGTH..=MAX_LENGTH).contains(&text.len()) {
            return Err(Failure::unusable(format!(
                "{origin}: a token has {MIN_LENGTH} to {MAX_LENGTH} visible ASCII characters and no spaces, and this has {}: make one with \
                 `openssl rand -hex 16`",
                text.chars().count()
            )));
        }
        Ok(Self {
            text: text.to_owned(),
            is_random: false,
        })
    }

    /// A token for this run alone.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the computer has no random numbers.
    pub(crate) fn random() -> Result<Self, Failure> {
        let mut bytes = [0; RANDOM];
        File::open("/dev/urandom")
            .and_then(|mut file| file.read_exact(&mut bytes))
            .map_err(|error| Failure::failed(format!("/dev/urandom: {error}")))?;
        Ok(Self {
            text: bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
            is_random: true,
        })
    }

    /// Whether `text` is the token.
    pub(super) fn is(&self, text: &str) -> bool {
        self.text.as_bytes().ct_eq(text.as_bytes()).into()
    }

    /// The token itself, where it was made for this run and has to be told.
    pub(crate) fn to_tell(&self) -> Option<&str> {
        self.is_random.then_some(self.text.as_str())
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Token")
    }
}

fn read(file: &Path) -> Result<String, Failure> {
    let cannot = |error| {
        Failure::unusable(format!(
            "the token's file {}: {error}: give the path of a file with the token alone, which this user may read; `openssl rand -hex 16` makes one",
            file.display()
        ))
    };
    let mut text = String::new();
    // One byte more than fits is enough to see that it does not.
    let limit = MAX_LENGTH as u64 + 16;
    File::open(file)
        .and_then(|file| file.take(limit).read_to_string(&mut text))
        .map_err(cannot)?;
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_cannot_be_guessed_nor_printed() {
        let token = Token::random().expect("there are random numbers");
        let text = token.to_tell().expect("is told").to_owned();
        assert_eq!(text.len(), 32);
        assert_ne!(Some(text.as_str()), Token::random().expect("again").to_tell());
        assert!(token.is(&text));
        for wrong in [
            "",
            &text[1..],
            &format!("{text}0"),
            &text.to_uppercase().replace('0', "1"),
        ] {
            assert!(!token.is(wrong), "{wrong:?}");
        }
        assert!(!format!("{token:?}").contains(&text));
        for unusable in [
            "",
            "short",
            "with a space in it, long",
            "fünfzehn-und-mehr",
            &"x".repeat(257),
        ] {
            let refusal = Token::new(unusable, "the file").expect_err(unusable).to_string();
            assert!(refusal.starts_with("the file: a token has 16 to 256"), "{refusal}");
            assert!(unusable.is_empty() || !refusal.contains(unusable), "it is not printed");
        }
    }
}

//! A text of fixed size, so that it crosses a topic like a number.

use super::ZeroCopySend;
use super::field_kind::{FieldKind, FieldValue};
use super::json::{Form, Plain};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Value, json};
use std::borrow::Cow;
use std::fmt;

/// A text of at most [`ShortText::MAX_BYTES`] bytes in UTF-8, filled with zeros. Whoever wrote the memory may have written anything: what
/// is read ends with the first zero, or where it is no UTF-8.
#[derive(Clone, Copy, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
pub struct ShortText([u8; Self::MAX_BYTES]);

impl ShortText {
    /// Longest text, bytes.
    pub const MAX_BYTES: usize = 32;

    /// No text.
    pub const EMPTY: Self = Self([0; Self::MAX_BYTES]);

    /// The text without its control characters, as far as it fits.
    pub fn new(text: &str) -> Self {
        let mut bytes = [0; Self::MAX_BYTES];
        let mut length = 0;
        for letter in text.chars().filter(|letter| !letter.is_control()) {
            let Some(place) = bytes.get_mut(length..length + letter.len_utf8()) else {
                break;
            };
            length += letter.encode_utf8(place).len();
        }
        Self(bytes)
    }

    /// The very text; `None` if it is too long, or has a zero in it.
    pub(super) fn exact(text: &str) -> Option<Self> {
        let mut bytes = [0; Self::MAX_BYTES];
        bytes.get_mut(..text.len())?.copy_from_slice(text.as_bytes());
        (!text.contains('\0')).then_some(Self(bytes))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        let length = self.0.iter().position(|&byte| byte == 0).unwrap_or(Self::MAX_BYTES);
        let bytes = &self.0[..length];
        std::str::from_utf8(bytes)
            .or_else(|error| std::str::from_utf8(&bytes[..error.valid_up_to()]))
            .unwrap_or_default()
    }
}

impl fmt::Display for ShortText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl fmt::Debug for ShortText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_str().fmt(f)
    }
}

impl Plain for ShortText {
    type Form = Self;
}

impl Form<Self> for ShortText {
    const KIND: FieldKind = FieldKind::Text;
    const EMPTY: Self = Self::EMPTY;

    fn of(value: Self, _: usize) -> Self {
        value
    }

    fn value(&self) -> Self {
        *self
    }

    fn schema() -> Value {
        // JSON Schema counts characters, of which there are at most as many as bytes.
        json!({"type": "string", "maxLength": Self::MAX_BYTES})
    }

    fn read(field: &Self, _: usize) -> FieldValue<'_> {
        FieldValue::Text(field.as_str())
    }

    fn assign(field: &mut Self, value: FieldValue<'_>) -> bool {
        let FieldValue::Text(text) = value else {
            return false;
        };
        let Some(text) = Self::exact(text) else {
            return false;
        };
        *field = text;
        true
    }
}

impl Serialize for ShortText {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for ShortText {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        let expected = format!("a text of at most {} bytes without a zero", Self::MAX_BYTES);
        Self::exact(&text).ok_or_else(|| D::Error::invalid_length(text.len(), &expected.as_str()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_cut_between_characters_and_read_up_to_what_is_no_text() {
        for (given, kept) in [
            ("", ""),
            ("ann", "ann"),
            ("ann\n\x1b[31m", "ann[31m"),
            ("a\0b", "ab"),
            ("ääääääääääääääääääää", "ääääääääääääääää"),
            ("xääääääääääääääää", "xäääääääääääääää"),
        ] {
            let text = ShortText::new(given);
            assert_eq!(text.as_str(), kept, "{given:?}");
            assert_eq!(ShortText::exact(kept), Some(text), "{given:?}");
        }
        assert_eq!(ShortText::exact("a\0b"), None);
        assert_eq!(ShortText::exact(&"x".repeat(33)), None);
        let mut foreign = ShortText([0xFF; ShortText::MAX_BYTES]);
        assert_eq!(foreign.as_str(), "");
        foreign.0[..3].copy_from_slice(b"ben");
        assert_eq!(foreign.as_str(), "ben");
    }

    #[test]
    fn json_holds_the_text_or_says_why_it_cannot() {
        let text = ShortText::new("bên \"1\"");
        let json = serde_json::to_string(&text).expect("a text");
        assert_eq!(json, "\"bên \\\"1\\\"\"");
        assert_eq!(serde_json::from_str::<ShortText>(&json).ok(), Some(text));
        let error = serde_json::from_str::<ShortText>(&format!("{:?}", "x".repeat(33))).expect_err("too long");
        assert!(error.to_string().contains("at most 32 bytes"), "{error}");
    }
}

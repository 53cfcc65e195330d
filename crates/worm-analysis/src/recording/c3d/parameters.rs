//! The parameter section of a C3D file: groups of named values.

use super::bytes::Bytes;
use std::collections::HashMap;

/// Values by group and name, both in capitals.
#[derive(Debug, Default)]
pub(super) struct Parameters<'b> {
    values: HashMap<(i8, String), Value<'b>>,
    groups: HashMap<String, i8>,
}

/// One parameter: its elements, not yet decoded.
#[derive(Debug, Clone)]
struct Value<'b> {
    /// −1 text, 1 byte, 2 integer, 4 floating point.
    kind: i8,
    /// The first of its dimensions: the length of each of its texts.
    first_dimension: Option<usize>,
    data: Bytes<'b>,
}

impl<'b> Parameters<'b> {
    /// Walks through the section that begins at `at` with its four-byte header. `None` where it leaves the file.
    pub(super) fn read(file: Bytes<'b>, at: usize) -> Option<Self> {
        let mut parameters = Self::default();
        let mut at = at.checked_add(4)?;
        loop {
            // A negative length marks a locked entry.
            let name_length = usize::from(file.u8(at)?.cast_signed().unsigned_abs());
            let id = file.u8(at + 1)?.cast_signed();
            if name_length == 0 {
                return Some(parameters);
            }
            let name = String::from_utf8_lossy(file.slice(at + 2, name_length)?)
                .trim()
                .to_ascii_uppercase();
            let next_at = at + 2 + name_length;
            let to_next = usize::from(file.u16(next_at)?);
            if id < 0 {
                parameters.groups.insert(name, id.wrapping_neg());
            } else if id > 0 {
                let value = Value::read(file, next_at + 2)?;
                parameters.values.insert((id, name), value);
            }
            if to_next == 0 {
                return Some(parameters);
            }
            // At least its own two bytes, so that the loop ends.
            at = next_at + to_next.max(2);
        }
    }

    fn get(&self, group: &str, name: &str) -> Option<&Value<'b>> {
        let id = self.groups.get(group)?;
        self.values.get(&(*id, name.to_owned()))
    }

    /// The first number of a parameter; integers count as unsigned, as programs with long recordings use them.
    pub(super) fn number(&self, group: &str, name: &str) -> Option<f64> {
        let value = self.get(group, name)?;
        match value.kind {
            1 => value.data.u8(0).map(f64::from),
            2 => value.data.u16(0).map(f64::from),
            4 => value.data.f32(0).map(f64::from),
            _ => None,
        }
    }

    /// A frame number in two words, low word first.
    pub(super) fn two_words(&self, group: &str, name: &str) -> Option<f64> {
        let value = self.get(group, name).filter(|value| value.kind == 2)?;
        Some(f64::from(value.data.u16(0)?) + 65536.0 * f64::from(value.data.u16(2)?))
    }

    /// The texts of a parameter, trimmed.
    pub(super) fn texts(&self, group: &str, name: &str) -> Option<impl Iterator<Item = String> + use<'b>> {
        let value = self.get(group, name).filter(|value| value.kind == -1)?;
        let length = value.first_dimension.unwrap_or(1).max(1);
        let trim = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_matches(['\0', ' ']).to_owned();
        Some(value.data.bytes.chunks(length).map(trim))
    }
}

impl<'b> Value<'b> {
    fn read(file: Bytes<'b>, at: usize) -> Option<Self> {
        let kind = file.u8(at)?.cast_signed();
        let count = usize::from(file.u8(at + 1)?);
        let mut dimensions = file.slice(at + 2, count)?.iter().map(|&size| usize::from(size));
        let first_dimension = dimensions.clone().next();
        let element = usize::from(kind.unsigned_abs());
        let length = dimensions.try_fold(element, usize::checked_mul)?;
        let data = Bytes {
            bytes: file.slice(at + 2 + count, length)?,
            ..file
        };
        Some(Self {
            kind,
            first_dimension,
            data,
        })
    }
}

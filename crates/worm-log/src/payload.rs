//! A message as it stands in a log: JSON in logs of older versions, Protocol Buffers since.

use super::channel::{Channel, Logged};
use super::older::{completed, lacking_members, unknown_fields};
use worm_estimator::message::{FieldValue, ProtobufError};

/// How the messages of a channel are encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// JSON of a type of this version, or of an older one that lacks these members.
    Json { lacking: Option<&'static str> },
    /// Protocol Buffers, of a type in which these numbers are not known.
    Protobuf { unknown: &'static [&'static str] },
}

/// The names of both encodings for people.
pub(super) const ENCODINGS: &str = "'protobuf' or 'json'";

/// Why messages of a channel cannot be read.
pub(super) enum Unknown {
    /// This version does not know the encoding.
    Encoding,
    /// This version does not know the type.
    Type,
}

impl Encoding {
    /// The encoding of a file's channel, by the names that the file gives for it and for its type.
    pub(super) fn of(channel: Channel, encoding: &str, type_name: &str) -> Result<Self, Unknown> {
        let is_present = type_name == channel.type_name();
        match encoding {
            "json" => match lacking_members(channel, type_name) {
                None if !is_present => Err(Unknown::Type),
                lacking => Ok(Self::Json { lacking }),
            },
            "protobuf" if is_present => Ok(Self::Protobuf { unknown: &[] }),
            "protobuf" => match unknown_fields(channel, type_name) {
                Some(unknown) => Ok(Self::Protobuf { unknown }),
                None => Err(Unknown::Type),
            },
            _ => Err(Unknown::Encoding),
        }
    }
}

/// A message, still as the log holds it.
#[derive(Debug, Clone, Copy)]
pub struct Payload<'d> {
    pub(super) encoding: Encoding,
    pub(super) data: &'d [u8],
}

impl Payload<'_> {
    /// Reads the message.
    ///
    /// # Errors
    /// [`PayloadError`] when it is no message of the type.
    pub fn read<T: Logged>(&self) -> Result<T, PayloadError> {
        Ok(match self.encoding {
            Encoding::Json { lacking } => T::read_json(&completed(self.data, lacking))?,
            Encoding::Protobuf { unknown } => {
                let mut message = T::read_protobuf(self.data)?;
                for name in unknown {
                    let place = T::FIELDS.iter().position(|field| field.name == *name);
                    place.map(|place| message.set_field(place, FieldValue::Number(f64::NAN)));
                }
                message
            }
        })
    }
}

/// Why bytes of a log are no message of their type.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub enum PayloadError {
    /// As JSON.
    Json(#[from] serde_json::Error),
    /// As Protocol Buffers.
    Protobuf(#[from] ProtobufError),
}

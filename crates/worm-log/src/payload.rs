//! A message as it stands in a log: JSON in logs of older versions, Protocol Buffers since.

use super::channel::{Channel, Logged};
use super::older::{completed, is_beginning, lacking_members};
use worm_estimator::message::ProtobufError;

/// How the messages of a channel are encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// JSON of a type of this version, or of an older one that lacks these members.
    Json { lacking: Option<&'static str> },
    /// Protocol Buffers.
    Protobuf,
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
            "protobuf" if is_present || is_beginning(channel, type_name) => Ok(Self::Protobuf),
            "protobuf" => Err(Unknown::Type),
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
            Encoding::Protobuf => T::read_protobuf(self.data)?,
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

//! The messages of the topics inside the relay's JSON: the same objects as in logs.

use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::value::RawValue;
use worm_estimator::message::JsonMessage;

/// A message of a topic in its JSON form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Json<T>(pub(crate) T);

impl<T: JsonMessage> Serialize for Json<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut text = Vec::with_capacity(1024);
        self.0.write_json(&mut text).map_err(S::Error::custom)?;
        let text = String::from_utf8(text).map_err(S::Error::custom)?;
        RawValue::from_string(text)
            .map_err(S::Error::custom)?
            .serialize(serializer)
    }
}

impl<'de, T: JsonMessage> Deserialize<'de> for Json<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Box::<RawValue>::deserialize(deserializer)?;
        T::read_json(text.get().as_bytes()).map(Self).map_err(D::Error::custom)
    }
}

//! The channels of a log.

use worm_estimator::message::{
    Alarm, CommandRecord, Cycle, Estimate, Inferred, JsonMessage, ProtobufMessage, Range, State, Timing, TripStatus,
};

/// Encoding of the messages that are written, and of their schemas, as MCAP names it.
pub(super) const PROTOBUF: &str = "protobuf";
/// The metadata record and the attachment of a log.
pub(super) const METADATA: &str = "wormd";
pub(super) const CONFIG_ATTACHMENT: &str = "worm.toml";
/// The metadata record with the channels once more: for each ID topic, encoding and type, in words. Their definitions stand in the first
/// chunk, and in the index of a log that was finished; in one that was not, a damaged bit there would make all of it unreadable.
pub(super) const CHANNELS: &str = "wormd channels";

/// A message with a channel in a log.
pub trait Logged: ProtobufMessage {
    /// Its channel.
    const CHANNEL: Channel;
}

macro_rules! channels {
    ($($message:ident = $topic:literal,)+) => {
        /// A channel of a log, named after the topic that it holds.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Channel {
            $(
                #[doc = concat!("The [`", stringify!($message), "`]s.")]
                $message,
            )+
        }

        impl Channel {
            /// Every channel.
            pub const ALL: &'static [Self] = &[$(Self::$message),+];

            /// The name of its topic.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$message => $topic,)+ }
            }

            /// Name and version of the type of its messages.
            pub const fn type_name(self) -> &'static str {
                match self { $(Self::$message => <$message as JsonMessage>::TYPE_NAME,)+ }
            }

            /// The JSON Schema of its messages: the meaning and the unit of each field.
            pub fn schema(self) -> serde_json::Value {
                match self { $(Self::$message => <$message as JsonMessage>::schema(),)+ }
            }

            /// The descriptor of its messages, a serialised `google.protobuf.FileDescriptorSet`.
            pub fn descriptor_set(self) -> Vec<u8> {
                match self { $(Self::$message => <$message as ProtobufMessage>::descriptor_set(),)+ }
            }
        }

        $(impl Logged for $message {
            const CHANNEL: Channel = Channel::$message;
        })+
    };
}

channels! {
    State = "state",
    Timing = "timing",
    Estimate = "estimate",
    Cycle = "cycle",
    Alarm = "alarm",
    Range = "range",
    CommandRecord = "command",
    TripStatus = "trip",
    Inferred = "inferred",
}

impl Channel {
    /// The name in a file: `/state`.
    pub fn topic(self) -> String {
        format!("/{}", self.name())
    }

    /// The channel whose topic has this name, with or without the slash.
    pub fn from_name(name: &str) -> Option<Self> {
        let name = name.strip_prefix('/').unwrap_or(name);
        Self::ALL.iter().copied().find(|channel| channel.name() == name)
    }
}

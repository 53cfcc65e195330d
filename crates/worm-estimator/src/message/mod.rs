//! What the processes of one worm say to each other: one plain, fixed-size `#[repr(C)]` type per topic.
//!
//! [`control`](crate::control) fills [`State`] and [`Timing`], [`estimate`](crate::estimate) reads `State` and fills
//! [`Estimate`], [`Cycle`] and [`Alarm`], [`topics`](crate::topics) carries them all without a copy, and a recording
//! holds the very same values. The types stand apart from the transport so that the pure rooms need not know it.
//!
//! Layout rules, so that C and Python read the same bytes: only `f64`, `u64` and `u32` fields and arrays of them, wide
//! fields first, no padding, and a version in the type name, because iceoryx2 compares name, size and alignment
//! but not fields. "Not known" is `NaN` in an `f64`. Cells stand in arrays of [`MAX_CELLS`](worm_physics::MAX_CELLS), of which
//! the first `cell_count` are in use; cell 1 of the paper is index 0. Times are nanoseconds of `CLOCK_MONOTONIC`.
//!
//! Each type of a topic is one table, from which come the structure, its documentation, its form as JSON and the schema of
//! that ([`JsonMessage`]): what is said of a field here is what Foxglove shows of a recording.

mod alarm;
mod command;
mod cycle;
mod estimate;
mod json;
mod state;
mod timing;

pub use alarm::{Alarm, AlarmKind, Severity};
pub use command::{Command, CommandKind, CommandOutcome, Reply};
pub use cycle::Cycle;
pub use estimate::Estimate;
pub use json::JsonMessage;
pub use state::{Fault, Mode, State};
pub use timing::{Culprit, Timing};

// The trait and its derive share a name, as in iceoryx2's own prelude. Taken from its parts, they do without shared memory.
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

/// A number on a topic that stands for no known value of an enumeration: a newer peer, or a broken one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} is no known {1}: are all processes of this worm of one version?")]
pub struct UnknownCode(pub u32, pub &'static str);

/// Declares an enumeration that crosses a topic as a `u32`, with its name as people and JSON read it.
macro_rules! coded_enum {
    ($(#[$meta:meta])* $name:ident, $what:literal { $($(#[$vmeta:meta])* $variant:ident = $code:literal => $text:literal,)+ }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u32)]
        pub enum $name { $($(#[$vmeta])* $variant = $code,)+ }

        impl $name {
            /// Every value, in the order of the codes.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The code that crosses the topic.
            pub const fn code(self) -> u32 { self as u32 }

            /// The name as people, the configuration and JSON read it.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)+ }
            }

            /// The value that has this name.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|value| value.name() == name)
            }
        }

        impl TryFrom<u32> for $name {
            type Error = $crate::message::UnknownCode;
            fn try_from(code: u32) -> Result<Self, Self::Error> {
                match code { $($code => Ok(Self::$variant),)+ _ => Err($crate::message::UnknownCode(code, $what)) }
            }
        }

        impl $crate::message::json::Coded for $name {
            const WHAT: &'static str = $what;
            const VALUES: &'static [Self] = Self::ALL;
            fn name_of(self) -> &'static str { self.name() }
            fn code_of(self) -> u32 { self.code() }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result { f.write_str(self.name()) }
        }
    };
}
pub(crate) use coded_enum;

/// Declares a message as one table: the structure that crosses the topic, and its form as JSON.
///
/// `made` names the field with the time, `cells` tells how many cells are in use. A field whose form in JSON is not that of
/// its type says `as` which one it is.
macro_rules! message {
    (
        $(#[doc = $doc:literal])+
        $name:ident = $type_name:tt, made: $made:ident, cells: $cells:expr, {
            $($(#[doc = $field_doc:literal])+ $field:ident: $type:ty $(as $form:ty)?,)+
        }
    ) => {
        $(#[doc = $doc])+
        #[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
        #[type_name($type_name)]
        #[repr(C)]
        pub struct $name {
            $(
                $(#[doc = $field_doc])+
                pub $field: $type,
            )+
        }

        const _: () = {
            use $crate::message::json::{self, Form, Plain};

            macro_rules! form {
                ($plain:ty) => { <$plain as Plain>::Form };
                ($plain:ty, $other:ty) => { $other };
            }

            #[derive(serde::Serialize, serde::Deserialize)]
            #[serde(deny_unknown_fields)]
            struct Object {
                $(
                    #[serde(deserialize_with = "json::present")]
                    $field: form!($type $(, $form)?),
                )+
            }

            impl json::JsonMessage for $name {
                const TYPE_NAME: &'static str = $type_name;

                fn made_ns(&self) -> u64 {
                    self.$made
                }

                fn write_json(&self, out: &mut Vec<u8>) -> serde_json::Result<()> {
                    let cells: fn(&Self) -> u32 = $cells;
                    let cells = cells(self) as usize;
                    let object = Object { $($field: Form::<$type>::of(self.$field, cells),)+ };
                    serde_json::to_writer(out, &object)
                }

                fn read_json(text: &[u8]) -> serde_json::Result<Self> {
                    let object: Object = serde_json::from_slice(text)?;
                    let message = Self { $($field: Form::<$type>::value(&object.$field),)+ };
                    let cells: fn(&Self) -> u32 = $cells;
                    let cells = cells(&message) as usize;
                    $(
                        if let Some(length) = Form::<$type>::cells(&object.$field)
                            && length != cells
                        {
                            return Err(json::wrong_length(stringify!($field), length, cells));
                        }
                    )+
                    Ok(message)
                }

                fn schema() -> serde_json::Value {
                    let fields = [$((
                        stringify!($field),
                        json::member(
                            stringify!($field),
                            concat!($($field_doc),+),
                            <form!($type $(, $form)?) as Form<$type>>::schema(),
                        ),
                    ),)+];
                    let names = fields.each_ref().map(|(name, _)| *name);
                    serde_json::json!({
                        "$schema": "https://json-schema.org/draft/2020-12/schema",
                        "title": $type_name,
                        "description": json::prose(concat!($($doc),+)),
                        "type": "object",
                        "required": names,
                        "properties": serde_json::Map::from_iter(fields.map(|(name, schema)| (name.to_owned(), schema))),
                    })
                }
            }
        };
    };
}
pub(crate) use message;

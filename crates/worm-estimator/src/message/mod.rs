//! The messages between the processes of one worm: one plain, fixed-size `#[repr(C)]` type per topic.
//!
//! The controller fills [`State`], [`Timing`] and [`CommandRecord`]; [`estimate`](crate::estimate) reads `State` and fills [`Estimate`],
//! [`Cycle`], [`Alarm`], [`Range`] and [`Inferred`]; the recorder fills [`RecordingStatus`], the black box [`BlackBoxStatus`], and a trip [`TripStatus`].
//! Topics carry them all without a copy, and a log holds the
//! same values. The types are separate from the transport, so that nothing here depends on it.
//!
//! Layout rules, so that C and Python read the same bytes: only `f64`, `u64` and `u32` fields and arrays of them, and texts of 32 bytes
//! ([`ShortText`]), wide fields first, no padding, and a version in the type name, because iceoryx2 compares name, size and alignment
//! but not fields. "Not known" is `NaN` in an `f64`. Arrays over cells have [`MAX_CELLS`](worm_physics::MAX_CELLS) entries, of which the first `cell_count` are in use; cell 1 of the
//! paper is index 0. Times are nanoseconds of `CLOCK_MONOTONIC`.
//!
//! Each type of a topic is declared as one table. From it come the structure, its documentation, its JSON form with a schema
//! ([`JsonMessage`]), its Protocol Buffers form with a descriptor ([`ProtobufMessage`]), the columns of an exported table
//! ([`FieldAccess`]), and its layout in memory ([`InMemory`]), from which the types of other languages are made.

mod alarm;
mod black_box;
mod command;
mod command_record;
mod cycle;
mod estimate;
mod field_kind;
mod fields;
mod inferred;
mod json;
mod protobuf;
mod range;
mod recording;
mod short_text;
mod state;
mod timing;
mod trip;

pub use alarm::{Alarm, AlarmKind, Severity};
pub use black_box::BlackBoxStatus;
pub use command::{Command, CommandKind, CommandOutcome, Reply};
pub use command_record::CommandRecord;
pub use cycle::Cycle;
pub use estimate::Estimate;
pub use field_kind::{CodeValue, Codes, FieldKind, FieldValue, prose};
pub use fields::{Field, FieldAccess, InMemory, Layout};
pub use inferred::{Inferred, InferredStanding};
pub use json::JsonMessage;
pub use protobuf::{ProtobufError, ProtobufMessage};
pub use range::Range;
pub use recording::{RecordingProblem, RecordingState, RecordingStatus};
pub use short_text::ShortText;
pub use state::{Fault, HoldReason, Mode, State};
pub use timing::{Culprit, Timing};
pub use trip::{LinkLoss, TripPhase, TripReason, TripStatus};

// The trait and its derive share a name, as in iceoryx2's own prelude. Taken from its parts, they do without shared memory.
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

/// A code on a topic that this version does not know: the peer is newer, or broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} is no known {1}: are all processes of this worm of one version?")]
pub struct UnknownCode(pub u32, pub &'static str);

/// Declares an enumeration that crosses a topic as a `u32`, with a name for people and JSON.
macro_rules! coded_enum {
    ($(#[doc = $doc:literal])+ $name:ident, $what:literal { $($(#[doc = $vdoc:literal])+ $variant:ident = $code:literal => $text:literal,)+ }) => {
        $(#[doc = $doc])+
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u32)]
        pub enum $name { $($(#[doc = $vdoc])+ $variant = $code,)+ }

        impl $name {
            /// Every value, in the order of the codes.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The code that crosses the topic.
            pub const fn code(self) -> u32 { self as u32 }

            /// The name in JSON, in the configuration and for people.
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
            const CODES: &'static $crate::message::field_kind::Codes = &$crate::message::field_kind::Codes {
                name: stringify!($name),
                documentation: concat!($($doc),+),
                values: &[$($crate::message::field_kind::CodeValue {
                    code: $code,
                    name: $text,
                    documentation: concat!($($vdoc),+),
                }),+],
            };
            fn name_of(self) -> &'static str { self.name() }
            fn code_of(self) -> u32 { self.code() }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result { f.write_str(self.name()) }
        }
    };
}
pub(crate) use coded_enum;

/// The fields of a structure, from the same rows as the structure itself.
macro_rules! field_table {
    ($name:ident, { $($(#[doc = $doc:literal])+ $field:ident: $type:ty $(as $form:ty)?,)+ }) => {{
        use $crate::message::fields::Field;
        use $crate::message::json::{Form, Plain};

        macro_rules! form {
            ($plain:ty) => { <$plain as Plain>::Form };
            ($plain:ty, $other:ty) => { $other };
        }

        &[$(
            Field {
                name: stringify!($field),
                documentation: concat!($($doc),+),
                kind: <form!($type $(, $form)?) as Form<$type>>::KIND,
                is_optional: <form!($type $(, $form)?) as Form<$type>>::IS_OPTIONAL,
                offset: ::std::mem::offset_of!($name, $field),
                size: ::std::mem::size_of::<$type>(),
            },
        )+]
    }};
}
pub(crate) use field_table;

/// Declares a structure that crosses a service as it lies in memory, and its layout.
macro_rules! structure {
    (
        $(#[doc = $doc:literal])+
        $name:ident = $type_name:tt, {
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

        impl $crate::message::fields::InMemory for $name {
            const LAYOUT: $crate::message::fields::Layout = $crate::message::fields::Layout {
                name: stringify!($name),
                type_name: $type_name,
                documentation: concat!($($doc),+),
                size: ::std::mem::size_of::<Self>(),
                alignment: ::std::mem::align_of::<Self>(),
                fields: $crate::message::field_table!($name, { $($(#[doc = $field_doc])+ $field: $type $(as $form)?,)+ }),
            };
        }
    };
}
pub(crate) use structure;

/// Declares a message as one table: the structure that crosses the topic, its JSON form, and access to its fields one by one.
///
/// `made` names the field with the time, `cells` returns the number of cells in use. A field whose JSON form is not the usual one of its
/// type names it after `as`.
macro_rules! message {
    (
        $(#[doc = $doc:literal])+
        $name:ident = $type_name:tt, made: $made:ident, cells: $cells:expr, {
            $($(#[doc = $field_doc:literal])+ $field:ident: $type:ty $(as $form:ty)?,)+
        }
    ) => {
        $crate::message::structure! {
            $(#[doc = $doc])+
            $name = $type_name, { $($(#[doc = $field_doc])+ $field: $type $(as $form)?,)+ }
        }

        const _: () = {
            use $crate::message::field_kind::{FieldValue, prose};
            use $crate::message::fields::FieldAccess;
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
                        "description": prose(concat!($($doc),+)),
                        "type": "object",
                        "required": names.as_slice(),
                        "properties": serde_json::Map::from_iter(fields.map(|(name, schema)| (name.to_owned(), schema))),
                    })
                }
            }

            #[allow(non_camel_case_types, reason = "the places of the fields bear the fields' names")]
            enum Place { $($field,)+ }

            impl FieldAccess for $name {
                const TIME_FIELD: usize = Place::$made as usize;

                fn empty() -> Self {
                    Self { $($field: <form!($type $(, $form)?) as Form<$type>>::EMPTY,)+ }
                }

                fn cells(&self) -> usize {
                    let cells: fn(&Self) -> u32 = $cells;
                    cells(self) as usize
                }

                fn field(&self, place: usize) -> Option<FieldValue<'_>> {
                    $(
                        if place == Place::$field as usize {
                            return Some(<form!($type $(, $form)?) as Form<$type>>::read(&self.$field, self.cells()));
                        }
                    )+
                    None
                }

                fn set_field(&mut self, place: usize, value: FieldValue<'_>) -> bool {
                    $(
                        if place == Place::$field as usize {
                            return <form!($type $(, $form)?) as Form<$type>>::assign(&mut self.$field, value);
                        }
                    )+
                    false
                }
            }
        };
    };
}
pub(crate) use message;

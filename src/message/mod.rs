//! What the processes of one worm say to each other: one plain, fixed-size `#[repr(C)]` type per topic.
//!
//! [`control`](crate::control) fills [`State`] and [`Timing`], [`estimate`](crate::estimate) reads `State` and fills
//! [`Estimate`], [`Cycle`] and [`Alarm`], [`topics`](crate::topics) carries them all without a copy, and a recording
//! holds the very same values. The types stand apart from the transport so that the pure rooms need not know it.
//!
//! Layout rules, so that C and Python read the same bytes: only `f64`, `u64` and `u32` fields and arrays of them, wide
//! fields first, no padding, and a version in the type name, because iceoryx2 compares name, size and alignment
//! but not fields. "Not known" is `NaN` in an `f64`. Cells stand in arrays of [`MAX_CELLS`](crate::MAX_CELLS), of which
//! the first `cell_count` are in use; cell 1 of the paper is index 0. Times are nanoseconds of `CLOCK_MONOTONIC`.

mod alarm;
mod command;
mod cycle;
mod estimate;
mod state;
mod timing;

pub use alarm::{Alarm, AlarmKind, Severity};
pub use command::{Command, CommandKind, Reply, Verdict};
pub use cycle::Cycle;
pub use estimate::Estimate;
pub use state::{Fault, Mode, State};
pub use timing::{Culprit, Timing};

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

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result { f.write_str(self.name()) }
        }
    };
}
pub(crate) use coded_enum;

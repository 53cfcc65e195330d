//! Recordings: what a worm did, from motion capture or from its own log.
//!
//! A [`Recording`] holds cell positions over time and, where they are known, gait phase and motor state. Every format is read
//! into it, so that an analysis need not know where a recording comes from.
//!
//! # How a file becomes a recording
//! 1. [`open`] recognises the format from the file's first bytes.
//! 2. The reader of that format parses it. This project's own CSV and a log of the worm give positions along the canal.
//!    Motion capture gives markers in space: `projection` finds the canal in their motion, leaves out what does not crawl,
//!    and reports which marker it took for which cell.
//! 3. The recording is cut to the time requested.
//! 4. `sanity_check` examines it, whatever the format: time must increase, no cell may be unseen for too long, something must
//!    move, and lengths must be ones that a worm can have. `repair` undoes what a tracker got wrong, where the rest of the recording
//!    decides it, and notes it as a [`Repair`]. What is only unusual becomes a warning. What would turn a result
//!    into a guess is refused, with its place and a remedy.
//!
//! # Modules, in the order to read them
//! - `series`: [`Recording`] and [`ReadError`].
//! - `open`: the format by content, [`OpenOptions`].
//! - `table` reads CSV, `write` writes it.
//! - `vicon` and `c3d` read motion capture as `markers` in space; `projection` takes them onto the canal.
//! - [`mcap`]: a recording from the log of a live worm, and a log from a recording.
//! - `gaps`: positions that were not seen; `sanity_check`: what every recording must satisfy; `repair`: faults of trackers.
//! - `campaign`: several recordings of one worm.

mod c3d;
mod campaign;
mod gaps;
mod markers;
pub mod mcap;
mod open;
mod options;
mod projection;
mod repair;
mod repair_note;
mod sanity_check;
mod series;
mod statistics;
mod table;
pub(crate) mod text;
mod vicon;
mod write;

pub use campaign::PAYLOADS_KG;
pub use campaign::{Advance, Campaign, CampaignError, CampaignRun};
pub use open::{open, open_with_progress, read_from};
pub use options::{OpenOptions, Wanted};
pub use projection::{Axis, AxisError};
pub use repair_note::{Repair, RepairKind};
pub use series::{Motor, Recording};
pub use worm_log::ReadError;
pub use write::write_csv;

//! Recordings: what a worm did, from motion capture or from its own log.
//!
//! A [`Recording`] holds cell positions over time and, where they are known, gait phase and motor state. All formats end up in
//! it, so that whatever looks at a recording need not know where it comes from.
//!
//! # The story
//! [`open`] looks at a file's first bytes and finds its format. A table of this project's own and a log of the worm give
//! positions along the canal as they are. Motion capture gives markers in space: `projection` finds the canal in their motion,
//! leaves out what does not crawl, and tells which marker it took for which cell. Whatever the format, the recording is then
//! cut to the time that was asked for and looked through: time must run, every cell must be seen without long gaps, something
//! must move, and lengths must be ones that a worm can have. What is merely remarkable becomes a warning; what would make any
//! result a guess is refused with its place and a remedy.
//!
//! # The map, in reading order
//! - `series`: [`Recording`] and [`ReadError`].
//! - `open`: the format by content, [`OpenOptions`].
//! - `table`: CSV in; `write`: CSV out.
//! - `vicon` and `c3d`: motion capture, as `markers` in space; `projection`: from space onto the canal.
//! - [`mcap`]: the log of a live worm, in and out, and its replay through the estimator.
//! - `gaps`: what was not seen; `sanity_check`: what every recording must satisfy.
//! - `campaign`: several recordings of one worm.

mod c3d;
mod campaign;
mod gaps;
mod markers;
pub mod mcap;
mod open;
mod options;
mod projection;
mod sanity_check;
mod series;
mod statistics;
mod table;
mod text;
mod vicon;
mod write;

pub use campaign::PAYLOADS_KG;
pub use campaign::{Advance, Campaign, CampaignError, CampaignRun};
pub use open::{open, open_with_progress};
pub use options::OpenOptions;
pub use projection::{Axis, AxisError};
pub use series::{Motor, Recording};
pub use worm_log::ReadError;
pub use write::write_csv;

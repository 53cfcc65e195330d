//! The black box: the moments around each alarm and fault, kept at full rate, and a thin log of everything else.
//!
//! An ordinary subscriber at ordinary priority, as the recorder. The last minute is kept in memory, compressed. When an alarm is raised or the
//! controller latches a fault, that minute goes to a file, and what follows after it; nothing is compressed twice. A disk that is full
//! or read-only stops nothing: the black box reports it, which raises the alarm `recording-stopped`, keeps what is not written yet in
//! memory, within bounds, and tries again.
//!
//! # Modules, in reading order
//! - [`events`]: what is worth a box. Pure.
//! - [`ring`]: the compressed last minute.
//! - [`thin`]: what the thin log keeps. Pure.
//! - [`part_file`]: a file under way, with what is not written yet.
//! - [`folder`]: the files of a black box: their names, their list, the quota, what a killed black box left behind.
//! - [`copy`]: copies that can be broken off at any byte.
//! - [`keeper`]: messages in, files out.
//! - [`run`]: the process around it; [`status`]: its reports.
//! - [`place`]: which folder it is, for whoever looks for a box; [`standing`]: what its folder does not show.

pub(crate) mod copy;
mod events;
pub(crate) mod folder;
mod keeper;
mod part_file;
pub(crate) mod place;
mod ring;
mod run;
pub(crate) mod standing;
mod status;
pub(crate) mod utc;

pub(crate) use run::BlackBox;

use crate::why::Trigger;
use std::fs::File;
use std::path::Path;
use worm_log::outline;

/// The metadata record of a box that says what it is of.
pub(crate) const BOX_RECORD: &str = "wormd_black_box";
/// The metadata record at the end of a box: all its events.
pub(crate) const END_RECORD: &str = "wormd_black_box_end";

/// What a box was made of; none for another log.
pub(crate) fn trigger(path: &Path) -> Option<Trigger> {
    let held = outline(&mut File::open(path).ok()?).ok()?;
    let first = folder::events(&held).into_iter().next()?;
    Some(Trigger {
        time_ns: first.time_ns,
        event: first.event,
    })
}

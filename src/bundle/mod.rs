//! Everything that support needs of a worm, in one archive: `wormd bundle`.
//!
//! Nothing here needs a running worm, root, or a usable configuration: a part that cannot be had is named in the manifest with the reason.
//! Secrets are left out.
//!
//! - [`archive`]: the archive and its manifest.
//! - [`redact`]: what must not leave the computer.
//! - [`parts`]: what goes in.

mod archive;
mod parts;
mod redact;

pub(crate) use archive::Archive;
pub(crate) use parts::{Subject, add_all};

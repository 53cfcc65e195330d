//! An independent worm: it makes the recordings on which the identification is tested.
//!
//! It shares nothing with the library's model, on purpose. The library moves its worm quasi-statically, event by event and
//! without a time step; this one has mass. The cam prescribes the cells' positions relative to each other ([`cam`]); the body's
//! one remaining degree of freedom, its translation, obeys Newton ([`body`]); every tip is a spring and a damper in series with
//! a dry slider whose position on the canal is a state of its own; and all is integrated at 50 µs. A camera records it
//! ([`camera`]), with noise, gaps and an uneven clock. The true energies ([`balance`]) and cycles ([`truth`]) are kept for any
//! interval of time.
//!
//! ```text
//!   Drive ─► phase ─► Cam ─► extensions ─► Body ─► positions ─► Camera ─► Recording
//!                                           └────► TrueBalance ──────────► Truth
//! ```
//!
//! [`scene`] puts them together, [`draw`] draws worms that crawl, and [`score`] compares an analysis with the truth.

pub mod balance;
pub mod body;
pub mod cam;
pub mod camera;
pub mod draw;
pub mod scene;
pub mod score;
pub mod truth;

//! An independent worm: what makes the recordings that the identification is held against.
//!
//! It shares nothing with the library's model, on purpose. The library moves its worm quasi-statically, event by event and
//! without a time step; this one has mass. The cam prescribes how the cells stand to each other ([`cam`]), the body's one
//! remaining freedom, its translation, obeys Newton ([`body`]), every tip is a spring and a damper in series with a dry
//! slider whose place on the canal is a state of its own, and all is integrated at 50 µs. A camera watches ([`camera`]), with
//! noise, gaps and an uneven clock. What truly happened is kept beside it ([`account`]), to be asked for any stretch of time.
//!
//! ```text
//!   Drive ─► phase ─► Cam ─► extensions ─► Body ─► positions ─► Camera ─► Recording
//!                                           └────► Account ──────────────► Truth
//! ```
//!
//! [`scene`] puts them together, [`draw`] rolls the dice for worms that crawl, and [`score`] holds an analysis against it all.

pub mod balance;
pub mod body;
pub mod cam;
pub mod camera;
pub mod draw;
pub mod scene;
pub mod score;
pub mod truth;

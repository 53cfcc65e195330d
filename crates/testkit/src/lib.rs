//! What the tests and benches of the workspace share.
//!
//! - [`independent_worm`]: worms with inertia and an uneven motor, which share no code with the library's physics; the
//!   identification is held against them.
//! - [`hidden_effects`]: worms with an effect hidden in them, by friction laws of their own; the search for the missing effect is
//!   held against them.
//! - [`crawl`]: the exact model watched by a poor tracker, as the controller's states; the estimator is held against it.
//! - [`log_sample`]: a log of such a crawl.
//! - [`recording_files`]: recordings of the paper's worm, and files with them.
//! - [`process_pauses`]: stops and continues real processes, as a busy computer does.
//! - [`html`]: what a page must be.

#![allow(
    missing_docs,
    reason = "never published; types say what they are, and their fields carry their meaning and unit in the name"
)]

pub mod crawl;
pub mod hidden_effects;
pub mod html;
pub mod independent_worm;
pub mod log_sample;
pub mod nominal;
pub mod process_pauses;
pub mod random;
pub mod recording_files;

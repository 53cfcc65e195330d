//! What the tests and benches of the workspace share.
//!
//! - [`independent_worm`]: worms with inertia and an uneven motor, which share no code with the library's physics; they test the
//!   identification.
//! - [`hidden_effects`]: worms with a hidden effect and friction laws of their own, and the score of the search for the missing
//!   effect. A second test bed, in MuJoCo, lies beside this crate's sources in `mujoco/`.
//! - [`nominal`], [`random`]: constants and random draws that both share.
//! - [`crawl`]: the exact model as a poor tracker sees it, as the controller's states; it tests the estimator.
//! - [`log_sample`]: a log of such a crawl.
//! - [`recording_files`]: recordings of the paper's worm, and files with them.
//! - [`process_pauses`]: stops and continues real processes, as a busy computer does.
//! - [`pseudo_terminal`]: a terminal that ends with its test.
//! - [`html`]: what every page must satisfy.
//! - [`python`]: the interpreter of the tests that need one.

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
pub mod pseudo_terminal;
pub mod python;
pub mod random;
pub mod recording_files;

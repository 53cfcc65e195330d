//! Worms with a hidden effect: the test set of the search for the missing effect.
//!
//! They share no code with the library's model, on purpose: all that is used of the library is
//! [`worm_analysis::recording::Recording`], which is made here, and [`worm_estimator::config::Config`], the nominal worm that
//! goes with it. The library moves its worm quasi-statically, event by event; this one has mass, dampers and a time step
//! ([`body`]), and its tips hold by one of several friction laws, drawn at random ([`tip`]). No worm is quite the nominal one:
//! friction, stiffness, stroke, mass and slope are off by a few per cent ([`parameters`]), friction scatters from cycle to
//! cycle, the cam is rounded and the motor uneven as each machine has it ([`motor`]), and the camera's noise is correlated in
//! time.
//!
//! ```text
//!   seed ─► WormParameters ─────┐
//!   Effect ─► Deviations ───────┼─► Worm ─► Scene (one for each run) ─► Recording ┐
//!   UnmodelledEffect ───────────┘                                                 ├─► HiddenCampaign
//!                                        the same draws without the effect ───────┘
//! ```
//!
//! [`effect`] has the library's 22 effects by name, [`unmodelled`] effects that are not in the library. [`campaign`] draws a
//! worm and makes its runs, [`follow_up`] makes one more run of it under another condition, and [`split`] lists the cases.
//! [`assessment`] compares an answer with the truth, [`table`] sums up many; [`library`] calls the library's own search.

pub mod assessment;
pub mod body;
pub mod cam_profile;
pub mod campaign;
pub mod deviations;
pub mod effect;
pub mod effect_size;
pub mod follow_up;
pub mod library;
pub mod motor;
pub mod parameters;
pub mod scene;
pub mod split;
pub mod table;
pub mod tip;
pub mod unmodelled;

// The identification is tested with the same camera and motor.
pub use crate::independent_worm::{cam as drive, camera};

/// Cells of every worm here.
pub const CELLS: usize = 4;

//! Worms with an effect hidden in them: what the search for the missing effect is held against.
//!
//! It shares no code with the library's model, on purpose: it knows of the library only [`worm_analysis::recording::Recording`],
//! which it makes, and [`worm_estimator::config::Config`], the belief that goes with it. The library moves its worm quasi-statically,
//! event by event; this one has mass, dampers and a time step ([`body`]), and its tips hold by one of several friction laws,
//! which is part of the throw ([`tip`]). Nothing is quite as believed: friction, stiffness, stroke, mass and slope are off by
//! a few per cent ([`parameters`]), friction scatters from cycle to cycle, the cam is rounded and the motor uneven as each machine
//! has it ([`motor`]), and the camera's noise is correlated in time.
//!
//! ```text
//!   seed ─► Make ─────┐
//!   Effect ─► Flaws ──┼─► Worm ─► Scene (one for each run) ─► Recording ┐
//!   Stranger ─────────┘                                                 ├─► HiddenCampaign
//!                                        the same dice, nothing hidden ─┘
//! ```
//!
//! [`effect`] has the library's 22 effects by name, [`unmodelled`] what no library names, [`campaign`] throws the dice and
//! makes the runs, [`follow_up`] makes one more run of the same worm under another condition, and [`split`] lists the cases.
//! An answer is held against the truth by [`verdict`], and many of them by [`table`]; [`library`] asks the library's own search.

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

// The camera and the motor are those that the identification is judged by.
pub use crate::independent_worm::{cam as drive, camera};

/// Cells of every worm here.
pub const CELLS: usize = 4;

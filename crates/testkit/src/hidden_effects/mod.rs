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
//! worm ([`setting`]), hides something in it ([`hidden`]) and makes its runs ([`crawling`]), [`follow_up`] makes one more run of it under another condition, and [`split`] lists the cases.
//!
//! What is true of a campaign is a [`truth::Truth`], which every test bed writes as `truth.json`; the worm in MuJoCo
//! (`crates/testkit/mujoco`) writes the same file. [`assessment`] compares an [`answer`] with it, [`table`] and [`curves`] sum up
//! many, [`curve_figure`] draws them. [`library`] calls the library's own search, [`folders`] any built `wormd` on campaigns in folders.

pub mod answer;
pub mod artefact;
pub mod assessment;
pub mod body;
pub mod cam_profile;
pub mod campaign;
pub mod crawling;
pub mod curve_figure;
pub mod curves;
pub mod detectability;
pub mod deviations;
pub mod discrepancy;
pub mod effect;
pub mod effect_size;
pub mod folders;
pub mod follow_up;
pub mod hidden;
pub mod library;
pub mod motor;
pub mod parameters;
pub mod scene;
pub mod servo;
pub mod setting;
pub mod split;
pub mod statistics;
pub mod table;
pub mod tip;
pub mod true_campaign;
pub mod truth;
pub mod unmodelled;
pub mod variety;

// The identification is tested with the same camera and motor.
pub use crate::independent_worm::{cam as drive, camera};

/// The most cells that a worm here has. What there is one of for each cell lies in arrays of this length, of which a worm with fewer
/// uses the first.
pub const MAX_CELLS: usize = 8;

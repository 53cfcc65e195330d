//! The physics of an earthworm-like robot: what a gait does to the body, the tips and the energy.
//!
//! Source: D. Zarrouk, I. Sharf, M. Shoham, "Energetic analysis and experiments of earthworm-like locomotion with compliant surfaces",
//! Bioinspiration & Biomimetics 11 (2016) 014001. Equation numbers in this crate are theirs.
//!
//! # The model
//! A worm of n cells lies in a canal of slope λ. Each cell i, at position Xᵢ along the canal, touches the wall with a compliant tip at
//! X_C,i. Its deformation δᵢ = Xᵢ − X_C,i (4) loads the body with −kᵢ δᵢ, and friction holds the tip only up to a bound μN/k, beyond which
//! it slides (2, 3): a spring in series with a Coulomb slider. The cells step one at a time; the stepping cell extends by the stroke
//! relative to the others, which keep their distances. The only unknown, the translation of the body, follows from the balance
//! Σ kᵢ δᵢ + m g sin λ = 0, because the worm is too slow for inertia to matter.
//!
//! # Modules, in reading order
//! - [`worm`]: [`Worm`], the description of one worm in one canal, validated once.
//! - [`motion`]: [`Motion`], the streaming state. Between two events (a tip starting or ceasing to slide) everything is linear in the gait
//!   phase, so it runs from event to event and is exact for every increment.
//! - [`effect`]: a library of effects that the theory leaves out; [`Physics`] is a worm with any of them.
//! - [`Table`]: a law given at the points of a grid, for what no effect describes.
//! - [`Crawl`]: the motion increment by increment, under every law of [`Laws`] and with inertia. [`Locomotion`] selects the motion that the
//!   physics need.
//! - [`ledger`]: [`Ledger`], where the energy goes, with a balance that closes at every instant.
//! - [`cycle`]: [`steady_cycle`] and [`steady_cycle_of`], one cycle of the periodic crawl, and closed forms to compare with.
//! - [`drive`]: the torque that a crawl asks of the cam, and what a motor needs to give it.
//! - [`servo`]: a servo that lifts an arm on a bench, as a model of its own.
//! - [`study`]: Tables 1 and 2 of the paper for any design, and the range on a battery.
//!
//! # Limits
//! The exact motion and the steady cycle have no inertia, damping, drop from static to kinetic friction or anything else that [`Laws`] adds:
//! their only clock is the phase. Neither motion has coupling between neighbouring contacts.

/// The examples of the README are tested, too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// Most cells a worm can have: fixed-size topics and control tables are laid out for this many.
pub const MAX_CELLS: usize = 16;

mod crawl;
pub mod cycle;
pub mod drive;
pub mod effect;
pub mod ledger;
mod locomotion;
mod mechanics;
pub mod motion;
mod pad;
mod physics;
mod play;
pub mod servo;
pub mod study;
mod table;
pub mod worm;

pub use crawl::{Crawl, longest_increment_s};
pub use cycle::{Cycle, LevelCycle, Outcome, level_closed_form, rigid_energy_j, steady_cycle, steady_cycle_of};
pub use drive::{DriveLoad, Motor, MotorCycle, driven_cycle};
pub use ledger::Ledger;
pub use locomotion::Locomotion;
pub use mechanics::Mechanics;
pub use motion::{Motion, Piece};
pub use physics::{Laws, Patch, Physics, View};
pub use table::{ActsOn, Axis, MAX_POINTS, MAX_TABLES, Table, TableError, Tables};
pub use worm::{Contact, SlidesDown, Worm, WormError};

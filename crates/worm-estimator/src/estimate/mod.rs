//! What the worm does and what it costs, from the `state` topic alone: deformation, contact points, force, energy, cycles.
//!
//! Pure and streaming: the same code runs live and on a recording, and the same states give the same answers to the last bit.
//! Equation numbers are those of Zarrouk, Sharf and Shoham 2016.
//!
//! # The story
//! The controller's ticks carry the gait phase, precisely, and now and then a tracker sample, noisy, late and with holes.
//! `motor_time` knows how much of the time the motor lived through, `capture` finds the phase at which a sample was taken. `filter` makes of the samples where the cells are *now*, and
//! throws out what cannot be. `contact` follows the tips on those positions; together they are the `estimate` topic.
//!
//! Energies need better positions than a causal filter has, for noise at a sliding tip looks like sliding. So `window`
//! keeps the samples of the open gait cycle and the one before, `cycles` tells when a cycle ends, `fit` then lays the
//! cells' paths through all samples of both (solved by `bordered_band`), and `energy_balance` follows the tips along these paths:
//! losses (11, 12), actuator work (13), and the standard error of each. `electrical` adds what the motor took,
//! `prediction` what the model expects, and that is the `cycle` topic. Where the largest tip deformations are only
//! guessed, `bounds` finds them on the first cycles.
//!
//! `mismatch` runs the model beside the worm, cycle by cycle, and keeps a map of what it does not explain.
//!
//! A cycle at whose start the tips' contact points were not known (the first from rest, or the first after a silence of the
//! tracker) is reported with a guess of them, `settled = 0`, and standard errors as large as the guess is doubtful.
//!
//! Everything is measured against the canal, along it; inside, `window`, `fit`, `energy_balance` and `bounds` see a
//! backward crawl from its other end, so that it too runs forward.
//!
//! The [`alarm`]s watch all of it, each with a threshold that calibrates itself, and [`Observer`] is estimator and alarms
//! together: what the estimator process runs on live states, and a recording's player on recorded ones.
//!
//! # Cost
//! A tick without a sample takes some tens of nanoseconds, one with a sample below a microsecond for four cells; the end of
//! a cycle some 200 µs. Nothing is allocated after construction but in the model's prediction, once for each set of bounds.

pub mod alarm;

mod bordered_band;
mod bounds;
mod capture;
mod contact;
mod cycles;
mod electrical;
mod energy_balance;
mod estimator;
mod filter;
mod fit;
mod gait;
pub mod mismatch;
mod motor_time;
mod observer;
mod prediction;
mod unknown;
mod update;
mod window;

pub use capture::Capture;
pub use estimator::Estimator;
pub use mismatch::{Residual, ResidualMap};
pub use motor_time::MotorTime;
pub use observer::{Observer, ObserverOutput};
pub use update::{EstimatorError, Update};

//! What the worm does and what it costs, from the `state` topic alone: deformation, contact points, force, energy, cycles.
//!
//! The estimator is pure and streaming: the same code runs live and on a recording, and the same states give the same results to the
//! last bit. Equation numbers are those of Zarrouk, Sharf and Shoham 2016.
//!
//! # How it works
//! The controller's ticks carry the gait phase, precisely, and now and then a tracker sample, noisy, late and with gaps.
//!
//! 1. `motor_time` finds how much time passed for the motor, and `capture` the phase at which a sample was taken.
//! 2. `filter` estimates from the samples where the cells are *now*, and rejects outliers. `contact` follows the tips on those
//!    positions. Together they are the `estimate` topic.
//! 3. Energies need better positions than a causal filter has, for noise at a sliding tip looks like sliding. So `window` keeps the
//!    samples of the open gait cycle and the one before. When `cycles` reports the end of a cycle, `fit` fits the cells' paths to all
//!    samples of both (its normal equations are a `bordered_band` matrix), and `energy_balance` follows the tips along these paths:
//!    losses (11, 12), actuator work (13), and the standard error of each.
//! 4. `electrical` adds the motor's energy and `prediction` what the model expects. That is the `cycle` topic.
//! 5. Where the largest tip deformations are only a guess, `bounds` identifies them on the first cycles.
//! 6. `mismatch` runs the model beside the worm, cycle by cycle, and keeps a map of what it does not explain.
//! 7. `range` says how far the battery lasts. That is the `range` topic.
//! 8. `inference` senses the worm by its motor's current alone, beside all this: [`crate::self_sensing`]. That is the `inferred` topic.
//!
//! A cycle may start before the contact points of the tips are known: the first from rest, or the first after the tracker was silent.
//! It is reported with guessed contact points, `settled = 0`, and standard errors that include the uncertainty of the guess.
//!
//! Without a tracker, or with one that has failed and may (`control.on_stale_tracker`), `pace` makes estimates from the ticks alone. Whatever
//! follows from positions is `NaN` then; phase, cycles, electrical energy, charge and the other alarms go on.
//!
//! All positions are along the canal. Internally, `window`, `fit`, `energy_balance` and `bounds` look at a backward crawl from the
//! other end of the canal, so that it runs forward, too.
//!
//! The [`alarm`]s monitor all of it, each with a threshold that calibrates itself. [`Observer`] is estimator and alarms together:
//! the estimator process runs it on live states, a replay on recorded ones.
//!
//! # Cost
//! A tick without a sample takes some tens of nanoseconds, one with a sample less than a microsecond for four cells, and the end of a
//! cycle some 200 µs, with a battery twice that. Self-sensing takes a few microseconds more in each tick while it fits a cycle. Nothing is allocated after construction, except in the model's prediction, once for each set of bounds.

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
mod inference;
pub mod mismatch;
mod motor_time;
mod observer;
mod pace;
mod prediction;
pub mod range;
mod unknown;
mod update;
mod window;

pub use capture::Capture;
pub use estimator::Estimator;
pub use inference::Inference;
pub use mismatch::{Residual, ResidualMap};
pub use motor_time::MotorTime;
pub use observer::{Observer, ObserverOutput};
pub use range::RangeEstimator;
pub use update::{EstimatorError, Update};

//! A servo on a bench as a plant of the search.
//!
//! # Modules, in reading order
//! - `plant`: all that the search asks of a servo; `recorded_servo`: its runs with their noise.
//! - `observed`: a recording as the search sees it; `nuisance`: what is not known exactly; `predict`: the motion that a hypothesis predicts.
//! - `starts`: where fits start, for there are many minima.
//! - `discrepancy`: by how much any model of a servo is wrong; `supply`: what the readings of the voltage say of the supply.
//! - `explain`: the search on a campaign from beginning to end, and `assemble` its answer ([`answer`]).
//! - `calibration`: the recalibrated values, and which are far from what was stated.
//! - `gap`: how far a model is off, stage by stage; `friction_map`: where, by the torque balance over speed and load (`torque_balance`).
//! - `laws`: what a law that nobody listed may depend on.
//! - `present_current`: what the servo reports as its current.
//! - `next_experiment`: which run would decide; `model_update`: the model's file with the answer in it.

pub mod answer;
mod assemble;
mod calibration;
mod discrepancy;
mod explain;
#[cfg(test)]
mod fixture;
mod friction_map;
mod gap;
mod laws;
pub mod model_update;
mod next_experiment;
mod nuisance;
mod observed;
mod plant;
mod predict;
mod prediction;
mod present_current;
mod recorded_servo;
mod starts;
mod supply;
mod torque_balance;

pub use answer::{Measures, ServoAnswer};
pub use explain::{Bench, explain_servo};
pub use prediction::{ServoPredictionError, prediction_errors};

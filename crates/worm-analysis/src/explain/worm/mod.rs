//! The worm as a plant of the search.
//!
//! # Modules, in reading order
//! - `plant`: all that the search asks of a worm; `recorded_worm`: its runs with their noise; `prepare`: the runs before that.
//! - `observed`: a recording as the search sees it; `binning`: its bins; `nuisance`: what is not known exactly.
//! - `predict`: the positions that a hypothesis predicts, by a `walk` from `start` along a `track` at a `pace`, at samples by their `clock`;
//!   `phase_correction`: for phases found from overlapping steps; `predicted`: the result.
//! - `residual`: what a prediction leaves of the data; `noise`: how well the worm repeats itself.
//! - `torque`: what the motor's current shows of the forces, where it counts as evidence; `torque_residual`: what a prediction leaves of it;
//!   `torque_noise`: how well that repeats; `torque_discrepancy`: what its model may be wrong by; `gears`: what is not known of the gears between motor and cam.
//! - `gap`: how far a model is off, from the nominal one down to the noise floor.
//! - `energy`: what cycles cost, over the `settled_cycles`; `matters`: whether an effect changes what anybody asks.
//! - `period`: whether the residual repeats from cycle to cycle, `sway`: within the cycles, `wave`: how probable that is;
//!   `irregularity`: whether the body moves more irregularly than tips make it.
//! - `laws`: what a law that nobody listed may depend on.
//! - `whole_effects`: what nuisances have of an effect's law, given to the effect; `speed_droop`: the one effect that shows in time alone.

pub(in crate::explain) mod binning;
pub(in crate::explain) mod clock;
pub(in crate::explain) mod energy;
pub(in crate::explain) mod gap;
pub(in crate::explain) mod gears;
pub(in crate::explain) mod irregularity;
mod laws;
pub(in crate::explain) mod matters;
pub(in crate::explain) mod misstated_conditions;
pub(in crate::explain) mod noise;
pub(in crate::explain) mod nuisance;
pub(in crate::explain) mod observed;
pub(in crate::explain) mod pace;
pub(in crate::explain) mod period;
pub(in crate::explain) mod phase_correction;
pub(in crate::explain) mod plant;
pub(in crate::explain) mod predict;
pub(in crate::explain) mod predicted;
pub(in crate::explain) mod prepare;
pub(in crate::explain) mod recorded_worm;
pub(in crate::explain) mod residual;
pub(in crate::explain) mod settled_cycles;
pub(in crate::explain) mod speed_droop;
pub(in crate::explain) mod start;
pub(in crate::explain) mod sway;
mod torque;
pub(in crate::explain) mod torque_cycle;
mod torque_discrepancy;
pub(in crate::explain) mod torque_noise;
pub(in crate::explain) mod torque_residual;
pub(in crate::explain) mod track;
pub(in crate::explain) mod walk;
pub(in crate::explain) mod wave;
pub(in crate::explain) mod whole_effects;

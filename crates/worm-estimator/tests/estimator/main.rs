//! The estimator on worms whose truth is known.

mod accuracy;
mod behaviour;
mod self_sensing;

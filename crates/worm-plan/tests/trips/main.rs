//! Trips of drawn worms in virtual time: their bodies, motors, batteries and slopes are other than configured.
//!
//! - `world`: the worm as it is, with its controller, its estimator and its battery.
//! - `coming_home`: how many come home, with how much left.
//! - `silence`: where the ghost has them, and where they are.

mod coming_home;
mod silence;
mod world;

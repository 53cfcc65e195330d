//! The whole system in virtual time: the virtual worm, the controller's tick, the estimator and its alarms in one loop, without
//! processes, ports or clocks.
//!
//! - `accuracy`: energy per cycle against the virtual worm's own ledger, within 2 %.
//! - `stall`: a hard stall is reported and the goal is 0 within 100 ms; how close a healthy worm comes to the threshold.
//! - `faults`: which alarms each fault of the virtual worm raises, and by when, and that it raises no others.
//! - `fault_table`: every fault in every mode at several moments: what the worm does, how soon, and how it recovers.
//! - `why`: what `wormd why` says of every fault: the first reason is the right one.
//! - `soak`: a few segments of `wormd soak`.
//! - `mismatch`: worms that the model does not explain are reported; the configured worm and those a few per cent off are not.
//! - `pauses`: a pause of the computer, in whole or in part, is not a fault of the worm and does not distort the energies.
//! - `range`: how far the battery lasts, against worms that crawl until it does not.
//! - `self_sensing`: what the current of the motor says of the virtual worm, against its ledger.
//! - `without_positions`: worms without a tracker, and with one that dies and may.
//! - `hours`: healthy worms on many kinds of journeys raise no alarm. **`WORMD_HOURS=100`** makes the journeys 100 hours long.
//!   With it, `mismatch` tries all of its healthy worms, otherwise half of them.
//!
//! Everything is seeded; a failure names its seed.

mod accuracy;
mod bare;
mod fault_cases;
mod fault_table;
mod faults;
mod harness;
mod hours;
mod mismatch;
mod pauses;
mod range;
mod self_sensing;
mod soak;
mod stall;
mod why;
mod without_positions;

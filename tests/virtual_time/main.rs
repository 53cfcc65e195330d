//! The whole system in virtual time: the virtual worm, the controller's tick, the estimator and its alarms in one loop, without
//! processes, ports or clocks.
//!
//! - `accuracy`: energy per cycle against the virtual worm's own ledger, within 2 %.
//! - `stall`: a hard stall is told and the goal is 0 within 100 ms; how near a sound worm comes to the threshold.
//! - `faults`: what each fault of the virtual worm brings about, by when, and nothing else.
//! - `mismatch`: which worms the model does not explain, and that those of the file and a few per cent off are quiet.
//! - `pauses`: a computer that pauses, in whole or in part, is no fault of the worm's and costs no cycle its energies.
//! - `hours`: healthy worms on many kinds of journeys, and no alarm. **`WORMD_HOURS=100`** makes the journeys 100 hours long.
//!   With it, `mismatch` tries all of its sound worms, else half of them.
//!
//! Everything is seeded; a failure names its seed.

mod accuracy;
mod faults;
mod harness;
mod hours;
mod machine;
mod mismatch;
mod pauses;
mod stall;

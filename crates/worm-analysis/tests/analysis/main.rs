//! Recordings, identification, the search for the missing effect, and the pages that show the results.
//!
//! `independent_worm` and `hidden_effects` test the simulated worms of the testkit, which `identify`, `score` and `search` use to
//! test the library.

mod current;
mod effects_recorded;
mod hidden_effects;
mod identify;
mod independent_worm;
mod laws;
mod log_samples;
mod own_sample;
mod recording;
mod report;
mod score;
mod search;
mod servo_bench;

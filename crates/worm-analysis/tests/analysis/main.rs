//! Recordings, what is identified in them, the search for the missing effect, and the pages that show all of it.
//!
//! `independent_worm` and `hidden_effects` judge the worms of the testkit, which judge the library in `identify`, `score` and
//! `search`.

mod effects_recorded;
mod hidden_effects;
mod identify;
mod independent_worm;
mod log_samples;
mod recording;
mod report;
mod score;
mod search;

//! What recordings of an earthworm robot show: its gait, its deformations, its energy, and the effect that its model misses.
//!
//! ```text
//!   CSV, MCAP, C3D, Vicon ──► recording ──► identify ──► experiment ──► report
//!                                  └──────────────────► explain ─────► report, and the model with the effect in it
//! ```
//!
//! | module | what it holds | knows nothing of |
//! |---|---|---|
//! | [`recording`] | recordings of cell positions in every format | how they are analysed |
//! | [`mod@bench`] | recordings of a servo on a bench, their campaign, and the servo's model as a file | how they are analysed |
//! | [`identify`] | gait, largest tip deformations and mass from positions alone: section 3.2 of the paper | files |
//! | [`experiment`] | section 3 on recordings: slides, forces, energy by two methods, theory beside them; recordings from the model | files |
//! | [`explain`] | where model and recordings disagree, which effect is missing, and what to try next | files |
//! | [`report`] | pages with figures and tables, and CSV | how the figures came about |

pub mod bench;
pub mod experiment;
pub mod explain;
pub mod identify;
mod least_squares;
pub mod recording;
pub mod report;

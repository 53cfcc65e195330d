//! Why no gait was found.

/// Why no gait was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GaitError {
    /// A cell does not move relative to the others.
    #[error(
        "cell {} does not step: against the others it goes to and fro by {:.2} mm, too little for a step: is it a cell of this worm, and does the worm crawl?",
        cell + 1, swing_m * 1e3
    )]
    NoStep {
        /// The cell, from 0.
        cell: usize,
        /// How far it goes to and fro relative to the mean of all cells, m.
        swing_m: f64,
    },
    /// The cells do not step in a fixed order.
    #[error(
        "at {at_s:.2} s the cells do not step one after the other in a fixed order: cut the recording to where the worm crawls (--from, --to)"
    )]
    Disorder {
        /// Where that was first seen, s.
        at_s: f64,
    },
    /// The recording is too short.
    #[error("{cycles:.1} gait cycles are too few: at least two whole ones are needed")]
    TooFewSteps {
        /// How many there are.
        cycles: f64,
    },
    /// The gait runs in reverse.
    #[error(
        "the worm crawls backward: mirror the recording (change the sign of all positions) and the sign of the slope"
    )]
    Backward,
    /// Two cells alone, from which no phase can be found.
    #[error(
        "two cells show where they are in a step only while the motor turns evenly, and here they stand {:.1} mm off that: record the gait phase, or cut the recording to where the worm crawls evenly (--from, --to)",
        off_m * 1e3
    )]
    Uneven {
        /// Standard deviation of their distance from that of an even motor, m.
        off_m: f64,
    },
    /// The camera was knocked again and again.
    #[error(
        "all cells shift at once {} times ({}), and no other cycle has the like: was the camera knocked? Cut the recording to where it stood still (--from, --to)",
        at_s.len(), at_s.iter().take(5).map(|at_s| format!("at {at_s:.2} s")).collect::<Vec<_>>().join(", ")
    )]
    Knocks {
        /// When, s.
        at_s: Vec<f64>,
    },
    /// No worm crawls so slowly.
    #[error(
        "every gait cycle takes {cycle_s:.0} s and longer, and gait.cycle_s goes to 120 s: the times seem to be in milliseconds: divide them by 1000"
    )]
    Clock {
        /// Time of the fastest cycle, s.
        cycle_s: f64,
    },
    /// The recorded phase contradicts the positions.
    #[error("the recorded gait phase and the positions contradict each other: {0}")]
    Phase(String),
}

//! Play between the drive and a cell.
//!
//! The drive moves a cell by flanks on either side of it. Between them nothing but the damping of its guide in the body resists the
//! load on it, which is its contact force and its weight. The load turns twice in a cycle. In the cell's own step it follows the receding
//! flank until its pad is relieved, and waits there while the drive crosses the play; later, when its pad is relieved the other way,
//! it comes forward by as much while the body goes back.

/// The play of every cell's drive in one increment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Play {
    pub half_m: f64,
    /// How far a newton of load pushes a cell that is between the flanks, m/N.
    pub yields_m_per_n: f64,
}

impl Play {
    /// How far back from the middle a load has a cell at the increment's end, m, and the derivative of that, m/N, where it would be
    /// `resting_m` back if it stayed where it is in the body.
    pub fn behind_m(&self, resting_m: f64, load_n: f64) -> (f64, f64) {
        let free_m = resting_m + self.yields_m_per_n * load_n;
        if free_m.abs() < self.half_m {
            (free_m, self.yields_m_per_n)
        } else {
            (self.half_m.copysign(free_m), 0.0)
        }
    }
}

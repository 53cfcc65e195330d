//! Play between the drive and a cell.
//!
//! The drive moves a cell by flanks on either side of it. Between them nothing but the damping of its guide in the body resists the
//! load on it, which is its contact force and its weight. The load turns twice in a cycle. In the cell's own step it follows the receding
//! flank until its pad is relieved, and waits there while the drive crosses the play; later, when its pad is relieved the other way,
//! it comes forward by as much while the body goes back.

/// The play of one cell in one increment.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Play {
    pub half_m: f64,
    /// How far back from the middle the cell would be at the increment's end if it stayed where it is in the body, m.
    pub behind_m: f64,
    /// How far a newton of load pushes it in the increment, m/N.
    pub yields_m_per_n: f64,
    /// Load beside the contact force, N.
    pub standing_n: f64,
}

impl Play {
    /// How far back from the middle a contact force has the cell at the increment's end, m, and the derivative of that, m/N. Without play
    /// it keeps to its place.
    pub fn behind_m(&self, contact_n: f64) -> (f64, f64) {
        let free_m = self.behind_m + self.yields_m_per_n * (contact_n + self.standing_n);
        if free_m.abs() < self.half_m {
            (free_m, self.yields_m_per_n)
        } else {
            (self.half_m.copysign(free_m), 0.0)
        }
    }
}

//! What the current cannot tell: unknowns that it does not reach, and unknowns that it tells apart badly or not at all.

use super::fit::Fit;
use super::parameters::MAX_UNKNOWNS;
use std::fmt::{self, Display};

/// Correlation of two estimates from which on they count as twins.
const TWIN_CORRELATION: f64 = 0.9;
/// Share of its prior standard deviation above which an unknown counts as not learned.
const UNLEARNED_SHARE: f64 = 0.7;
/// Most pairs that are reported, the closest first.
pub const MAX_TWINS: usize = 8;

/// An unknown of the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknown {
    /// Friction force of a cell, from 0.
    Friction(usize),
    /// Stiffness of a cell, from 0.
    Stiffness(usize),
    /// Pull on the body.
    Pull,
    /// Dry and viscous friction of the gears, which are one at one speed.
    GearFriction,
    /// The torque constant.
    TorqueConstant,
    /// Friction by the load on the gears.
    LoadFriction,
    /// Damping of the pads.
    Damping,
    /// A ripple of the torque, from 0, its sine or cosine.
    Ripple(usize),
}

impl Display for Unknown {
    /// In words; cells count from 1.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Friction(cell) => write!(f, "friction of cell {}", cell + 1),
            Self::Stiffness(cell) => write!(f, "stiffness of cell {}", cell + 1),
            Self::Pull => f.write_str("pull on the body"),
            Self::GearFriction => f.write_str("friction of the gears"),
            Self::TorqueConstant => f.write_str("torque constant"),
            Self::LoadFriction => f.write_str("friction by the load on the gears"),
            Self::Damping => f.write_str("damping of the pads"),
            Self::Ripple(ripple) => write!(f, "ripple {}", ripple + 1),
        }
    }
}

impl Unknown {
    fn at(index: usize, cells: usize) -> Self {
        match index {
            _ if index < cells => Self::Friction(index),
            _ if index < 2 * cells => Self::Stiffness(index - cells),
            _ => match index - 2 * cells {
                0 => Self::Pull,
                1 => Self::GearFriction,
                2 => Self::TorqueConstant,
                3 => Self::LoadFriction,
                4 => Self::Damping,
                ripple => Self::Ripple((ripple - 5) / 2),
            },
        }
    }
}

/// Two unknowns that the current hardly tells apart: one may be larger and the other smaller (correlation −1), or both larger (+1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twin {
    /// One of them.
    pub one: Unknown,
    /// The other.
    pub other: Unknown,
    /// Correlation of their estimates, −1 to 1.
    pub correlation: f64,
}

/// What the current cannot tell.
///
/// That the pull may be a slope, a payload on a slope, or a drag is not in here, for it is always so: the profile knows their sum alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blind {
    /// Twins, the closest first.
    pub twins: [Option<Twin>; MAX_TWINS],
    /// Bit i: unknown i, in the order of [`Unknown`] with all cells of one kind after another, is hardly better known than before.
    pub unlearned: u64,
    /// Another answer that the profile does not exclude: its pull, N, and its probability. More pull looks like less friction in the gears.
    pub other_pull: Option<(f64, f64)>,
    cells: usize,
}

impl Blind {
    pub(super) fn of(fit: &Fit) -> Self {
        let (cells, covariance) = (fit.parameters().cells, fit.covariance());
        let mut blind = Self {
            twins: [None; MAX_TWINS],
            unlearned: 0,
            other_pull: fit.other(),
            cells,
        };
        for a in 0..fit.unknowns() {
            let sigma = covariance[(a, a)].sqrt();
            if sigma > UNLEARNED_SHARE * fit.prior_sigma(a) {
                blind.unlearned |= 1 << a;
            }
            for b in 0..a {
                let correlation = covariance[(a, b)] / (sigma * covariance[(b, b)].sqrt());
                if correlation.abs() > TWIN_CORRELATION {
                    blind.insert(Twin {
                        one: Unknown::at(b, cells),
                        other: Unknown::at(a, cells),
                        correlation,
                    });
                }
            }
        }
        blind
    }

    fn insert(&mut self, twin: Twin) {
        let further = |other: &Option<Twin>| other.is_none_or(|other| other.correlation.abs() < twin.correlation.abs());
        if let Some(at) = self.twins.iter().position(further) {
            self.twins[at..].rotate_right(1);
            self.twins[at] = Some(twin);
        }
    }

    /// The unknowns that are hardly better known than before.
    pub fn unlearned(&self) -> impl Iterator<Item = Unknown> + '_ {
        (0..MAX_UNKNOWNS)
            .filter(|index| self.unlearned >> index & 1 == 1)
            .map(|index| Unknown::at(index, self.cells))
    }
}

//! A worm with everything that happens to it: the paper's theory, and what effects add to it.

use super::table::Tables;
use super::worm::Worm;

/// Laws beside the paper's theory: what only the incremental motion knows. The default is none of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Laws {
    /// Force at which a resting tip begins to slide, over the force at which it goes on sliding; 1 or more.
    pub static_over_kinetic: f64,
    /// Slip over which a tip loses what it holds at rest beyond its kinetic friction, m; above 0.
    pub slip_m: f64,
    /// Time of rest in which it wins that back, s; above 0.
    pub grip_s: f64,
    /// Stiffness of the pads over that of the bristles by which their tips hold on (Dahl's law): no tip begins to slide quite
    /// suddenly; 0 or more.
    pub presliding: f64,
    /// β of the pad's force k δ (1 + β (δ/d)²), d = μN/k; 0 or more.
    pub hardening: f64,
    /// Stiffness of a Maxwell branch beside the pad's spring, as a share of it; 0 or more.
    pub creep_share: f64,
    /// Its time constant, s; above 0.
    pub creep_time_s: f64,
    /// Share of the pad's stiffness that yields, in elements whose yield deformations are spread evenly up to μN/k; 0 to 0.8.
    pub yielding_share: f64,
    /// Resistance to each cell's velocity, N s/m; 0 or more.
    pub drag_n_s_per_m: f64,
    /// Resisting force for each metre travelled since the motion began, N/m.
    pub tether_n_per_m: f64,
    /// Compliance of the drive that holds each cell in the body, m/N; 0 or more.
    pub compliance_m_per_n: f64,
    /// Play between the drive and each cell, m; 0 or more: the cell stands where its load pushes it to.
    pub play_m: f64,
    /// Damping of a cell against the body while it crosses the play, N s/m; above 0.
    pub play_damping_n_s_per_m: f64,
    /// By what share of a step each step begins early; 0 to 0.5.
    pub overlap: f64,
    /// Share of a step in which the cam brings a cell to speed, and the same to rest: rounded corners; 0 to 0.5.
    pub rounding: f64,
    /// Stretch of the canal with other friction.
    pub patch: Patch,
    /// Share of the friction that is lost with every cycle; below 1.
    pub wear_per_cycle: f64,
}

/// A stretch of the canal with other friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Where it begins, m along the canal.
    pub from_m: f64,
    /// How long it is, m.
    pub length_m: f64,
    /// Friction there over that elsewhere.
    pub friction_factor: f64,
}

impl Default for Laws {
    fn default() -> Self {
        Self {
            static_over_kinetic: 1.0,
            slip_m: 1e-4,
            grip_s: 0.1,
            presliding: 0.0,
            hardening: 0.0,
            creep_share: 0.0,
            creep_time_s: 1.0,
            yielding_share: 0.0,
            drag_n_s_per_m: 0.0,
            tether_n_per_m: 0.0,
            compliance_m_per_n: 0.0,
            play_m: 0.0,
            play_damping_n_s_per_m: 20.0,
            overlap: 0.0,
            rounding: 0.0,
            patch: Patch {
                from_m: 0.0,
                length_m: 0.0,
                friction_factor: 1.0,
            },
            wear_per_cycle: 0.0,
        }
    }
}

impl Laws {
    /// Whether every law is the paper's, so that the exact motion serves.
    pub fn are_piecewise_linear(&self) -> bool {
        self.neutral() == Self::default()
    }

    /// Whether one cycle can be like the next: nothing depends on the place, or on how far or how long the worm has crawled.
    pub fn are_periodic(&self) -> bool {
        let laws = self.neutral();
        laws.tether_n_per_m == 0.0 && laws.wear_per_cycle == 0.0 && laws.patch == Self::default().patch
    }

    /// These laws with the shape parameters of whatever is switched off at their defaults.
    fn neutral(&self) -> Self {
        let standard = Self::default();
        let mut laws = *self;
        if laws.static_over_kinetic == 1.0 {
            (laws.slip_m, laws.grip_s) = (standard.slip_m, standard.grip_s);
        }
        if laws.creep_share == 0.0 {
            laws.creep_time_s = standard.creep_time_s;
        }
        if laws.play_m == 0.0 {
            laws.play_damping_n_s_per_m = standard.play_damping_n_s_per_m;
        }
        if laws.patch.friction_factor == 1.0 || laws.patch.length_m == 0.0 {
            laws.patch = standard.patch;
        }
        laws
    }
}

/// The measurement, where it is not what it says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// What is measured over what is, for lengths.
    pub scale: f64,
    /// How old a measured position is, s.
    pub latency_s: f64,
}

impl Default for View {
    fn default() -> Self {
        Self {
            scale: 1.0,
            latency_s: 0.0,
        }
    }
}

/// A worm in its canal, and everything that happens to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Physics {
    /// The worm as the paper's theory knows it.
    pub worm: Worm,
    /// What the theory leaves out.
    pub laws: Laws,
    /// Laws that nobody derived, each at the points of a grid.
    pub tables: Tables,
    /// How the friction falls with the slope: by the factor 1 − s (1 − cos λ).
    pub slope_clamping: f64,
    /// Share of its speed that the motor loses for each newton that its cell exerts, 1/N: speed over 1 + d F.
    pub slowdown_per_n: f64,
    /// How it is measured.
    pub view: View,
}

impl Physics {
    /// Whether the crawl becomes periodic: no law depends on the place, the distance or the number of cycles.
    pub fn is_periodic(&self) -> bool {
        self.laws.are_periodic() && self.tables.are_periodic()
    }

    /// The period with which the canal repeats, m, where nothing else keeps one cycle from being like the next.
    pub(crate) fn period_along_canal_m(&self) -> Option<f64> {
        self.tables.period_along_canal_m().filter(|_| self.laws.are_periodic())
    }

    /// The paper's theory and nothing else.
    pub fn of(worm: Worm) -> Self {
        Self {
            worm,
            laws: Laws::default(),
            tables: Tables::default(),
            slope_clamping: 0.0,
            slowdown_per_n: 0.0,
            view: View::default(),
        }
    }

    /// The worm with what the slope does to its clamps: what the motions take.
    pub fn clamped_worm(&self) -> Worm {
        let factor = 1.0 - self.slope_clamping * (1.0 - self.worm.slope_rad().cos());
        let mut worm = self.worm.clone();
        if factor != 1.0 {
            worm.scale_friction(None, factor.max(0.0));
        }
        worm
    }

    /// The same worm seen from the other end of the canal, as [`Worm::mirrored`]. Overlap keeps to the beginning of each
    /// step, which in reverse was its end: a cycle's totals do not depend on that.
    pub fn mirrored(mut self) -> Self {
        self.worm = self.worm.mirrored();
        self.laws.patch.from_m = -(self.laws.patch.from_m + self.laws.patch.length_m);
        self.tables = self.tables.mirrored(self.worm.cells());
        self
    }

    /// Whether the exact motion serves: no law but the paper's.
    pub fn is_piecewise_linear(&self) -> bool {
        self.laws.are_piecewise_linear() && self.tables.is_empty()
    }

    /// The motor's speed against a force of the stepping cell, as a share of its speed without.
    pub fn speed_fraction(&self, actuator_force_n: f64) -> f64 {
        1.0 / (1.0 + self.slowdown_per_n * actuator_force_n.max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_and_physics_agree_on_what_is_periodic() {
        let patch = |length_m, friction_factor| Laws {
            patch: Patch {
                from_m: 0.1,
                length_m,
                friction_factor,
            },
            ..Laws::default()
        };
        let cases = [
            (Laws::default(), true),
            (patch(0.05, 0.5), false),
            (patch(0.05, 1.0), true),
            (patch(0.0, 0.5), true),
            (
                Laws {
                    tether_n_per_m: 1.0,
                    ..Laws::default()
                },
                false,
            ),
            (
                Laws {
                    wear_per_cycle: 0.01,
                    ..Laws::default()
                },
                false,
            ),
        ];
        for (laws, expected) in cases {
            let physics = Physics {
                laws,
                ..Physics::of(Worm::paper())
            };
            assert_eq!(
                (laws.are_periodic(), physics.is_periodic()),
                (expected, expected),
                "{laws:?}"
            );
        }
    }
}

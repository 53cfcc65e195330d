//! One tip under any of the laws: what force a shift of its cell calls up, and where the tip slides.
//!
//! The force on a pad never falls as its cell moves on, but for the drop at breakaway, which is a change of state between two
//! solutions and not part of either. So the balance of the body stays one monotone scalar equation.

/// Yielding elements of a pad: enough that the curve of their sum shows no corners in positions.
pub(super) const ELEMENTS: usize = 4;
/// Force, as a share of a tip's friction, to which a curved law is inverted.
const INVERSION_SHARE: f64 = 1e-12;
/// Share of its friction from which a tip on bristles counts as sliding.
const SLIDES_FROM: f64 = 0.98;
/// Share of its kinetic friction below which a tip that slid grips anew.
const GRIPS_BELOW: f64 = 0.5;
/// Iterations after which an inversion ends in any case: halving alone would do by then.
const MOST_ITERATIONS: usize = 80;

/// What one cell's tip is made of.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PadLaw {
    pub stiffness_n_per_m: f64, // of what does not yield
    pub forward_n: f64,         // kinetic friction, sliding forward
    pub backward_n: f64,
    pub static_over_kinetic: f64,
    /// Stiffness of the pad over that of the bristles by which its tip holds on; 0 for a tip that slides suddenly.
    pub presliding: f64,
    pub hardening_per_m2: f64,
    pub creep_n_per_m: f64,
    pub element_n_per_m: f64,
    pub element_yield_m: [f64; ELEMENTS],
}

/// The state of one tip.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Pad {
    pub deformation_m: f64,
    pub force_n: f64,
    pub sliding: i8, // −1, 0, 1
    relaxed_m: f64,  // of the creeping branch
    yielding_m: [f64; ELEMENTS],
}

/// What a tip can hold in one increment.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Hold {
    least_n: f64,
    most_n: f64,
    // Deformations under these forces, once they were asked for: both hang on the tip's state alone, not on the shift.
    least_m: Option<f64>,
    most_m: Option<f64>,
}

/// A tip after a shift of its cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Loaded {
    pub deformation_m: f64,
    pub force_n: f64,
    pub slide_m: f64,
    pub tangent_n_per_m: f64,
    /// Which way the tip slides: −1, 0 or 1.
    pub sliding: i8,
}

impl PadLaw {
    fn is_linear(&self) -> bool {
        self.hardening_per_m2 == 0.0 && self.creep_n_per_m == 0.0 && self.element_n_per_m == 0.0
    }

    /// What a tip can hold, with its friction scaled by `friction`.
    pub fn hold(&self, pad: &Pad, friction: f64) -> Hold {
        let ratio = |sense: i8| {
            if pad.sliding == sense {
                friction
            } else {
                friction * self.static_over_kinetic
            }
        };
        Hold {
            least_n: -self.backward_n * ratio(-1),
            most_n: self.forward_n * ratio(1),
            least_m: None,
            most_m: None,
        }
    }

    /// A tip whose cell moves by `shift_m`, while a share `relaxing` of what the creeping branch carries is lost.
    #[inline]
    pub fn load(&self, pad: &Pad, shift_m: f64, hold: &mut Hold, relaxing: f64) -> Loaded {
        if self.presliding > 0.0 && shift_m != 0.0 {
            let limit_n = if shift_m > 0.0 { hold.most_n } else { hold.least_n };
            return self.load_bristles(pad, shift_m, limit_n, relaxing);
        }
        let reach_m = pad.deformation_m + shift_m;
        let (reach_n, tangent_n_per_m) = if self.is_linear() {
            (self.stiffness_n_per_m * reach_m, self.stiffness_n_per_m)
        } else {
            self.force(pad, reach_m, relaxing)
        };
        let (force_n, deformation_m) = if reach_n > hold.most_n {
            let at_m = hold
                .most_m
                .get_or_insert_with(|| self.invert(pad, hold.most_n, relaxing));
            (hold.most_n, at_m.min(reach_m))
        } else if reach_n < hold.least_n {
            let at_m = hold
                .least_m
                .get_or_insert_with(|| self.invert(pad, hold.least_n, relaxing));
            (hold.least_n, at_m.max(reach_m))
        } else {
            return Loaded {
                deformation_m: reach_m,
                force_n: reach_n,
                slide_m: 0.0,
                tangent_n_per_m,
                sliding: 0,
            };
        };
        let slide_m = reach_m - deformation_m;
        Loaded {
            deformation_m,
            force_n,
            slide_m,
            tangent_n_per_m: 0.0,
            sliding: sense_of(slide_m),
        }
    }

    /// A tip that holds by bristles: its force tends to the friction as its cell goes on (Dahl's law), by implicit Euler;
    /// `limit_n` has the sign of the shift. A curved pad is taken for a straight line from where it is, twice, the second time
    /// towards where the first led.
    fn load_bristles(&self, pad: &Pad, shift_m: f64, limit_n: f64, relaxing: f64) -> Loaded {
        let is_linear = self.is_linear();
        // The creeping branch relaxes even where nothing moves.
        let (still_n, mut slope) = if is_linear {
            (pad.force_n, self.stiffness_n_per_m)
        } else {
            self.force(pad, pad.deformation_m, relaxing)
        };
        // What is left of the friction, 1 − F/limit: it falls by u/(u + c) for each way over which the pad alone would reach
        // the limit, so u₁² + (c − u₀ + way) u₁ = u₀ c at an increment's end.
        let left = (1.0 - still_n / limit_n).max(0.0);
        let mut loaded = (pad.deformation_m, still_n, 0.0);
        for _ in 0..if is_linear { 1 } else { 2 } {
            let share = self.presliding * slope / self.stiffness_n_per_m;
            let linear = share - left + shift_m * slope / limit_n;
            let root = (linear * linear + 4.0 * left * share).sqrt();
            // The form of the root that does not cancel.
            let after = if linear > 0.0 {
                2.0 * left * share / (linear + root)
            } else {
                0.5 * (root - linear)
            };
            let tangent = slope * after / root;
            if is_linear {
                let force_n = limit_n * (1.0 - after);
                loaded = (force_n / slope, force_n, tangent);
            } else {
                let strain_m = limit_n * (left - after) / slope;
                let deformation_m = pad.deformation_m + strain_m;
                let (force_n, slope_there) = self.force(pad, deformation_m, relaxing);
                loaded = (deformation_m, force_n, tangent);
                slope = if strain_m == 0.0 {
                    slope_there
                } else {
                    (force_n - still_n) / strain_m
                };
            }
        }
        let (deformation_m, force_n, tangent_n_per_m) = loaded;
        Loaded {
            deformation_m,
            force_n,
            slide_m: pad.deformation_m + shift_m - deformation_m,
            tangent_n_per_m,
            sliding: if force_n / limit_n > SLIDES_FROM {
                sense_of(shift_m)
            } else {
                0
            },
        }
    }

    /// In which sense a tip counts as sliding after an increment: what broke away does not grip anew before its force has
    /// fallen well below the friction, so that a swing of the body is not taken for rest.
    fn sliding(&self, pad: &Pad, loaded: &Loaded, hold: &Hold) -> i8 {
        let kinetic_n = if pad.sliding > 0 { hold.most_n } else { -hold.least_n };
        if loaded.sliding == 0 && f64::from(pad.sliding) * loaded.force_n > GRIPS_BELOW * kinetic_n {
            pad.sliding
        } else {
            loaded.sliding
        }
    }

    /// Takes over a load. Returns the energy that is lost in the pad or set free when a tip breaks away, J.
    pub fn take(&self, pad: &mut Pad, loaded: &Loaded, hold: &Hold, relaxing: f64) -> f64 {
        let deformation_m = loaded.deformation_m;
        let before_n = pad.force_n;
        pad.sliding = self.sliding(pad, loaded, hold);
        pad.force_n = loaded.force_n;
        // What a tip holds more while it rests than while it slides goes with the slide, half of it on the way.
        let freed_j = 0.5 * (before_n - loaded.force_n) * loaded.slide_m;
        if self.is_linear() {
            pad.deformation_m = deformation_m;
            return freed_j;
        }
        let elastic_before_j = self.elastic_j(pad);
        let strain_j = 0.5 * (before_n + loaded.force_n) * (deformation_m - pad.deformation_m);
        for at in 0..ELEMENTS {
            pad.yielding_m[at] = self.element(pad, at, deformation_m);
        }
        pad.relaxed_m += relaxing * (deformation_m - pad.relaxed_m);
        pad.deformation_m = deformation_m;
        freed_j + strain_j - (self.elastic_j(pad) - elastic_before_j)
    }

    /// Energy that a tip gives back when it is let go at once, J.
    pub fn elastic_j(&self, pad: &Pad) -> f64 {
        let square_m2 = pad.deformation_m * pad.deformation_m;
        let spring_j = 0.5 * self.stiffness_n_per_m * square_m2 * (1.0 + 0.5 * self.hardening_per_m2 * square_m2);
        let creep_j = 0.5 * self.creep_n_per_m * (pad.deformation_m - pad.relaxed_m).powi(2);
        let elements_m2: f64 = pad.yielding_m.iter().map(|element_m| element_m * element_m).sum();
        spring_j + creep_j + 0.5 * self.element_n_per_m * elements_m2
    }

    fn element(&self, pad: &Pad, at: usize, deformation_m: f64) -> f64 {
        let yield_m = self.element_yield_m[at];
        (pad.yielding_m[at] + deformation_m - pad.deformation_m).clamp(-yield_m, yield_m)
    }

    /// Force and its slope at a deformation.
    fn force(&self, pad: &Pad, deformation_m: f64, relaxing: f64) -> (f64, f64) {
        let bend = self.hardening_per_m2 * deformation_m * deformation_m;
        let creep = self.creep_n_per_m * (1.0 - relaxing);
        let mut force_n =
            self.stiffness_n_per_m * deformation_m * (1.0 + bend) + creep * (deformation_m - pad.relaxed_m);
        let mut slope = self.stiffness_n_per_m * (1.0 + 3.0 * bend) + creep;
        if self.element_n_per_m > 0.0 {
            for at in 0..ELEMENTS {
                let element_m = self.element(pad, at, deformation_m);
                force_n += self.element_n_per_m * element_m;
                if element_m.abs() < self.element_yield_m[at] {
                    slope += self.element_n_per_m;
                }
            }
        }
        (force_n, slope)
    }

    /// The deformation at which the force is `target_n`: Newton's method within a bracket, from where the tip is.
    fn invert(&self, pad: &Pad, target_n: f64, relaxing: f64) -> f64 {
        if self.is_linear() {
            return target_n / self.stiffness_n_per_m;
        }
        let scale_n = self.forward_n.max(self.backward_n);
        let mut at_m = pad.deformation_m;
        // Neither relaxing nor yielding makes the force fall, so the spring alone reaches the target within this.
        let far_m = (target_n.abs() + self.force(pad, at_m, relaxing).0.abs()) / self.stiffness_n_per_m;
        let (mut low_m, mut high_m) = (at_m - 2.0 * far_m, at_m + 2.0 * far_m);
        for _ in 0..MOST_ITERATIONS {
            let (force_n, slope) = self.force(pad, at_m, relaxing);
            let excess_n = force_n - target_n;
            if excess_n.abs() <= INVERSION_SHARE * scale_n {
                break;
            }
            if excess_n > 0.0 {
                high_m = at_m;
            } else {
                low_m = at_m;
            }
            let newton_m = at_m - excess_n / slope;
            at_m = if newton_m > low_m && newton_m < high_m {
                newton_m
            } else {
                0.5 * (low_m + high_m)
            };
        }
        at_m
    }
}

fn sense_of(way_m: f64) -> i8 {
    if way_m > 0.0 {
        1
    } else if way_m < 0.0 {
        -1
    } else {
        0
    }
}

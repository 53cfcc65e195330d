//! One tip under any of the laws: the force that a shift of its cell causes, and where the tip slides.
//!
//! The force on a pad never falls as its cell moves on, because what a tip can hold is fixed before its increment: where it breaks away, the
//! force falls in the next increments. So the balance of the body stays one monotone scalar equation.
//!
//! Beside the springs of a pad there may be a damper. The tip holds the sum of their forces, so a pad that is deformed fast slides early.
//!
//! Slip reduces what a tip holds beyond its kinetic friction, and rest restores it: θ′ = (1 − θ)/t − θ |v|/d, the ageing law of rate and
//! state friction (Dieterich 1979, Ruina 1983). In a steady slide it gives the Stribeck curve.

/// Yielding elements of a pad (Iwan's model): enough that their sum has no visible corners.
pub(super) const ELEMENTS: usize = 4;
/// Tolerance of the force when a curved law is inverted, as a fraction of a tip's friction.
const INVERSION_FRACTION: f64 = 1e-12;
/// Tolerance for a curved pad on bristles, as a fraction of its cell's shift.
const STRAIN_FRACTION: f64 = 1e-9;
/// Fraction of its friction from which a tip on bristles counts as sliding.
const SLIDES_FROM: f64 = 0.98;
/// Most iterations of an inversion: bisection alone would have converged by then.
const MAX_ITERATIONS: usize = 80;

/// The parameters of one cell's tip.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PadLaw {
    pub stiffness_n_per_m: f64, // of the part that does not yield
    pub forward_n: f64,         // kinetic friction, sliding forward
    pub backward_n: f64,
    pub static_over_kinetic: f64,
    pub slip_m: f64,
    pub grip_s: f64,
    /// Stiffness of the pad over that of the bristles of its tip; 0 for a tip that starts to slide suddenly.
    pub presliding: f64,
    pub hardening_per_m2: f64,
    pub creep_n_per_m: f64,
    pub element_n_per_m: f64,
    pub element_yield_m: [f64; ELEMENTS],
}

/// What the time of an increment does in every pad.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rate {
    /// Fraction of its force that the creeping branch loses.
    pub relaxing: f64,
    /// Of the damper: force per deformation in the increment.
    pub damping_n_per_m: f64,
}

/// The state of one tip.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Pad {
    pub deformation_m: f64,
    pub force_n: f64,
    slip_m_s: f64,  // in the last increment
    slipped: f64,   // lost fraction of what it holds at rest beyond its kinetic friction
    relaxed_m: f64, // of the creeping branch
    yielding_m: [f64; ELEMENTS],
}

/// The limits of a tip in one increment.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Hold {
    min_n: f64,
    max_n: f64,
    // Found on first use: all depend on the tip's state alone, not on the shift.
    bristles: Option<Bristles>,
    min_m: Option<f64>, // deformations at the limits
    max_m: Option<f64>,
}

/// A tip on bristles before its cell moves in an increment.
#[derive(Debug, Clone, Copy, Default)]
struct Bristles {
    still_m: f64, // deformation at which the pad bears what the bristles hold
    from_m: f64,  // the same, by the drive
    slope_n_per_m: f64,
    softness: f64, // compliance of the bristles, relative to the pad's
    yields: f64,   // deformation of pad and drive together, relative to the pad's
    per_yields: f64,
    backward: Side,
    forward: Side,
}

/// One limit of a tip on bristles.
#[derive(Debug, Clone, Copy, Default)]
struct Side {
    limit_n: f64,
    left: f64,          // remaining friction, a fraction of it
    whole_m: f64,       // deformation of the pad by the whole limit
    per_m: f64,         // its inverse
    twice_product: f64, // of remaining friction and softness
}

/// A tip after a shift of its cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Loaded {
    pub deformation_m: f64,
    pub force_n: f64,
    pub slide_m: f64,
    pub tangent_n_per_m: f64,
    /// Direction in which the tip slides: −1, 0 or 1.
    pub sliding: i8,
}

impl PadLaw {
    pub fn is_linear(&self) -> bool {
        self.hardening_per_m2 == 0.0 && self.creep_n_per_m == 0.0 && self.element_n_per_m == 0.0
    }

    /// The limits of a tip at the end of an increment, with its friction scaled by `friction`. It is assumed to slip as fast as in the
    /// increment before: with its actual slip the force would fall as the cell moves on, and the solution would not be unique.
    pub fn hold(&self, pad: &Pad, friction: f64, step_s: f64) -> Hold {
        let mut limit = friction;
        if self.static_over_kinetic != 1.0 {
            let slipped = self.slipped(pad, pad.slip_m_s * step_s, step_s);
            limit *= 1.0 + (self.static_over_kinetic - 1.0) * (1.0 - slipped);
        }
        Hold {
            min_n: -self.backward_n * limit,
            max_n: self.forward_n * limit,
            bristles: None,
            min_m: None,
            max_m: None,
        }
    }

    /// A tip whose cell moves by `shift_m`.
    #[inline]
    pub fn load(&self, pad: &Pad, shift_m: f64, hold: &mut Hold, rate: Rate) -> Loaded {
        if self.presliding > 0.0 {
            return self.load_bristles(pad, shift_m, hold, rate, 0.0);
        }
        let reach_m = pad.deformation_m + shift_m;
        let (reach_n, tangent_n_per_m) = self.force(pad, reach_m, rate);
        let (force_n, deformation_m) = if reach_n > hold.max_n {
            let at_m = hold.max_m.get_or_insert_with(|| self.invert(pad, hold.max_n, rate));
            (hold.max_n, at_m.min(reach_m))
        } else if reach_n < hold.min_n {
            let at_m = hold.min_m.get_or_insert_with(|| self.invert(pad, hold.min_n, rate));
            (hold.min_n, at_m.max(reach_m))
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
            sliding: sign_of(slide_m),
        }
    }

    /// A tip on bristles: its force tends to the friction as its cell moves on (Dahl's law), by implicit Euler; the limit has the sign of
    /// the shift.
    ///
    /// The bristles hold what they held at the increment's start, so the pad first deforms to where it bears that, and only the shift
    /// beyond changes the force. With u = 1 − F/limit, the remaining friction, and c the compliance of the bristles relative to the pad's,
    /// the pad takes u/(u + c) of it and the tip slides the rest. For a linear pad that is a quadratic in u at the increment's end, also
    /// where the cell is driven by something with a compliance of its own.
    ///
    /// The cell's shift is the drive's, less what the compliance takes. Of a curved pad the compliance must be 0.
    pub fn load_bristles(
        &self,
        pad: &Pad,
        driven_m: f64,
        hold: &mut Hold,
        rate: Rate,
        compliance_m_per_n: f64,
    ) -> Loaded {
        let (min_n, max_n) = (hold.min_n, hold.max_n);
        let bristles = &*hold
            .bristles
            .get_or_insert_with(|| self.bristles(pad, (min_n, max_n), rate, compliance_m_per_n));
        let (still_m, slope, yields) = (bristles.still_m, bristles.slope_n_per_m, bristles.yields);
        // If the force stayed what the bristles hold.
        let beyond_m = pad.deformation_m + driven_m - bristles.from_m;
        let side = if beyond_m > 0.0 {
            &bristles.forward
        } else {
            &bristles.backward
        };
        let linear = bristles.softness - yields * side.left + beyond_m * side.per_m;
        let root = (linear * linear + 2.0 * yields * side.twice_product).sqrt();
        // The form of the root without cancellation.
        let after = if linear > 0.0 {
            side.twice_product / (linear + root)
        } else {
            0.5 * (root - linear) * bristles.per_yields
        };
        let limit_n = side.limit_n;
        let mut shift_m = driven_m;
        let (deformation_m, force_n, tangent_n_per_m) = if self.is_linear() {
            let force_n = limit_n * (1.0 - after);
            shift_m -= compliance_m_per_n * (force_n - pad.force_n);
            // By the shift, which is less than the drive's.
            let tangent_n_per_m = slope * after / (root - (yields - 1.0) * after);
            (still_m + (side.left - after) * side.whole_m, force_n, tangent_n_per_m)
        } else if side.left == 0.0 {
            (still_m, limit_n, 0.0)
        } else {
            let guess_m = (side.left - after) * side.whole_m;
            let (strain_m, force_n, tangent) = self.strain_bristles(pad, still_m, beyond_m, limit_n, rate, guess_m);
            (still_m + strain_m, force_n, tangent)
        };
        Loaded {
            deformation_m,
            force_n,
            slide_m: pad.deformation_m + shift_m - deformation_m,
            tangent_n_per_m,
            sliding: if force_n.abs() > SLIDES_FROM * limit_n.abs() {
                sign_of(beyond_m)
            } else {
                0
            },
        }
    }

    /// A tip on bristles before its cell moves, with what it can hold to either side.
    fn bristles(&self, pad: &Pad, (min_n, max_n): (f64, f64), rate: Rate, compliance_m_per_n: f64) -> Bristles {
        let still_n = pad.force_n.clamp(min_n, max_n);
        let still_m = self.invert(pad, still_n, rate);
        let slope_n_per_m = self.force(pad, still_m, rate).1;
        let softness = self.presliding * slope_n_per_m / self.stiffness_n_per_m;
        let yields = 1.0 + compliance_m_per_n * slope_n_per_m;
        let side = |limit_n: f64| {
            let left = (1.0 - still_n / limit_n).max(0.0);
            Side {
                limit_n,
                left,
                whole_m: limit_n / slope_n_per_m,
                per_m: slope_n_per_m / limit_n,
                twice_product: 2.0 * left * softness,
            }
        };
        Bristles {
            still_m,
            from_m: still_m + compliance_m_per_n * (still_n - pad.force_n),
            slope_n_per_m,
            softness,
            yields,
            per_yields: yields.recip(),
            backward: side(min_n),
            forward: side(max_n),
        }
    }

    /// A curved pad on bristles: the part of a shift that it takes, by Newton's method from that of a linear one. Both u and the excess
    /// over u/(u + c) of the shift are monotone in it, so the root is unique. Returns strain, force and the derivative of the force by
    /// the shift.
    fn strain_bristles(
        &self,
        pad: &Pad,
        still_m: f64,
        shift_m: f64,
        limit_n: f64,
        rate: Rate,
        guess_m: f64,
    ) -> (f64, f64, f64) {
        let mut strain_m = guess_m;
        let mut bracket = Bracket {
            low_m: shift_m.min(0.0),
            high_m: shift_m.max(0.0),
        };
        let mut tries = 0;
        loop {
            let (force_n, slope) = self.force(pad, still_m + strain_m, rate);
            let left = 1.0 - force_n / limit_n;
            let fraction = self.presliding * slope / self.stiffness_n_per_m;
            let excess_m = strain_m * (left + fraction) - shift_m * left;
            let steepness = left + fraction + (shift_m - strain_m) * slope / limit_n;
            tries += 1;
            if excess_m.abs() <= STRAIN_FRACTION * shift_m.abs() || tries == MAX_ITERATIONS {
                return (strain_m, force_n, slope * left / steepness);
            }
            strain_m = bracket.next_m(strain_m, excess_m, steepness);
        }
    }

    /// Lost fraction of the holding force after an increment with this slip: slip reduces it, rest restores it.
    fn slipped(&self, pad: &Pad, slip_m: f64, step_s: f64) -> f64 {
        let slip = slip_m / self.slip_m;
        (pad.slipped + slip) / (1.0 + slip + step_s / self.grip_s)
    }

    /// Accepts a load. Returns the energy that is lost in the pad or released when a tip breaks away, J.
    pub fn take(&self, pad: &mut Pad, loaded: &Loaded, step_s: f64, rate: Rate) -> f64 {
        let deformation_m = loaded.deformation_m;
        let before_n = pad.force_n;
        if self.static_over_kinetic != 1.0 {
            // The deflection of bristles before the tip slides does not count as slip.
            let slip_m = f64::from(loaded.sliding).abs() * loaded.slide_m.abs();
            pad.slipped = self.slipped(pad, slip_m, step_s);
            pad.slip_m_s = slip_m / step_s;
        }
        pad.force_n = loaded.force_n;
        // What a tip holds at rest beyond its kinetic friction is lost in the slide, half of it on average.
        let freed_j = 0.5 * (before_n - loaded.force_n) * loaded.slide_m;
        if self.is_linear() {
            // Of a linear pad only the damper takes energy.
            let strain_m = deformation_m - pad.deformation_m;
            let spring_n = 0.5 * self.stiffness_n_per_m * (deformation_m + pad.deformation_m);
            pad.deformation_m = deformation_m;
            return freed_j + (0.5 * (before_n + loaded.force_n) - spring_n) * strain_m;
        }
        let elastic_before_j = self.elastic_j(pad);
        let strain_j = 0.5 * (before_n + loaded.force_n) * (deformation_m - pad.deformation_m);
        for at in 0..ELEMENTS {
            pad.yielding_m[at] = self.element(pad, at, deformation_m);
        }
        pad.relaxed_m += rate.relaxing * (deformation_m - pad.relaxed_m);
        pad.deformation_m = deformation_m;
        freed_j + strain_j - (self.elastic_j(pad) - elastic_before_j)
    }

    /// Elastic energy of a tip, J.
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

    /// Force and its derivative at a deformation.
    #[inline]
    fn force(&self, pad: &Pad, deformation_m: f64, rate: Rate) -> (f64, f64) {
        let damping = rate.damping_n_per_m;
        let damped_n = damping * (deformation_m - pad.deformation_m);
        if self.is_linear() {
            let stiffness = self.stiffness_n_per_m;
            return (stiffness * deformation_m + damped_n, stiffness + damping);
        }
        let bend = self.hardening_per_m2 * deformation_m * deformation_m;
        let creep = self.creep_n_per_m * (1.0 - rate.relaxing);
        let mut force_n =
            self.stiffness_n_per_m * deformation_m * (1.0 + bend) + creep * (deformation_m - pad.relaxed_m) + damped_n;
        let mut slope = self.stiffness_n_per_m * (1.0 + 3.0 * bend) + creep + damping;
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
    fn invert(&self, pad: &Pad, target_n: f64, rate: Rate) -> f64 {
        if self.is_linear() {
            let damping = rate.damping_n_per_m;
            return (target_n + damping * pad.deformation_m) / (self.stiffness_n_per_m + damping);
        }
        let scale_n = self.forward_n.max(self.backward_n);
        let mut at_m = pad.deformation_m;
        // Relaxation and yielding never make the force fall, so the spring alone reaches the target within this.
        let far_m = (target_n.abs() + self.force(pad, at_m, rate).0.abs()) / self.stiffness_n_per_m;
        let mut bracket = Bracket {
            low_m: at_m - 2.0 * far_m,
            high_m: at_m + 2.0 * far_m,
        };
        for _ in 0..MAX_ITERATIONS {
            let (force_n, slope) = self.force(pad, at_m, rate);
            let excess_n = force_n - target_n;
            if excess_n.abs() <= INVERSION_FRACTION * scale_n {
                break;
            }
            at_m = bracket.next_m(at_m, excess_n, slope);
        }
        at_m
    }
}

/// A bracket of the root of a growing function.
struct Bracket {
    low_m: f64,
    high_m: f64,
}

impl Bracket {
    /// Narrows the bracket by the value at a place, and returns the next place: Newton's, or the middle if that is outside.
    fn next_m(&mut self, at_m: f64, excess: f64, slope: f64) -> f64 {
        if excess > 0.0 {
            self.high_m = at_m;
        } else {
            self.low_m = at_m;
        }
        let newton_m = at_m - excess / slope;
        if newton_m > self.low_m && newton_m < self.high_m {
            newton_m
        } else {
            0.5 * (self.low_m + self.high_m)
        }
    }
}

fn sign_of(displacement_m: f64) -> i8 {
    if displacement_m > 0.0 {
        1
    } else if displacement_m < 0.0 {
        -1
    } else {
        0
    }
}

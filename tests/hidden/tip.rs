//! One tip: a pad that gives, in series with a bristle that grips the canal.
//!
//! The pad between cell and tip is a spring with a damper beside it, and with what may be hidden in it: a cubic part, a
//! Maxwell branch, elements that yield. The tip itself has no mass and holds to the canal by the bristle of LuGre's friction,
//! z' = v (1 − σ |z| sgn(v z) / F) with v the tip's velocity and F the friction limit: it gives a little before it slides, and
//! slides at σ z = F. Without mass the forces of pad and bristle are equal at every moment; with both taken linear over a
//! time step, that is a quadratic equation for v, so the bristle's stiffness does not bound the time step.

/// How many elements the yielding share of a pad is made of.
const ELEMENTS: usize = 16;
/// Deformation at which the pad's cubic part equals β times its linear part, m.
const HARDENING_M: f64 = 1.75e-3;
/// Share of its limit from which a tip counts as sliding.
const SLIDING: f64 = 0.97;
/// Way over which the limit of a tip that has begun to slide falls to its kinetic value, m.
const DROP_M: f64 = 0.1e-3;
/// A tip slower than this rests, m/s.
const REST_M_S: f64 = 0.3e-3;
/// Rest after which the static limit holds again, s.
const RESTORED_S: f64 = 0.010;

/// What a pad and its tip are made of.
#[derive(Debug, Clone)]
pub struct Pad {
    pub stiffness_n_per_m: f64,
    pub damping_n_s_per_m: f64,
    pub hardening: f64,
    pub creep_share: f64,
    pub creep_s: f64,
    pub yielding_share: f64,
    /// Deformation to which the elements that yield are spread, m.
    pub yielding_m: f64,
    pub bristle_n_per_m: f64,
    pub static_over_kinetic: f64,
}

impl Pad {
    /// Slope of the elastic force, N/m, at most.
    fn tangent_n_per_m(&self, deformation_m: f64) -> f64 {
        let cubic = 3.0 * self.hardening * (deformation_m / HARDENING_M).powi(2);
        self.stiffness_n_per_m * (1.0 + cubic + self.creep_share)
    }
}

/// Friction limits of the moment, N, without what rest adds.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    pub forward_n: f64,
    pub backward_n: f64,
}

/// How one tip stands.
#[derive(Debug, Clone)]
pub struct Tip {
    /// Where it touches the canal, m.
    pub place_m: f64,
    /// Force of the pad on the tip, forward, without its damper, N; the cell feels it backward.
    pub elastic_n: f64,
    /// The same with the damper, N.
    pub force_n: f64,
    deformation_m: f64,
    bristle_m: f64,
    crept_m: f64,
    yielded_m: [f64; ELEMENTS],
    /// Way since it began to slide, m, with the sign of the direction.
    slid_m: f64,
    rested_s: f64,
}

impl Tip {
    /// A tip laid down without load.
    pub fn laid_down(place_m: f64) -> Self {
        Self {
            place_m,
            elastic_n: 0.0,
            force_n: 0.0,
            deformation_m: 0.0,
            bristle_m: 0.0,
            crept_m: 0.0,
            yielded_m: [0.0; ELEMENTS],
            slid_m: 0.0,
            rested_s: 0.0,
        }
    }

    /// One time step in which the cell goes `way_m`.
    pub fn follow(&mut self, way_m: f64, step_s: f64, pad: &Pad, limits: Limits) {
        let stiffness = pad.tangent_n_per_m(self.deformation_m);
        let damping = pad.damping_n_s_per_m / step_s;
        let bristle = pad.bristle_n_per_m;
        // What pulls the tip if it stays where it is, and what holds it.
        let pull_n = self.elastic_n + (stiffness + damping) * way_m;
        let excess_n = pull_n - bristle * self.bristle_m;
        let sign = excess_n.signum();
        let limit_n = if sign > 0.0 {
            limits.forward_n
        } else {
            limits.backward_n
        } * self.grip(sign, pad);
        // With s the way of the tip: (pull − (stiffness + damping) s) (1 + σ |s| / F) = σ (z + s).
        let yielding = bristle / limit_n;
        let square = yielding * (stiffness + damping);
        let linear = stiffness + damping + bristle - yielding * sign * pull_n;
        let root = (linear * linear + 4.0 * square * excess_n.abs()).sqrt();
        // Both forms of the same root; each loses digits where the other does not.
        let way = if linear > 0.0 {
            2.0 * excess_n.abs() / (linear + root)
        } else {
            (root - linear) / (2.0 * square)
        };
        let tip_m = sign * way;

        self.bristle_m = (self.bristle_m + tip_m) / (1.0 + yielding * way);
        self.place_m += tip_m;
        let strained_m = way_m - tip_m;
        self.deformation_m += strained_m;
        self.deform(step_s, pad);
        self.force_n = self.elastic_n + damping * strained_m;
        if pad.static_over_kinetic != 1.0 {
            self.remember(tip_m, limit_n, step_s, pad);
        }
    }

    /// The pad's elastic force at its new deformation.
    fn deform(&mut self, step_s: f64, pad: &Pad) {
        let (stiffness, reach_m) = (pad.stiffness_n_per_m, self.deformation_m);
        let cubic = pad.hardening * (reach_m / HARDENING_M).powi(2);
        let mut force_n = stiffness * (1.0 - pad.yielding_share + cubic) * reach_m;
        if pad.creep_share > 0.0 {
            self.crept_m += (reach_m - self.crept_m) * step_s / (pad.creep_s + step_s);
            force_n += stiffness * pad.creep_share * (reach_m - self.crept_m);
        }
        if pad.yielding_share > 0.0 {
            let element = stiffness * pad.yielding_share / ELEMENTS as f64;
            for (place, yielded_m) in self.yielded_m.iter_mut().enumerate() {
                let most_m = pad.yielding_m * (place as f64 + 0.5) / ELEMENTS as f64;
                *yielded_m = yielded_m.clamp(reach_m - most_m, reach_m + most_m);
                force_n += element * (reach_m - *yielded_m);
            }
        }
        self.elastic_n = force_n;
    }

    /// The limit over the kinetic one.
    fn grip(&self, sign: f64, pad: &Pad) -> f64 {
        let slid_m = (sign * self.slid_m).max(0.0);
        1.0 + (pad.static_over_kinetic - 1.0) * (-slid_m / DROP_M).exp()
    }

    /// Keeps how far the tip has slid since it last rested or turned.
    fn remember(&mut self, tip_m: f64, limit_n: f64, step_s: f64, pad: &Pad) {
        let slides = (pad.bristle_n_per_m * self.bristle_m).abs() > SLIDING * limit_n;
        self.rested_s = if tip_m.abs() < REST_M_S * step_s {
            self.rested_s + step_s
        } else {
            0.0
        };
        if self.rested_s > RESTORED_S || (tip_m * self.slid_m < 0.0 && tip_m.abs() > REST_M_S * step_s) {
            self.slid_m = 0.0;
        }
        if slides {
            self.slid_m += tip_m;
        }
    }
}

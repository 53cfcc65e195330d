//! One time step of a tip between its pad and its friction: what goes in, what comes out, and the implicit solution that the
//! laws with a bristle share.

/// A tip that is pulled forward for one time step, or backward with all signs turned.
#[derive(Debug, Clone, Copy)]
pub struct TipLoad {
    /// Force of the pad on the tip if the tip stays where it is, N.
    pub pull_n: f64,
    /// How fast that force falls with the tip's way, N/m.
    pub slack_n_per_m: f64,
    /// Friction limit, N.
    pub limit_n: f64,
    pub bristle_n_per_m: f64,
    /// The bristle's bend, m, below `pull_n / bristle_n_per_m`.
    pub bristle_m: f64,
    pub step_s: f64,
}

impl TipLoad {
    /// What pulls the tip beyond what its bent bristle holds, N.
    pub fn excess_n(&self) -> f64 {
        self.pull_n - self.bristle_n_per_m * self.bristle_m
    }
}

/// Where a tip is after the time step.
#[derive(Debug, Clone, Copy)]
pub struct TipStep {
    /// Way of the tip, m, not negative.
    pub displacement_m: f64,
    /// The bristle's bend, m.
    pub bristle_m: f64,
}

/// The end of a time step with z' = v (1 − `yielding` z), `yielding` in 1/m.
///
/// With s the tip's way, (pull − slack s) = σ₀ z₁ + σ₁ (z₁ − z) / Δt + σ₂ s / Δt and z₁ = (z + s) / (1 + yielding s) are a
/// quadratic equation for s, so neither stiffness nor damping bounds the time step.
pub fn yield_at(load: &TipLoad, yielding: f64, damping_s: f64, drag_s_per_m: f64) -> TipStep {
    // Beyond the limit, which has fallen then, a damped unbending would push the tip on: LuGre's known loss of passivity.
    let bends = load.bristle_n_per_m * load.bristle_m < load.limit_n;
    let damping = if bends {
        load.bristle_n_per_m * damping_s / load.step_s
    } else {
        0.0
    };
    let slack = load.slack_n_per_m + drag_s_per_m * load.limit_n / load.step_s;
    let excess_n = load.excess_n();
    if yielding == 0.0 {
        let displacement_m = excess_n / (slack + load.bristle_n_per_m + damping);
        let bristle_m = load.bristle_m + displacement_m;
        return TipStep {
            displacement_m,
            bristle_m,
        };
    }
    let linear = slack + load.bristle_n_per_m + damping - yielding * (load.pull_n + damping * load.bristle_m);
    let displacement_m = positive_root(yielding * slack, linear, excess_n);
    TipStep {
        displacement_m,
        bristle_m: (load.bristle_m + displacement_m) / (1.0 + yielding * displacement_m),
    }
}

/// The root s of square s² + linear s = rest that is not negative.
pub fn positive_root(square: f64, linear: f64, rest: f64) -> f64 {
    let root = (linear * linear + 4.0 * square * rest).sqrt();
    // Both forms of the same root; each loses digits where the other does not.
    if linear > 0.0 {
        2.0 * rest / (linear + root)
    } else {
        (root - linear) / (2.0 * square)
    }
}

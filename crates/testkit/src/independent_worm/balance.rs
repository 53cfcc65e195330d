//! The true energy balance of an independent worm.

/// Sums since the worm was laid down. A difference of two is the balance between them.
#[derive(Debug, Clone)]
pub struct TrueBalance {
    /// Mean position of the cells, m.
    pub mean_m: f64,
    /// Distance that each tip slid forward, m.
    pub forward_slide_m: Vec<f64>,
    /// Distance that each tip slid backward, m, counted positive.
    pub backward_slide_m: Vec<f64>,
    /// Σ k |δ| |ΔX_C|, J.
    pub friction_j: f64,
    /// Work against the weight, J.
    pub weight_j: f64,
    /// Net actuator work by (13), J: Σ ∫ (k δ + m g sin λ) d(extension).
    pub actuator_net_j: f64,
    /// The positive part of it, J.
    pub actuator_positive_j: f64,
    /// Work of the cam, inertia and damping included, J.
    pub cam_j: f64,
    /// Energy lost in the dampers of the contacts, J.
    pub damping_j: f64,
}

impl TrueBalance {
    pub fn zero(cells: usize, mean_m: f64) -> Self {
        Self {
            mean_m,
            forward_slide_m: vec![0.0; cells],
            backward_slide_m: vec![0.0; cells],
            friction_j: 0.0,
            weight_j: 0.0,
            actuator_net_j: 0.0,
            actuator_positive_j: 0.0,
            cam_j: 0.0,
            damping_j: 0.0,
        }
    }

    /// Net displacement, m.
    pub fn advance_m(&self) -> f64 {
        self.mean_m
    }

    /// Energy by losses and weight (11), J.
    pub fn loss_j(&self) -> f64 {
        self.friction_j + self.weight_j
    }

    /// `self + fraction (other − self)`, each entry.
    pub fn interpolate(&self, other: &Self, fraction: f64) -> Self {
        self.with(other, |a, b| a + fraction * (b - a))
    }

    /// The balance since `earlier`.
    pub fn since(&self, earlier: &Self) -> Self {
        self.with(earlier, |now, then| now - then)
    }

    fn with(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        let each = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(&a, &b)| of(a, b)).collect();
        Self {
            mean_m: of(self.mean_m, other.mean_m),
            forward_slide_m: each(&self.forward_slide_m, &other.forward_slide_m),
            backward_slide_m: each(&self.backward_slide_m, &other.backward_slide_m),
            friction_j: of(self.friction_j, other.friction_j),
            weight_j: of(self.weight_j, other.weight_j),
            actuator_net_j: of(self.actuator_net_j, other.actuator_net_j),
            actuator_positive_j: of(self.actuator_positive_j, other.actuator_positive_j),
            cam_j: of(self.cam_j, other.cam_j),
            damping_j: of(self.damping_j, other.damping_j),
        }
    }
}

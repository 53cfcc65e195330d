//! The worm of the paper, as both simulated worms take it, and the limits at which a simulation is given up.
//!
//! The figures are written down here once more, and not taken from the library, because what judges the library must not
//! inherit its mistakes.

/// Standard gravity as the paper rounds it, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;
/// Mass of the whole worm, kg.
pub const MASS_KG: f64 = 0.333;
/// Stiffness of one contact, N/m.
pub const STIFFNESS_N_PER_M: f64 = 980.0;
/// Largest deformation of a tip, m.
pub const MAX_DEFORMATION_M: f64 = 1.75e-3;
/// Stroke of the cam, m.
pub const STROKE_M: f64 = 0.0115;
/// Distance between neighbouring cells at rest, m.
pub const SPACING_M: f64 = 0.040;
/// Damping of the contacts; 1 is critical for the body on all its tips.
pub const DAMPING_RATIO: f64 = 0.3;

/// Time over which the worm's weight comes onto its tips as it is laid down, s.
pub const LOWERING_S: f64 = 0.1;
/// Speed of the body beyond which the tips have lost their hold, m/s: several times what any gait here gives it.
pub const MAX_BODY_SPEED_M_S: f64 = 0.5;
/// Time after which a motor that does not get to its last phase is given up, in mean cycles for each cycle wanted.
pub const TIMEOUT_CYCLES: f64 = 10.0;

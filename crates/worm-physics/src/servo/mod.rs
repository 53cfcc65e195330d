//! A position-controlled servo on a bench: its motor, its gears, its own position loop, and an arm with a mass at the end.
//!
//! All at the output shaft. With duty D in [−1, 1] of the supply V, winding R and torque constant k,
//!
//! ```text
//! I = (D V − k ω) / R          D = P (goal − angle) / (256 · 885), counts of 2π/4096, clipped to ±1
//! (Jᵣ + Jₐ) dω/dt = k I − g (m l + ½ mₐ l) sin θ − friction(ω, load)
//! ```
//! where Jᵣ is the rotor's inertia behind the gears and Jₐ = m l² + ⅓ mₐ l² that of the arm. Angle 0 hangs down. With the torque switched
//! off the winding is open and the arm falls. Friction is dry and viscous; [`ServoLaws`] holds everything that this leaves out, one
//! effect each, as [`crate::effect::SERVO_LIBRARY`] lists them.
//!
//! The position loop is the one of the DYNAMIXEL X series with I and D gain 0; 885 is its largest PWM value.
//!
//! - [`physics`]: what a servo and its bench are; [`laws`]: what may be missing.
//! - [`motion`]: the motion under a goal, step by step.
//! - [`identified`]: a real servo. [`delay`]: what the loop acts on.

pub mod delay;
pub mod identified;
pub mod laws;
pub mod motion;
pub mod physics;
#[cfg(test)]
mod tests;

pub use laws::{Ripple, ServoLaws};
pub use motion::{Command, Energy, LONGEST_STEP_S, ServoMotion};
pub use physics::{COUNT_RAD, COUNTS_PER_TURN, Pendulum, SPEED_COUNT_RAD_S, ServoMotor, ServoPhysics};

//! The drive: the cam, and the motor that turns it unevenly.

use std::f64::consts::TAU;

/// The cam: one cell after the other moves forward by the stroke, linearly in the phase.
#[derive(Debug, Clone)]
pub struct Cam {
    pub stroke_m: f64,
    /// Cells counted from 0, in the order in which they step.
    pub step_order: Vec<usize>,
    /// Fraction of a step in which a cell accelerates, and again in which it stops, below 0.5: no cam has sharp corners. Steps do
    /// not overlap; two cells that moved at once would cost a part of the advance.
    pub rounding: f64,
}

impl Cam {
    pub fn new(stroke_m: f64, step_order: Vec<usize>) -> Self {
        Self {
            stroke_m,
            step_order,
            rounding: 0.01,
        }
    }

    pub fn cells(&self) -> usize {
        self.step_order.len()
    }

    /// How far each cell stands ahead of where it stood in the body at phase 0, m; `phase` in gait cycles.
    pub fn extensions_m(&self, phase: f64, extensions_m: &mut [f64]) {
        let cells = self.cells() as f64;
        for (slot, &cell) in self.step_order.iter().enumerate() {
            let steps = phase * cells - slot as f64;
            let turns = (steps / cells).floor();
            extensions_m[cell] = self.stroke_m * (turns + self.fraction(steps - turns * cells));
        }
    }

    /// Fraction of its stroke that a cell has made so many steps after its own began: constant acceleration, speed and braking.
    fn fraction(&self, steps: f64) -> f64 {
        let rounding = self.rounding;
        if steps >= 1.0 {
            1.0
        } else if steps < rounding {
            0.5 * steps.powi(2) / (rounding * (1.0 - rounding))
        } else if steps > 1.0 - rounding {
            1.0 - 0.5 * (1.0 - steps).powi(2) / (rounding * (1.0 - rounding))
        } else {
            (steps - 0.5 * rounding) / (1.0 - rounding)
        }
    }
}

/// The motor: how fast the cam turns.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Time of a gait cycle at the mean speed, s.
    pub cycle_s: f64,
    /// Fraction by which the speed varies once for each step.
    pub swing_per_step: f64,
    /// Fraction by which it varies once for each turn of the cam.
    pub swing_per_turn: f64,
    /// Fraction by which it varies slowly.
    pub wander: f64,
    /// Phase angles of the variations, rad: by step, by turn, and three slow waves.
    pub angles_rad: [f64; 5],
    /// Time from rest to full speed and back, s.
    pub ramp_s: f64,
    /// Time at rest before the first step, s.
    pub rest_before_s: f64,
    /// Phase at rest, cycles.
    pub first_phase: f64,
    /// Phase at which the motor stops, cycles; infinite where it never does.
    pub last_phase: f64,
}

/// Frequencies of the slow waves, Hz: no two of them in step.
const WANDER_HZ: [f64; 3] = [0.071, 0.193, 0.417];

/// Fraction of the mean speed at which a braking motor reaches its last phase.
const CREEP: f64 = 0.01;

impl Drive {
    /// An even motor that starts after 0.3 s and never stops.
    pub fn even(cycle_s: f64) -> Self {
        Self {
            cycle_s,
            swing_per_step: 0.0,
            swing_per_turn: 0.0,
            wander: 0.0,
            angles_rad: [0.0; 5],
            ramp_s: 0.1,
            rest_before_s: 0.3,
            first_phase: 0.0,
            last_phase: f64::INFINITY,
        }
    }

    /// Speed at a phase before the last and a time, cycles/s.
    pub fn speed(&self, phase: f64, time_s: f64, cells: usize) -> f64 {
        if time_s <= self.rest_before_s {
            return 0.0;
        }
        let [by_step, by_turn, slow @ ..] = self.angles_rad;
        let waves = WANDER_HZ.iter().zip(slow);
        let slow: f64 = waves.map(|(hz, angle)| (TAU * hz * time_s + angle).sin()).sum();
        let swing = 1.0
            + self.swing_per_step * (TAU * phase * cells as f64 + by_step).sin()
            + self.swing_per_turn * (TAU * phase + by_turn).sin()
            + self.wander * slow;
        let starting = ((time_s - self.rest_before_s) / self.ramp_s).min(1.0);
        let left = (self.last_phase - phase).max(0.0);
        let braking = (2.0 * left * self.cycle_s / self.ramp_s).sqrt().max(CREEP);
        (swing * starting).min(braking) / self.cycle_s
    }
}

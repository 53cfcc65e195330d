//! What truly happened in a recording.

use super::balance::TrueBalance;
use super::body::Body;
use super::cam::Cam;

/// One whole gait cycle, from one whole number of the phase to the next.
#[derive(Debug, Clone)]
pub struct TrueCycle {
    pub start_s: f64,
    pub end_s: f64,
    pub balance: TrueBalance,
}

/// Everything there is to know of a recording.
#[derive(Debug, Clone)]
pub struct Truth {
    /// Largest deformation of each tip, m, forward.
    pub max_deformation_m: Vec<f64>,
    pub mass_kg: f64,
    pub stroke_m: f64,
    /// Cells from 1, in the order in which they step; the first begins at whole numbers of the phase.
    pub step_order: Vec<usize>,
    /// Every whole gait cycle within the recording.
    pub cycles: Vec<TrueCycle>,
    /// Phase at each sample of the recording, cycles.
    pub sample_phase: Vec<f64>,
    /// Position at each sample before the camera spoilt it, m: `[cell][sample]`.
    pub sample_position_m: Vec<Vec<f64>>,
    /// Energy in springs and motion at the first and the last row, J.
    pub stored_j: [f64; 2],
    time_s: Vec<f64>,
    phase: Vec<f64>,
    balances: Vec<TrueBalance>,
}

impl Truth {
    /// Nothing has happened yet.
    pub fn beginning(body: &Body, cam: &Cam) -> Self {
        Self {
            max_deformation_m: body.forward_bound_m.clone(),
            mass_kg: body.mass_kg,
            stroke_m: cam.stroke_m,
            step_order: cam.step_order.iter().map(|cell| cell + 1).collect(),
            cycles: Vec::new(),
            sample_phase: Vec::new(),
            sample_position_m: vec![Vec::new(); cam.cells()],
            stored_j: [0.0; 2],
            time_s: Vec::new(),
            phase: Vec::new(),
            balances: Vec::new(),
        }
    }

    /// Keeps how things stand; times must grow.
    pub fn push(&mut self, time_s: f64, phase: f64, balance: TrueBalance) {
        self.time_s.push(time_s);
        self.phase.push(phase);
        self.balances.push(balance);
    }

    /// What happened between two times of the recording, s.
    pub fn over(&self, start_s: f64, end_s: f64) -> TrueBalance {
        let at = |time_s: f64| {
            let (row, fraction) = place(&self.time_s, time_s);
            self.balances[row].interpolate(&self.balances[row + 1], fraction)
        };
        at(end_s).since(&at(start_s))
    }

    /// Phase at a time of the recording, cycles.
    pub fn phase_at(&self, time_s: f64) -> f64 {
        let (row, fraction) = place(&self.time_s, time_s);
        self.phase[row] + fraction * (self.phase[row + 1] - self.phase[row])
    }

    /// What happened over all of the recording.
    pub fn overall(&self) -> TrueBalance {
        self.balances[self.balances.len() - 1].since(&self.balances[0])
    }

    /// Finds the whole cycles among the rows. A cycle begins where the phase leaves its whole number and ends where it
    /// reaches the next, so rest at either end belongs to none.
    pub fn find_cycles(&mut self) {
        let (first, last) = (self.phase[0], self.phase[self.phase.len() - 1]);
        let between = |row: usize, phase: f64| {
            let way = self.phase[row + 1] - self.phase[row];
            let fraction = if way > 0.0 {
                (phase - self.phase[row]) / way
            } else {
                0.0
            };
            self.time_s[row] + fraction * (self.time_s[row + 1] - self.time_s[row])
        };
        let leaves = |phase: f64| between(self.phase.partition_point(|&at| at <= phase) - 1, phase);
        let reaches = |phase: f64| between(self.phase.partition_point(|&at| at < phase) - 1, phase);
        self.cycles = (first.ceil() as i64..last.floor() as i64)
            .map(|number| {
                let (start_s, end_s) = (leaves(number as f64), reaches(number as f64 + 1.0));
                TrueCycle {
                    start_s,
                    end_s,
                    balance: self.over(start_s, end_s),
                }
            })
            .collect();
    }
}

/// The row before a value in a series that does not fall, and how far on the way to the next row it lies; a value outside
/// is taken to the nearer end.
fn place(series: &[f64], value: f64) -> (usize, f64) {
    let row = series
        .partition_point(|&entry| entry <= value)
        .clamp(1, series.len() - 1)
        - 1;
    let way = series[row + 1] - series[row];
    let fraction = if way > 0.0 { (value - series[row]) / way } else { 0.0 };
    (row, fraction.clamp(0.0, 1.0))
}

//! The ground truth about energy and distance, which no estimator knows: kept by the plant, reported at the end.

use super::motor::StepEnergy;
use serde::Serialize;
use std::collections::VecDeque;
use worm_physics as model;

/// Cycles that are kept one by one; older ones are in the total only. More than two days of crawling.
const KEPT_CYCLES: usize = 100_000;

/// What was spent and gained over a stretch of time. Energies in J, distances in m.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PlantLedger {
    /// Duration, s.
    pub duration_s: f64,
    /// Travelled gait phase, cycles, signed.
    pub cycles: f64,
    /// Mean advance of the cells.
    pub advance_m: f64,
    /// Losses (11): sliding, and work against weight and resisting force; without the heat of a slide that a fault
    /// imposes, which is not the worm's to pay.
    pub loss_j: f64,
    /// Net actuator work (13).
    pub actuator_net_j: f64,
    /// Positive part of the actuator work (13), the paper's energy.
    pub actuator_positive_j: f64,
    /// ∫ V·D·I dt at the motor's bridge.
    pub electrical_j: f64,
    /// ∫ I²·R dt in the winding.
    pub copper_j: f64,
    /// Friction inside the device.
    pub friction_inside_j: f64,
    /// Change of the motor's kinetic energy.
    pub kinetic_j: f64,
    /// Distance each tip slid forward.
    pub forward_slide_m: Vec<f64>,
    /// Distance each tip slid backward, positive.
    pub backward_slide_m: Vec<f64>,
}

/// Sums that only grow, from which accounts are differences.
#[derive(Debug, Clone, Default)]
struct Sums {
    time_s: f64,
    phase: f64,
    mean_position_m: f64,
    dragged_m: f64,
    energy: StepEnergy,
    model: model::Ledger,
}

/// Every cycle's account and the total.
#[derive(Debug, Clone)]
pub struct TruthLedger {
    cells: usize,
    energy: StepEnergy, // summed over all steps
    at_start: Sums,
    at_cycle_start: Sums,
    cycles: VecDeque<PlantLedger>,
    forgotten_cycles: u64,
}

/// Where the plant stands when an account is closed.
pub(super) struct Standing<'a> {
    pub(super) time_s: f64,
    pub(super) phase: f64,
    pub(super) mean_position_m: f64,
    pub(super) dragged_m: f64,
    pub(super) model: &'a model::Ledger,
}

impl TruthLedger {
    pub(super) fn new(cells: usize, standing: &Standing<'_>) -> Self {
        let start = Sums::of(StepEnergy::default(), standing);
        Self {
            cells,
            energy: StepEnergy::default(),
            at_start: start.clone(),
            at_cycle_start: start,
            cycles: VecDeque::new(),
            forgotten_cycles: 0,
        }
    }

    pub(super) fn add(&mut self, step: &StepEnergy) {
        self.energy.electrical_j += step.electrical_j;
        self.energy.copper_j += step.copper_j;
        self.energy.friction_j += step.friction_j;
        self.energy.kinetic_j += step.kinetic_j;
    }

    pub(super) fn close_cycle(&mut self, standing: &Standing<'_>) {
        let now = Sums::of(self.energy, standing);
        if self.cycles.len() == KEPT_CYCLES {
            self.cycles.pop_front();
            self.forgotten_cycles += 1;
        }
        self.cycles.push_back(now.since(&self.at_cycle_start, self.cells));
        self.at_cycle_start = now;
    }

    pub(super) fn total(&self, standing: &Standing<'_>) -> PlantLedger {
        Sums::of(self.energy, standing).since(&self.at_start, self.cells)
    }

    /// The completed cycles that are kept, oldest first.
    pub fn cycles(&self) -> &VecDeque<PlantLedger> {
        &self.cycles
    }

    /// Cycles that were completed but are not kept any more.
    pub fn forgotten_cycles(&self) -> u64 {
        self.forgotten_cycles
    }
}

impl Sums {
    fn of(energy: StepEnergy, standing: &Standing<'_>) -> Self {
        Self {
            time_s: standing.time_s,
            phase: standing.phase,
            mean_position_m: standing.mean_position_m,
            dragged_m: standing.dragged_m,
            energy,
            model: standing.model.clone(),
        }
    }

    fn since(&self, earlier: &Self, cells: usize) -> PlantLedger {
        let model = self.model.since(&earlier.model);
        PlantLedger {
            duration_s: self.time_s - earlier.time_s,
            cycles: self.phase - earlier.phase,
            advance_m: self.mean_position_m - earlier.mean_position_m,
            loss_j: model.loss_j(),
            actuator_net_j: model.actuator_net_j,
            actuator_positive_j: model.actuator_positive_j,
            electrical_j: self.energy.electrical_j - earlier.energy.electrical_j,
            copper_j: self.energy.copper_j - earlier.energy.copper_j,
            friction_inside_j: self.energy.friction_j - earlier.energy.friction_j,
            kinetic_j: self.energy.kinetic_j - earlier.energy.kinetic_j,
            forward_slide_m: model.forward_slide_m[..cells].to_vec(),
            backward_slide_m: model.backward_slide_m[..cells]
                .iter()
                .map(|slide_m| slide_m + self.dragged_m - earlier.dragged_m)
                .collect(),
        }
    }
}

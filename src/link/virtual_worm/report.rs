//! The truth as JSON, for `--ledger FILE` and for tests that hold the estimator against it.

use super::devices::Devices;
use super::ledger::PlantLedger;
use serde::Serialize;

/// Everything that the virtual worm knows about what happened. SI units; energies as in [`PlantLedger`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VirtualWormReport {
    /// Simulated time, s.
    pub time_s: f64,
    /// When the worm began to crawl, s; null when it never did.
    pub crawl_began_s: Option<f64>,
    /// The same moment on `CLOCK_MONOTONIC`, ns; null in virtual time.
    pub crawl_began_ns: Option<u64>,
    /// Gait phase reached, cycles.
    pub phase: f64,
    /// Charge left, share; 1 without a battery.
    pub charge_share: f64,
    /// Temperature of the servo, °C.
    pub servo_c: f64,
    /// Everything since the start.
    pub total: PlantLedger,
    /// Completed cycles that are missing below, because they are too many.
    pub forgotten_cycles: u64,
    /// The completed cycles, oldest first.
    pub cycles: Vec<PlantLedger>,
}

impl Devices {
    /// What happened so far.
    pub fn report(&self) -> VirtualWormReport {
        let plant = self.plant();
        VirtualWormReport {
            time_s: plant.time_s(),
            crawl_began_s: self.crawl_began_s(),
            crawl_began_ns: self.crawl_began_ns,
            phase: plant.body().phase(),
            charge_share: plant.supply().charge_share(),
            servo_c: plant.motor().case_c(),
            total: plant.total(),
            forgotten_cycles: plant.ledger().forgotten_cycles(),
            cycles: plant.ledger().cycles().iter().cloned().collect(),
        }
    }
}

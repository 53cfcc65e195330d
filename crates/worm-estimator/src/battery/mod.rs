//! The battery: its open-circuit voltage, and how much is left in it.
//!
//! - [`OpenCircuit`]: voltage without load over the energy that is left, by chemistry or by a table.
//! - [`ChargeEstimate`]: the energy that is left and what the battery really holds, from voltages, counted energy and a gauge.
//!
//! Shares of the battery are shares of its *energy*: a joule is worth the same when the battery is full and when it is nearly empty.
//! The battery loses I² R in its internal resistance on top of what the bus gets.

mod charge;
mod curve;

pub use charge::{ChargeEstimate, Spread};
pub use curve::OpenCircuit;

/// Current that a battery gives for a load on the bus, and the voltage there. The greatest power that it can give is V²/4R; of a load
/// beyond that there is `None`.
pub fn under_load(open_circuit_v: f64, resistance_ohm: f64, load_w: f64) -> Option<(f64, f64)> {
    let root = open_circuit_v * open_circuit_v - 4.0 * resistance_ohm * load_w;
    let bus_v = 0.5 * (open_circuit_v + root.sqrt());
    (root >= 0.0 && bus_v > 0.0).then(|| (load_w / bus_v, bus_v))
}

//! Every design of a grid on a route, and the best of them.
//!
//! The grid spans number of cells × stiffness × step order × time of a gait cycle. Everything but the time needs a steady cycle of the
//! exact motion on every slope of the route; the time then costs hardly anything, for the exact motion has no clock. Mechanisms are spread
//! over all processors, and the result does not depend on how many there are.
//!
//! A worm steps one cell at a time, so a wave is an order of the cells. Two orders that differ only in which cell comes first are the same
//! steady crawl. Where all cells are equal, every order is.
//!
//! A design counts where it crawls every leg, the motor's limits allow it, and the battery's voltage suffices with the reserve left in it.
//! Its energy counts at the voltage of a half full battery; [`trip`](super::trip()) then is exact about the winner.

use super::design::{Design, LegFailure, SlopeMechanics, Workbench};
use super::route::{Leg, Route};
use rayon::prelude::*;
use serde::Serialize;
use worm_physics::MAX_CELLS;

/// Most step orders of one number of cells that are tried one by one: those of up to six cells.
const MAX_ORDERS: usize = 120;
/// Most designs of a search.
const MAX_DESIGNS: usize = 20_000_000;
/// Share of the battery at which the energies of designs are compared.
const COMPARED_AT_SHARE: f64 = 0.5;

/// What is searched.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bounds {
    /// Numbers of cells.
    pub cells: Vec<usize>,
    /// Shortest and longest gait cycle, s.
    pub cycle_s: [f64; 2],
    /// Least and greatest stiffness over the configured one.
    pub stiffness_factor: [f64; 2],
    /// Values of each of the two, evenly spaced by ratio.
    pub steps: usize,
}

/// Why bounds are refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BoundsError {
    /// A number of cells that no worm has.
    #[error("{0} cells: a worm has 2 to {MAX_CELLS}")]
    Cells(usize),
    /// Nothing to try.
    #[error("no number of cells: give at least one")]
    NoCells,
    /// A range of times is not usable.
    #[error("gait cycles from {0} to {1} s: give two times from 0.5 to 120 s, the shorter one first")]
    Cycle(f64, f64),
    /// A range of stiffnesses is not usable.
    #[error("stiffness factors from {0} to {1}: give two factors from 0.01 to 100, the smaller one first")]
    Stiffness(f64, f64),
    /// Too few or too many values.
    #[error("{0} values of a range: give 1 to 1000")]
    Steps(usize),
    /// Too many designs.
    #[error("{0} designs are too many: give fewer cells or steps, for at most {MAX_DESIGNS}")]
    TooMany(usize),
}

impl Bounds {
    fn check(&self) -> Result<(), BoundsError> {
        if let Some(&cells) = self.cells.iter().find(|cells| !(2..=MAX_CELLS).contains(*cells)) {
            return Err(BoundsError::Cells(cells));
        }
        let [low, high] = self.cycle_s;
        if !(0.5 <= low && low <= high && high <= 120.0) {
            return Err(BoundsError::Cycle(low, high));
        }
        let [low, high] = self.stiffness_factor;
        if !(0.01 <= low && low <= high && high <= 100.0) {
            return Err(BoundsError::Stiffness(low, high));
        }
        if self.cells.is_empty() {
            return Err(BoundsError::NoCells);
        }
        if !(1..=1000).contains(&self.steps) {
            return Err(BoundsError::Steps(self.steps));
        }
        Ok(())
    }

    /// The values of a range, evenly spaced by ratio; one value is the lower end.
    fn values(&self, range: [f64; 2]) -> Vec<f64> {
        let [low, high] = range;
        let intervals = self.steps.saturating_sub(1);
        if intervals == 0 || low == high {
            return vec![low];
        }
        let ratio = high / low;
        // The ends are exact.
        let inner = (1..intervals).map(|step| low * ratio.powf(step as f64 / intervals as f64));
        std::iter::once(low).chain(inner).chain([high]).collect()
    }
}

/// A design that makes the trip.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// The design.
    #[serde(flatten)]
    pub design: Design,
    /// Mean stiffness of a cell's contact, N/m.
    pub stiffness_n_per_m: f64,
    /// Energy out of the battery, J, at the voltage of a half full one.
    pub energy_j: f64,
    /// Time, s.
    pub time_s: f64,
}

/// What a search found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Search {
    /// What was searched.
    pub bounds: Bounds,
    /// Designs tried.
    pub designs: usize,
    /// Designs that make the trip, whether or not the battery holds enough.
    pub feasible: usize,
    /// The one of least energy.
    pub best: Option<Candidate>,
    /// Quantities of the best design that lie at an end of their range, where a wider range may hold a better one.
    pub best_is_at_the_end_of: Vec<&'static str>,
    /// The trade-off: no design is faster for less energy. The fastest first.
    pub front: Vec<Candidate>,
    /// For each number of cells and stiffness the design of least energy, for a picture.
    #[serde(skip)]
    pub cheapest_by_mechanism: Vec<Candidate>,
    /// Remarks.
    pub notes: Vec<String>,
}

/// Tries every design of the grid.
///
/// # Errors
/// [`BoundsError`].
pub fn search(bench: &Workbench, route: &Route, bounds: &Bounds) -> Result<Search, BoundsError> {
    bounds.check()?;
    let mut notes = Vec::new();
    let mut mechanisms = Vec::new();
    for &cells in &bounds.cells {
        let orders = orders(bench, cells, &mut notes);
        for stiffness_factor in bounds.values(bounds.stiffness_factor) {
            mechanisms.extend(orders.iter().map(|order| Design {
                cells,
                cycle_s: f64::NAN,
                stiffness_factor,
                step_order: order.clone(),
            }));
        }
    }
    let cycles_s = bounds.values(bounds.cycle_s);
    let designs = mechanisms.len().saturating_mul(cycles_s.len());
    if designs > MAX_DESIGNS {
        return Err(BoundsError::TooMany(designs));
    }
    let legs = joined(route);
    let tried: Vec<Vec<Candidate>> = mechanisms
        .par_iter()
        .map(|mechanism| candidates(bench, &legs, mechanism, &cycles_s))
        .collect();
    let feasible = tried.iter().map(Vec::len).sum();
    let by_energy = |a: &&Candidate, b: &&Candidate| a.energy_j.total_cmp(&b.energy_j);
    let cheapest_by_mechanism: Vec<Candidate> = tried
        .iter()
        .filter_map(|of| of.iter().min_by(by_energy).cloned())
        .collect();
    let best = cheapest_by_mechanism.iter().min_by(by_energy).cloned();
    Ok(Search {
        designs,
        feasible,
        best_is_at_the_end_of: best.as_ref().map_or_else(Vec::new, |best| ends(bounds, &best.design)),
        best,
        front: front(tried.into_iter().flatten().collect()),
        cheapest_by_mechanism,
        notes,
        bounds: bounds.clone(),
    })
}

/// Lengths of the route by slope and speed, each pair of them once.
fn joined(route: &Route) -> Vec<Leg> {
    let mut legs: Vec<Leg> = route.legs().to_vec();
    let cycle_s = |leg: &Leg| leg.cycle_s.unwrap_or_default();
    legs.sort_by(|a, b| {
        a.slope_deg
            .total_cmp(&b.slope_deg)
            .then(cycle_s(a).total_cmp(&cycle_s(b)))
    });
    legs.dedup_by(|next, leg| {
        let is_same = next.slope_deg == leg.slope_deg && next.cycle_s == leg.cycle_s;
        if is_same {
            leg.length_m += next.length_m;
        }
        is_same
    });
    legs
}

/// The designs of one mechanism that make the trip, one for each time of a gait cycle at most.
fn candidates(bench: &Workbench, legs: &[Leg], mechanism: &Design, cycles_s: &[f64]) -> Vec<Candidate> {
    let mechanics = |design: &Design| -> Result<Vec<SlopeMechanics>, LegFailure> {
        let on = |leg: &Leg| {
            let design = Design {
                cycle_s: leg.cycle_s(design.cycle_s),
                ..design.clone()
            };
            bench.mechanics(&design, leg.slope_deg)
        };
        legs.iter().map(on).collect()
    };
    let at = |cycle_s: f64| Design {
        cycle_s,
        ..mechanism.clone()
    };
    let candidate = |cycle_s: f64, mechanics: &[SlopeMechanics]| {
        let (mut energy_j, mut time_s) = (0.0, 0.0);
        for (mechanics, leg) in mechanics.iter().zip(legs) {
            let cycle_s = leg.cycle_s(cycle_s);
            let cost = bench.cost(mechanics, cycle_s).ok()?;
            bench.battery_factor(&cost, cycle_s, bench.battery.reserve_share).ok()?;
            let factor = bench.battery_factor(&cost, cycle_s, COMPARED_AT_SHARE).ok()?;
            let cycles = leg.length_m / cost.advance_m;
            energy_j += cycles * factor * bench.bus_j(&cost, cycle_s);
            time_s += cycles * cycle_s;
        }
        Some(Candidate {
            stiffness_n_per_m: bench.stiffness_n_per_m(mechanism),
            design: at(cycle_s),
            energy_j,
            time_s,
        })
    };
    if bench.is_exact() {
        let Some(first) = cycles_s.first() else {
            return Vec::new();
        };
        let Ok(mechanics) = mechanics(&at(*first)) else {
            return Vec::new();
        };
        return cycles_s
            .iter()
            .filter_map(|&cycle_s| candidate(cycle_s, &mechanics))
            .collect();
    }
    let each = cycles_s.iter();
    each.filter_map(|&cycle_s| candidate(cycle_s, &mechanics(&at(cycle_s)).ok()?))
        .collect()
}

/// The step orders to try for a number of cells, from 1; the first is the configured or natural one.
fn orders(bench: &Workbench, cells: usize, notes: &mut Vec<String>) -> Vec<Vec<usize>> {
    let configured = bench.configured();
    let first = if cells == configured.cells {
        configured.step_order
    } else {
        (1..=cells).collect()
    };
    if bench.has_equal_cells(cells) {
        return vec![first];
    }
    let mut orders = vec![first.clone()];
    let rotations: usize = (1..cells).product();
    if rotations <= MAX_ORDERS {
        // The first cell stays: the others in every order.
        let mut rest = first[1..].to_vec();
        rest.sort_unstable();
        loop {
            let order = [&first[..1], &rest].concat();
            if order != first {
                orders.push(order);
            }
            if !next_permutation(&mut rest) {
                break;
            }
        }
    } else {
        orders.push([&first[..1], &first[1..].iter().rev().copied().collect::<Vec<_>>()].concat());
        for a in 1..cells {
            for b in a + 1..cells {
                let mut order = first.clone();
                order.swap(a, b);
                orders.push(order);
            }
        }
        notes.push(format!(
            "{cells} unequal cells have {rotations} step orders: tried are the first one, its reverse, and each that swaps two cells of it"
        ));
    }
    orders
}

/// The next order in the dictionary; false after the last.
fn next_permutation(values: &mut [usize]) -> bool {
    let Some(pivot) = (1..values.len()).rev().find(|&at| values[at - 1] < values[at]) else {
        return false;
    };
    let above = (pivot..values.len()).rev().find(|&at| values[at] > values[pivot - 1]);
    values.swap(pivot - 1, above.unwrap_or(pivot));
    values[pivot..].reverse();
    true
}

/// Quantities that lie at an end of their range.
fn ends(bounds: &Bounds, design: &Design) -> Vec<&'static str> {
    let is_end = |value: f64, [low, high]: [f64; 2]| low < high && (value == low || value == high);
    let cells = [
        bounds.cells.iter().min().copied().unwrap_or_default(),
        bounds.cells.iter().max().copied().unwrap_or_default(),
    ];
    [
        ("cells", is_end(design.cells as f64, cells.map(|cells| cells as f64))),
        ("cycle_s", is_end(design.cycle_s, bounds.cycle_s)),
        (
            "stiffness_factor",
            is_end(design.stiffness_factor, bounds.stiffness_factor),
        ),
    ]
    .into_iter()
    .filter_map(|(name, is_end)| is_end.then_some(name))
    .collect()
}

/// The designs of which none is faster for less energy, the fastest first.
fn front(mut candidates: Vec<Candidate>) -> Vec<Candidate> {
    candidates.sort_by(|a, b| a.time_s.total_cmp(&b.time_s).then(a.energy_j.total_cmp(&b.energy_j)));
    let mut least_j = f64::INFINITY;
    candidates.retain(|candidate| {
        let is_better = candidate.energy_j < least_j;
        least_j = least_j.min(candidate.energy_j);
        is_better
    });
    candidates
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trip;
    use std::path::Path;
    use worm_estimator::config::Config;

    const UNEQUAL: &str = "worm.max_deformation_m = [0.0020, 0.0011, 0.00175, 0.00215]\n";

    fn bench(toml: &str) -> Workbench {
        let config = Config::from_toml(toml, Path::new("test.toml")).expect("a valid configuration");
        Workbench::new(&config).expect("a worm")
    }

    fn route() -> Route {
        Route::from_csv("length_m,slope_deg\n1,0\n0.5,30\n", Path::new("route.csv")).expect("a route")
    }

    fn bounds() -> Bounds {
        Bounds {
            cells: vec![3, 4, 5],
            cycle_s: [1.0, 8.0],
            stiffness_factor: [0.5, 4.0],
            steps: 7,
        }
    }

    #[test]
    fn best_and_front_are_those_of_all_designs() {
        let bench = bench("battery.hotel_power_w = 0.05\n");
        let found = search(&bench, &route(), &bounds()).expect("valid bounds");
        assert_eq!(found.designs, 3 * 7 * 7);
        assert!(found.feasible > 50 && found.feasible <= found.designs);
        let best = found.best.expect("some make the trip");
        // One by one, without the front: the energy of a trip that begins a little above a half full battery is nearly that of the search.
        let values = bounds();
        for cells in [3, 4, 5] {
            for stiffness_factor in values.values(values.stiffness_factor) {
                for cycle_s in values.values(values.cycle_s) {
                    let design = Design {
                        cells,
                        cycle_s,
                        stiffness_factor,
                        step_order: (1..=cells).collect(),
                    };
                    let Some(energy_j) = trip(&bench, &design, &route(), 0.55).energy_j else {
                        continue;
                    };
                    let time_s = cycle_s * trip(&bench, &design, &route(), 0.55).cycles.expect("it arrives");
                    assert!(energy_j.mean > 0.98 * best.energy_j, "{design:?}: {energy_j:?}");
                    let faster = found
                        .front
                        .iter()
                        .filter(|on_front| on_front.time_s <= 1.000_001 * time_s);
                    let least_j = faster.map(|on_front| on_front.energy_j).fold(f64::INFINITY, f64::min);
                    assert!(least_j < 1.02 * energy_j.mean, "{design:?} is better than the front");
                }
            }
        }
        assert!(
            found
                .front
                .windows(2)
                .all(|pair| pair[0].time_s < pair[1].time_s && pair[0].energy_j > pair[1].energy_j)
        );
        assert!(
            found.best_is_at_the_end_of.contains(&"stiffness_factor"),
            "stiffer is better in this model"
        );
    }

    /// Hotel power makes slow worms dear.
    #[test]
    fn more_hotel_power_makes_the_best_worm_faster() {
        let best = |toml: &str| {
            let found = search(&bench(toml), &route(), &bounds()).expect("valid bounds");
            found.best.expect("some make the trip").design.cycle_s
        };
        assert!(best("battery.hotel_power_w = 0\n") > best("battery.hotel_power_w = 2\n"));
    }

    #[test]
    fn orders_are_tried_where_they_matter() {
        let mut notes = Vec::new();
        assert_eq!(orders(&bench(""), 4, &mut notes), [[1, 2, 3, 4]]);
        let unequal = bench(UNEQUAL);
        let four = orders(&unequal, 4, &mut notes);
        assert_eq!((four.len(), &four[0]), (6, &vec![1, 2, 3, 4]));
        assert!(four.iter().all(|order| order[0] == 1) && orders(&unequal, 5, &mut notes).len() == 1);
        let only = Bounds {
            cells: vec![4],
            stiffness_factor: [1.0, 1.0],
            ..bounds()
        };
        let found = search(&unequal, &route(), &only).expect("valid bounds");
        assert_eq!(found.designs, 6 * 7);
        let configured = trip(
            &unequal,
            &Design {
                cycle_s: 1.0,
                ..unequal.configured()
            },
            &route(),
            0.55,
        );
        let best_j = found.best.expect("some make the trip").energy_j;
        assert!(best_j <= 1.001 * configured.energy_j.expect("it arrives").mean && notes.is_empty());
    }

    #[test]
    fn bounds_that_make_no_sense_are_refused() {
        for (bounds, expected) in [
            (
                Bounds {
                    cells: vec![1],
                    ..bounds()
                },
                "1 cells: a worm has 2 to 16",
            ),
            (
                Bounds {
                    cells: vec![],
                    ..bounds()
                },
                "no number of cells",
            ),
            (
                Bounds {
                    cycle_s: [3.0, 1.0],
                    ..bounds()
                },
                "gait cycles from 3 to 1 s",
            ),
            (
                Bounds {
                    stiffness_factor: [0.0, 1.0],
                    ..bounds()
                },
                "stiffness factors from 0 to 1",
            ),
            (Bounds { steps: 0, ..bounds() }, "0 values of a range"),
        ] {
            let error = search(&bench(""), &route(), &bounds).expect_err(expected).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}

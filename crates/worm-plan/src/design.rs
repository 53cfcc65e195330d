//! Designs: what varies, and what a design costs on a slope.

use serde::Serialize;
use std::fmt;
use worm_estimator::battery::{OpenCircuit, under_load};
use worm_estimator::config::{Battery, Config, PhysicsError};
use worm_physics::effect::Setting;
use worm_physics::study::design as with_cells;
use worm_physics::{Contact, DriveLoad, Motor, Physics, Worm, driven_cycle};

/// A design: the configured worm with another number of cells, another stiffness, order and speed. What stays is in
/// [`worm_physics::study`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Design {
    /// Number of cells.
    pub cells: usize,
    /// Time of a gait cycle, s.
    pub cycle_s: f64,
    /// Stiffness of the contacts over the configured one. The friction force stays, so the largest deformation shrinks as it grows.
    pub stiffness_factor: f64,
    /// The order in which the cells step, from 1.
    pub step_order: Vec<usize>,
}

/// Why a leg cannot be crawled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "reason", rename_all = "kebab-case")]
pub enum LegFailure {
    /// The tips cannot hold the resting worm.
    CannotHold {
        /// Pull along the canal, N.
        pull_n: f64,
        /// What all tips hold together, N.
        hold_n: f64,
    },
    /// It ends each cycle further back than it began it.
    SlidesBack {
        /// Distance lost in each cycle, m.
        lost_m: f64,
    },
    /// The compliance of the tips uses up the stroke.
    StandsStill,
    /// The motor needs more current than its limits allow.
    Current {
        /// Greatest current, A.
        needed_a: f64,
        /// The lower one of `limits.current_a` and `servo.current_limit_a`, A.
        limit_a: f64,
    },
    /// The cam would turn faster than the servo allows.
    Velocity {
        /// Speed of the cam, rev/min.
        needed_rev_per_min: f64,
        /// `servo.velocity_limit_rev_per_min`.
        limit_rev_per_min: f64,
    },
    /// The bus has not the voltage that the motor needs at this speed and torque.
    Voltage {
        /// Voltage at the winding, V.
        needed_v: f64,
        /// Voltage of the bus under that load, V.
        bus_v: f64,
    },
    /// The voltage under load falls below the cut-off, or there is nothing left.
    BatteryEmpty {
        /// Distance into the leg, m.
        after_m: f64,
    },
}

impl fmt::Display for LegFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::CannotHold { pull_n, hold_n } => {
                write!(
                    f,
                    "cannot hold: the slope pulls with {:.2} N, and all tips hold {hold_n:.2} N",
                    pull_n.abs()
                )
            }
            Self::SlidesBack { lost_m } => write!(f, "slides back by {:.2} mm in each cycle", 1e3 * lost_m),
            Self::StandsStill => f.write_str("stands still: the compliance of the tips uses up the stroke"),
            Self::Current { needed_a, limit_a } => {
                write!(f, "the motor needs {needed_a:.2} A, and its limit is {limit_a:.2} A")
            }
            Self::Velocity {
                needed_rev_per_min,
                limit_rev_per_min,
            } => write!(
                f,
                "the cam turns with {needed_rev_per_min:.1} rev/min, and the servo's limit is {limit_rev_per_min:.1}"
            ),
            Self::Voltage { needed_v, bus_v } => {
                write!(
                    f,
                    "the motor needs {needed_v:.2} V at this speed, and the bus has {bus_v:.2} V"
                )
            }
            Self::BatteryEmpty { after_m } => write!(f, "the battery is empty after {after_m:.2} m of the leg"),
        }
    }
}

/// How a worm goes along its canal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Going {
    /// With its first cell ahead.
    Forward,
    /// With its last cell ahead: the cam turns the other way.
    Backward,
}

impl Going {
    /// The other one.
    pub const fn reversed(self) -> Self {
        match self {
            Self::Forward => Self::Backward,
            Self::Backward => Self::Forward,
        }
    }

    /// Sign of the cam's speed.
    pub const fn sign(self) -> f64 {
        match self {
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }
}

/// What a steady gait cycle does and needs on one slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlopeCost {
    /// Advance per cycle, m; above 0.
    pub advance_m: f64,
    /// Electrical energy of the motor, J.
    pub motor_j: f64,
    /// Greatest current of the motor, A.
    pub peak_current_a: f64,
    /// Voltage that the motor needs, V.
    pub peak_voltage_v: f64,
}

/// The steady cycle of a mechanism on one slope, for any speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlopeMechanics {
    /// Advance per cycle, m; above 0.
    pub advance_m: f64,
    /// What it asks of the drive.
    pub load: DriveLoad,
}

/// The configured worm with its motor and battery: makes worms of designs.
#[derive(Debug, Clone)]
pub struct Workbench {
    base: Worm,
    effects: Vec<Setting>,
    motor: Motor,
    current_limit_a: f64,
    velocity_limit_rev_per_min: f64,
    cycle_s: f64,
    /// The battery: the configured one, or the four cells of the commented configuration.
    pub battery: Battery,
    /// Whether the battery is a configured one.
    pub battery_is_configured: bool,
    /// Its open-circuit voltage.
    pub curve: OpenCircuit,
    /// Voltage under load below which the worm stops, V.
    pub lowest_bus_v: f64,
}

impl Workbench {
    /// The worm of a checked configuration.
    ///
    /// # Errors
    /// [`PhysicsError`] for values that a checked configuration cannot have.
    pub fn new(config: &Config) -> Result<Self, PhysicsError> {
        let battery = config.battery.clone().unwrap_or_default();
        Ok(Self {
            base: Worm::try_from(config)?,
            effects: config.effect_settings()?,
            motor: config.motor()?,
            current_limit_a: config.limits.current_a.min(config.servo.current_limit_a),
            velocity_limit_rev_per_min: config.servo.velocity_limit_rev_per_min,
            cycle_s: config.gait.cycle_s,
            curve: OpenCircuit::new(&battery),
            lowest_bus_v: battery.lowest_bus_v(&config.limits),
            battery_is_configured: config.battery.is_some(),
            battery,
        })
    }

    /// The configured worm, as a design.
    pub fn configured(&self) -> Design {
        Design {
            cells: self.base.cells(),
            cycle_s: self.cycle_s,
            stiffness_factor: 1.0,
            step_order: self.base.step_order().iter().map(|cell| cell + 1).collect(),
        }
    }

    /// Shortest gait cycle that the servo's velocity limit allows, s.
    pub fn shortest_cycle_s(&self) -> f64 {
        60.0 / self.velocity_limit_rev_per_min
    }

    /// Whether the cells of a design all have the same contact and mass: then the order in which they step makes no difference.
    pub fn has_equal_cells(&self, cells: usize) -> bool {
        // Added cells are means of the configured ones.
        let all_equal = cells != self.base.cells()
            || self.base.contacts().windows(2).all(|pair| pair[0] == pair[1])
                && self.base.masses_kg().windows(2).all(|pair| pair[0] == pair[1]);
        all_equal && self.effects.is_empty()
    }

    /// Whether the exact motion serves, so that one steady cycle serves every speed. With effects beyond it each speed takes a motion of its
    /// own.
    pub fn is_exact(&self) -> bool {
        Physics::of(self.base.clone()).with(&self.effects).is_piecewise_linear()
    }

    /// Mean stiffness of a cell's contact, N/m.
    pub fn stiffness_n_per_m(&self, design: &Design) -> f64 {
        let contacts = self.base.contacts();
        let sum: f64 = contacts.iter().map(|contact: &Contact| contact.stiffness_n_per_m).sum();
        design.stiffness_factor * sum / contacts.len() as f64
    }

    /// The physics of a design on a slope; nothing where an effect names a cell that it does not have.
    pub fn physics(&self, design: &Design, slope_deg: f64) -> Option<Physics> {
        self.effects
            .iter()
            .all(|effect| effect.check_cells(design.cells).is_ok())
            .then_some(())?;
        let order: Vec<usize> = design.step_order.iter().map(|cell| cell.wrapping_sub(1)).collect();
        let mut worm = with_cells(&self.base, design.cells, slope_deg)
            .and_then(|worm| worm.with_step_order(&order))
            .ok()?;
        worm.scale_stiffness(None, design.stiffness_factor);
        Some(Physics::of(worm).with(&self.effects))
    }

    /// The steady cycle of a design on a slope.
    ///
    /// # Errors
    /// [`LegFailure`] where it does not progress.
    pub fn mechanics(&self, design: &Design, slope_deg: f64) -> Result<SlopeMechanics, LegFailure> {
        self.mechanics_going(design, slope_deg, Going::Forward)
    }

    /// As [`mechanics`](Self::mechanics), also backward. The slope is positive where the way goes up.
    ///
    /// # Errors
    /// As [`mechanics`](Self::mechanics).
    pub fn mechanics_going(&self, design: &Design, slope_deg: f64, going: Going) -> Result<SlopeMechanics, LegFailure> {
        let physics = match going {
            Going::Forward => self.physics(design, slope_deg),
            // A backward crawl is the forward crawl of the worm that is seen from the other end.
            Going::Backward => self.physics(design, -slope_deg).map(Physics::mirrored),
        };
        // Only a design of the search can lack the cell that an effect names, and there the reason does not show.
        let physics = physics.ok_or(LegFailure::StandsStill)?;
        let (cycle, load) = driven_cycle(&physics, design.cycle_s).map_err(|slides| LegFailure::CannotHold {
            pull_n: slides.pull_n,
            hold_n: slides.hold_n,
        })?;
        if cycle.progresses {
            Ok(SlopeMechanics {
                advance_m: cycle.advance_m,
                load,
            })
        } else if cycle.slips_back(&physics.worm) {
            Err(LegFailure::SlidesBack {
                lost_m: -cycle.advance_m,
            })
        } else {
            Err(LegFailure::StandsStill)
        }
    }

    /// What it costs at a speed.
    ///
    /// # Errors
    /// [`LegFailure`] where a limit of the motor forbids it.
    pub fn cost(&self, mechanics: &SlopeMechanics, cycle_s: f64) -> Result<SlopeCost, LegFailure> {
        let needed_rev_per_min = 60.0 / cycle_s;
        // A cycle at the limit itself is rounded.
        if needed_rev_per_min > self.velocity_limit_rev_per_min * (1.0 + 1e-9) {
            return Err(LegFailure::Velocity {
                needed_rev_per_min,
                limit_rev_per_min: self.velocity_limit_rev_per_min,
            });
        }
        let needs = self.motor.cycle(&mechanics.load, cycle_s);
        if needs.peak_current_a > self.current_limit_a {
            return Err(LegFailure::Current {
                needed_a: needs.peak_current_a,
                limit_a: self.current_limit_a,
            });
        }
        Ok(SlopeCost {
            advance_m: mechanics.advance_m,
            motor_j: needs.energy_j,
            peak_current_a: needs.peak_current_a,
            peak_voltage_v: needs.peak_voltage_v,
        })
    }

    /// Energy that a gait cycle takes from the bus, hotel power included, J.
    pub fn bus_j(&self, cost: &SlopeCost, cycle_s: f64) -> f64 {
        cost.motor_j + self.battery.hotel_power_w * cycle_s
    }

    /// Energy out of the battery over energy into the bus, with a share of its energy left.
    ///
    /// # Errors
    /// [`LegFailure`] where the battery's voltage under load is too low for the motor, or for what switches off.
    pub fn battery_factor(&self, cost: &SlopeCost, cycle_s: f64, share: f64) -> Result<f64, LegFailure> {
        let empty = LegFailure::BatteryEmpty { after_m: 0.0 };
        let open_v = self.curve.volts(share);
        let resistance_ohm = self.battery.internal_resistance_ohm;
        let peak_w = cost.peak_current_a * cost.peak_voltage_v + self.battery.hotel_power_w;
        let (_, lowest_v) = under_load(open_v, resistance_ohm, peak_w).ok_or(empty)?;
        if lowest_v < self.lowest_bus_v {
            return Err(empty);
        }
        if cost.peak_voltage_v > lowest_v {
            return Err(LegFailure::Voltage {
                needed_v: cost.peak_voltage_v,
                bus_v: lowest_v,
            });
        }
        let mean_w = self.bus_j(cost, cycle_s) / cycle_s;
        let (_, bus_v) = under_load(open_v, resistance_ohm, mean_w).ok_or(empty)?;
        Ok(open_v / bus_v)
    }
}

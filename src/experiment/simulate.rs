//! A recording from the model: what motion capture would have seen of the configured worm.
//!
//! The cam turns evenly, the exact [`Motion`] carries the cells, and each position then gets its noise or is lost. The same
//! seed gives the same recording.

use crate::config::Config;
use crate::model::{Motion, SlidesDown, Worm, WormError};
use crate::recording::Recording;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::fmt::Display;
use std::ops::RangeInclusive;

/// Most samples of one recording: a day at 120 Hz fits.
const MAX_SAMPLES: f64 = 2e7;

/// What is simulated, beyond the worm of the configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// Slope of the canal, degrees, positive uphill, −90 to 90.
    pub slope_deg: f64,
    /// Gait cycles, above 0, need not be whole.
    pub cycles: f64,
    /// Samples per second, Hz, 1 to 10,000.
    pub rate_hz: f64,
    /// Standard deviation of one measured position, m, 0 to 0.1.
    pub noise_m: f64,
    /// Seed of noise and dropouts.
    pub seed: u64,
    /// Share of the positions that are not seen, 0 to 0.9.
    pub dropout_share: f64,
    /// Largest tip deformations, m, cell 1 first, instead of the configured ones.
    pub max_deformation_m: Option<Vec<f64>>,
    /// Time of a gait cycle, s, 0.5 to 120, instead of the configured one.
    pub cycle_s: Option<f64>,
    /// Time at rest before and after, s, 0 to 3600.
    pub rest_s: f64,
    /// Leave the gait phase out, as motion capture does.
    pub positions_only: bool,
}

impl Default for Simulation {
    /// Ten cycles on the level as the paper recorded them.
    fn default() -> Self {
        Self {
            slope_deg: 0.0,
            cycles: 10.0,
            rate_hz: 120.0,
            noise_m: 1e-4,
            seed: 1,
            dropout_share: 0.0,
            max_deformation_m: None,
            cycle_s: None,
            rest_s: 0.0,
            positions_only: false,
        }
    }
}

/// Why nothing was simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// A value that cannot be used.
    #[error("{name} = {value}: {remedy}")]
    OutOfRange {
        /// What it is called on the command line.
        name: &'static str,
        /// What was given.
        value: String,
        /// What is allowed.
        remedy: String,
    },
    /// The worm cannot be one.
    #[error(transparent)]
    Worm(#[from] WormError),
    /// The worm does not hold on the slope.
    #[error("{slides}: give a smaller slope or larger tip deformations")]
    SlidesDown {
        /// By how much.
        slides: SlidesDown,
    },
}

impl Simulation {
    fn check(&self, cells: usize, cycle_s: f64) -> Result<(), SimulationError> {
        within("slope", self.slope_deg, -90.0..=90.0, "degrees")?;
        within("cycles", self.cycles, 0.01..=1e7, "gait cycles")?;
        within("rate", self.rate_hz, 1.0..=1e4, "Hz")?;
        within("noise", self.noise_m, 0.0..=0.1, "m")?;
        within("dropout", self.dropout_share, 0.0..=0.9, "of the positions")?;
        within("cycle-s", cycle_s, 0.5..=120.0, "s")?;
        within("rest", self.rest_s, 0.0..=3600.0, "s")?;
        for bound_m in self.max_deformation_m.iter().flatten() {
            within("max-deformation-mm", bound_m * 1e3, 1e-3..=100.0, "mm")?;
        }
        if let Some(bounds_m) = &self.max_deformation_m
            && bounds_m.len() != cells
        {
            let remedy = format!("give one for each of the {cells} cells");
            return Err(out_of_range(
                "max-deformation-mm",
                format!("a list of {}", bounds_m.len()),
                remedy,
            ));
        }
        let samples = self.duration_s(cycle_s) * self.rate_hz;
        if samples > MAX_SAMPLES {
            let remedy = format!(
                "that is {samples:.0} samples, at most {MAX_SAMPLES:.0} are made: simulate less, or at a lower rate"
            );
            return Err(out_of_range("cycles", self.cycles.to_string(), remedy));
        }
        Ok(())
    }

    fn duration_s(&self, cycle_s: f64) -> f64 {
        2.0 * self.rest_s + self.cycles * cycle_s
    }
}

fn within(name: &'static str, value: f64, range: RangeInclusive<f64>, unit: &str) -> Result<(), SimulationError> {
    if range.contains(&value) {
        return Ok(());
    }
    let remedy = format!("must be from {} to {} {unit}", range.start(), range.end());
    Err(out_of_range(name, value.to_string(), remedy))
}

fn out_of_range(name: &'static str, value: impl Display, remedy: String) -> SimulationError {
    SimulationError::OutOfRange {
        name,
        value: value.to_string(),
        remedy,
    }
}

/// Simulates a recording of the configured worm. It begins at rest with the configured spacing, cell 1 in front, and crawls
/// the way that the configuration says.
///
/// # Errors
/// [`SimulationError`] for a value that cannot be used and for a worm that slides down.
pub fn simulate(config: &Config, simulation: &Simulation) -> Result<Recording, SimulationError> {
    let cells = config.worm.cells;
    let cycle_s = simulation.cycle_s.unwrap_or(config.gait.cycle_s);
    simulation.check(cells, cycle_s)?;
    let mut worm = Worm::try_from(config)?.with_slope_rad(simulation.slope_deg.to_radians())?;
    if let Some(bounds_m) = &simulation.max_deformation_m {
        worm = worm.with_max_deformations_m(bounds_m)?;
    }
    let first_m: Vec<f64> = (0..cells)
        .rev()
        .map(|behind| behind as f64 * config.worm.cell_spacing_m)
        .collect();
    let mut motion = Motion::at_rest(&worm, &first_m);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(simulation.seed);
    // Half a period more, so that the last sample does not hang on rounding.
    let samples = (simulation.duration_s(cycle_s) * simulation.rate_hz + 0.5).floor() as usize + 1;
    let mut time = Vec::with_capacity(samples);
    let mut position_m = vec![Vec::with_capacity(samples); cells];
    let mut phases = Vec::with_capacity(samples);
    for sample in 0..samples {
        let time_s = sample as f64 / simulation.rate_hz;
        let phase =
            ((time_s - simulation.rest_s) / cycle_s).clamp(0.0, simulation.cycles) * config.gait.direction.sign();
        motion
            .advance_to(&worm, phase)
            .map_err(|slides| SimulationError::SlidesDown { slides })?;
        for (series, true_m) in position_m.iter_mut().zip(motion.positions_m()) {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let is_lost = rng.random_bool(simulation.dropout_share);
            series.push(if is_lost {
                f64::NAN
            } else {
                true_m + simulation.noise_m * noise
            });
        }
        time.push(time_s);
        phases.push(phase);
    }
    Ok(Recording {
        source: format!(
            "simulation of {}, slope {} degrees, {} cycles of {cycle_s} s, noise {} mm, seed {}",
            config.worm.name,
            simulation.slope_deg,
            simulation.cycles,
            simulation.noise_m * 1e3,
            simulation.seed
        )
        .into(),
        cell_names: (1..=cells).map(|cell| format!("x{cell}_m")).collect(),
        time_s: time,
        position_m,
        gait_phase: (!simulation.positions_only).then_some(phases),
        motor: None,
        warnings: Vec::new(),
    })
}

//! A recording made by the model: what motion capture would show of the configured worm.
//!
//! The cam turns evenly, or as fast as a motor that droops under load lets it. [`Locomotion`] moves the cells under every `[[effect]]`.
//! Each position is measured as the configured sensor would, then gets noise or is lost. The same seed gives the same recording.

use crate::recording::Recording;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::fmt::Display;
use std::ops::RangeInclusive;
use worm_estimator::config::Config;
use worm_physics::effect::SettingError;
use worm_physics::{Locomotion, Physics, SlidesDown, Worm, WormError};

/// Most samples of one recording: a day at 120 Hz fits.
const MAX_SAMPLES: f64 = 2e7;
/// Parts of the time between two samples in which a drooping motor's speed is taken as even.
const SPEED_PARTS: u32 = 8;

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
    /// Fraction of the positions that are not seen, 0 to 0.9.
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
    /// An effect cannot be switched on.
    #[error(transparent)]
    Effect(#[from] SettingError),
    /// The worm does not hold on the slope.
    #[error("{0}: give a smaller slope or larger tip deformations")]
    SlidesDown(#[from] SlidesDown),
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
            return Err(self.too_long(&format!("that is {samples:.0} samples")));
        }
        Ok(())
    }

    fn too_long(&self, what: &str) -> SimulationError {
        let remedy = format!("{what}, at most {MAX_SAMPLES:.0} are made: simulate less, or at a lower rate");
        out_of_range("cycles", self.cycles.to_string(), remedy)
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

/// The gait phase over time: at rest, cycles, at rest.
struct Timetable {
    sign: f64,
    rest_s: f64,
    cycles: f64,
    cycle_s: f64,
    rate_hz: f64,
    drooping: Option<Vec<f64>>, // phase without sign at every sample, where the motor is not even
    samples: usize,
}

impl Timetable {
    fn new(
        simulation: &Simulation,
        sign: f64,
        cycle_s: f64,
        physics: &Physics,
        first_m: &[f64],
    ) -> Result<Self, SimulationError> {
        let mut table = Self {
            sign,
            rest_s: simulation.rest_s,
            cycles: simulation.cycles,
            cycle_s,
            rate_hz: simulation.rate_hz,
            drooping: None,
            // Half a period more, so that the last sample does not hang on rounding.
            samples: (simulation.duration_s(cycle_s) * simulation.rate_hz + 0.5).floor() as usize + 1,
        };
        if physics.slowdown_per_n != 0.0 {
            table.droop(simulation, physics, first_m)?;
        }
        Ok(table)
    }

    /// Finds how the phase passes under load: the cycles asked for are made, however long they take.
    fn droop(&mut self, simulation: &Simulation, physics: &Physics, first_m: &[f64]) -> Result<(), SimulationError> {
        let part_s = 1.0 / (self.rate_hz * f64::from(SPEED_PARTS));
        let mut motion = Locomotion::at_rest(physics, first_m)?;
        let (mut phase, mut rested_s) = (0.0, 0.0);
        let mut phases = vec![phase];
        while rested_s < self.rest_s || phase < self.cycles {
            for part in 1..=SPEED_PARTS {
                let time_s = (phases.len() - 1) as f64 / self.rate_hz + f64::from(part) * part_s;
                if time_s > self.rest_s && phase < self.cycles {
                    let turned = part_s / self.cycle_s * physics.speed_fraction(self.sign * motion.actuator_force_n());
                    phase = (phase + turned).min(self.cycles);
                } else if phase >= self.cycles {
                    rested_s += part_s;
                }
                motion.advance_to(self.sign * phase, part_s)?;
            }
            phases.push(phase);
            if phases.len() as f64 > MAX_SAMPLES {
                return Err(simulation.too_long("the motor droops so far that it takes too many samples"));
            }
        }
        self.samples = phases.len();
        self.drooping = Some(phases);
        Ok(())
    }

    /// The phase at a time, cycles, negative when the worm crawls backward.
    fn phase(&self, time_s: f64) -> f64 {
        let phase = match &self.drooping {
            None => ((time_s - self.rest_s) / self.cycle_s).clamp(0.0, self.cycles),
            Some(phases) => {
                let at = (time_s * self.rate_hz).clamp(0.0, (phases.len() - 1) as f64);
                let before = at.floor() as usize;
                let after = (before + 1).min(phases.len() - 1);
                phases[before] + (at - at.floor()) * (phases[after] - phases[before])
            }
        };
        phase * self.sign
    }
}

/// Simulates a recording of the configured worm with every `[[effect]]`. It begins at rest with the configured spacing, cell 1 in
/// front, and crawls the way that the configuration says.
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
    let physics = Physics::of(worm).with(&config.effect_settings()?);
    let first_m: Vec<f64> = (0..cells)
        .rev()
        .map(|behind| behind as f64 * config.worm.cell_spacing_m)
        .collect();
    let table = Timetable::new(simulation, config.gait.direction.sign(), cycle_s, &physics, &first_m)?;
    let mut motion = Locomotion::at_rest(&physics, &first_m)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(simulation.seed);
    let mut time = Vec::with_capacity(table.samples);
    let mut position_m = vec![Vec::with_capacity(table.samples); cells];
    let mut phases = Vec::with_capacity(table.samples);
    for sample in 0..table.samples {
        let time_s = sample as f64 / simulation.rate_hz;
        motion.advance_to(table.phase(time_s - physics.view.latency_s), 1.0 / simulation.rate_hz)?;
        for (series, true_m) in position_m.iter_mut().zip(motion.positions_m()) {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let is_lost = rng.random_bool(simulation.dropout_share);
            series.push(if is_lost {
                f64::NAN
            } else {
                physics.view.scale * true_m + simulation.noise_m * noise
            });
        }
        time.push(time_s);
        phases.push(table.phase(time_s));
    }
    Ok(Recording {
        source: source(config, simulation, cycle_s).into(),
        cell_names: (1..=cells).map(|cell| format!("x{cell}_m")).collect(),
        time_s: time,
        position_m,
        gait_phase: (!simulation.positions_only).then_some(phases),
        motor: None,
        warnings: Vec::new(),
        repairs: Vec::new(),
    })
}

/// What the recording is of, in words.
fn source(config: &Config, simulation: &Simulation, cycle_s: f64) -> String {
    let mut source = format!(
        "simulation of {}, slope {} degrees, {} cycles of {cycle_s} s, noise {} mm, seed {}",
        config.worm.name,
        simulation.slope_deg,
        simulation.cycles,
        simulation.noise_m * 1e3,
        simulation.seed
    );
    for effect in &config.effect {
        source += &format!(", {}", effect.name);
        if let Some(cell) = effect.cell {
            source += &format!(" of cell {cell}");
        }
        for (parameter, value) in &effect.parameters {
            source += &format!(" {parameter} = {value}");
        }
    }
    source
}

//! Section 3 of the paper on a recording in which nobody saw the worm: the same figures, as the motor's current says them.
//!
//! [`SelfSensing`] finds the worm whose exact cycle explains the torque; what the cycle does and costs is then the model's, with the errors of
//! the worm found. Only the electrical energy is measured. The slope is known here, so the pull is the weight's, but for payload and drag.

use super::analysis::{CycleValues, TheoryCycle};
use super::analyze::{RecordedRun, check_conditions, nominal_worm, theory};
use super::{AnalysisError, TorqueProfile};
use crate::recording::{Motor, Recording};
use serde::Serialize;
use worm_estimator::config::Config;
use worm_estimator::self_sensing::{
    BINS_PER_STEP, CurrentSource, CycleFigures, MotorSample, SelfSensed, SelfSensing, SelfSensingConfig, Standing,
};
use worm_physics::{Physics, Worm};

/// Evaluations of the model with each reading: recordings have few readings in a cycle, and nobody waits for them.
const EVALUATIONS_PER_READING: u32 = 100;
/// Readings that each bin of the torque's profile gets at least.
const READINGS_PER_BIN: f64 = 4.0;
/// Least readings in a step of a cell: with fewer the course of the torque is not seen. Tried down to 37.
const MIN_READINGS_PER_STEP: f64 = 30.0;
/// Longest turn of the cam between two readings that is bridged, cycles.
const LONGEST_BRIDGED_TURN: f64 = 0.02;
/// Cycles below which the intervals may be too narrow.
const FEW_CYCLES: usize = 4;

/// What the motor's current says of one recording. Lists over cells begin with cell 1; `sigma` is a standard error.
#[derive(Debug, Clone, Serialize)]
pub struct AnalysisByCurrent {
    /// The recording, as it was named.
    pub recording: String,
    /// `current`: nothing here was seen.
    pub evidence: &'static str,
    /// Slope of the canal, degrees.
    pub slope_deg: f64,
    /// Number of cells.
    pub cells: usize,
    /// Number of readings of the motor.
    pub samples: usize,
    /// Time from the first to the last, s.
    pub duration_s: f64,
    /// Mean time of a gait cycle, s.
    pub cycle_s: f64,
    /// The cells in the order in which they step, counted from 1.
    pub step_order: Vec<usize>,
    /// Largest tip deformations, friction over stiffness, m.
    pub max_deformation_m: Vec<f64>,
    /// Their standard errors, m, as if those of friction and stiffness had nothing in common.
    pub max_deformation_sigma_m: Vec<f64>,
    /// Friction forces k·δmax, N.
    pub friction_n: Vec<f64>,
    /// Their standard errors, N.
    pub friction_sigma_n: Vec<f64>,
    /// Stiffnesses, N/m.
    pub stiffness_n_per_m: Vec<f64>,
    /// Their standard errors, N/m.
    pub stiffness_sigma_n_per_m: Vec<f64>,
    /// Pull on the body down the canal, N.
    pub pull_n: f64,
    /// Its standard error, N.
    pub pull_sigma_n: f64,
    /// Every whole gait cycle crawled forward, after the first.
    pub cycles: Vec<CycleByCurrent>,
    /// A steady cycle of the worm found, by the model.
    pub mean: CycleValues,
    /// Its standard errors.
    pub sigma: CycleValues,
    /// Mean electrical energy of a cycle, measured, J; `NaN` where voltage or duty was not recorded.
    pub energy_electrical_j: f64,
    /// Energy that rigid contacts would take over the same advance, J.
    pub rigid_energy_j: f64,
    /// What theory predicts.
    pub theory: NominalTheory,
    /// Limitations of these figures.
    pub warnings: Vec<String>,
    /// Torque at the cam over the phase of a cycle.
    pub torque_profile: Option<TorqueProfile>,
}

/// One gait cycle. Advance and losses are those of the worm as it was known then.
#[derive(Debug, Clone, Serialize)]
pub struct CycleByCurrent {
    /// Gait phase at its end, cycles.
    pub end_phase: f64,
    /// When it ended, s of the recording's time.
    pub end_s: f64,
    /// Whether it was set aside, because it is not like those before.
    pub is_odd: bool,
    /// Advance, m.
    pub advance_m: f64,
    /// Its standard error, m.
    pub advance_sigma_m: f64,
    /// Energy by losses and weight (11), J.
    pub energy_loss_j: f64,
    /// Its standard error, J.
    pub energy_loss_sigma_j: f64,
    /// Electrical energy of this cycle, measured, J; `NaN` where voltage or duty was not recorded.
    pub energy_electrical_j: f64,
}

/// What theory predicts for a steady cycle.
#[derive(Debug, Clone, Serialize)]
pub struct NominalTheory {
    /// The configured worm; none where it slides down.
    pub nominal: Option<TheoryCycle>,
}

/// Analyses recordings without positions, each by itself.
///
/// # Errors
/// [`AnalysisError`] names the recording and the remedy.
pub fn analyze_by_current(runs: &[RecordedRun<'_>], config: &Config) -> Result<Vec<AnalysisByCurrent>, AnalysisError> {
    let base = Worm::try_from(config)?;
    runs.iter().map(|run| analyze_one(run, &base, config)).collect()
}

fn analyze_one(run: &RecordedRun<'_>, base: &Worm, config: &Config) -> Result<AnalysisByCurrent, AnalysisError> {
    check_conditions(run, base)?;
    let recording = run.recording;
    let name = || recording.source.display().to_string();
    let (Some(phase), Some(motor)) = (&recording.gait_phase, &recording.motor) else {
        return Err(AnalysisError::NoCurrent { recording: name() });
    };
    let pace = Pace::of(&recording.time_s, phase);
    let per_step = pace.readings / base.cells() as f64;
    if per_step < MIN_READINGS_PER_STEP {
        return Err(AnalysisError::FewReadings {
            recording: name(),
            per_step,
            needed: MIN_READINGS_PER_STEP,
        });
    }
    let nominal = nominal_worm(run, base)?;
    let known = SelfSensingConfig {
        evaluations_per_reading: EVALUATIONS_PER_READING,
        ..config.self_sensing()
    };
    let mut sensing = SelfSensing::new(&nominal, &known);
    let mut cycles = Vec::new();
    let is_recorded = |series: &[f64]| series.iter().any(|value| value.is_finite());
    let has_power = is_recorded(&motor.voltage_v) && is_recorded(&motor.duty);
    let most_turn = 1.0 / (READINGS_PER_BIN * (BINS_PER_STEP * base.cells()) as f64);
    let mut before = None;
    for reading in readings(recording, phase, motor, nominal.slope_rad()) {
        for sample in with_between(before.replace(reading), reading, most_turn) {
            if let Some(sensed) = sensing.update(&sample) {
                take(&mut cycles, sensed);
            }
        }
    }
    if let Some(sensed) = sensing.finish() {
        take(&mut cycles, sensed);
    }
    let Some(sensed) = sensing.sensed() else {
        return Err(AnalysisError::NoCycle { recording: name() });
    };
    if !has_power {
        cycles.iter_mut().for_each(|cycle| cycle.energy_electrical_j = f64::NAN);
    }
    let cells = sensed.cells;
    let of_cells = |values: &[f64]| values[..cells].to_vec();
    let deformations = (0..cells).map(|cell| largest_deformation(sensed, cell));
    let (max_deformation_m, max_deformation_sigma_m) = deformations.unzip();
    let usual: Vec<&CycleByCurrent> = cycles.iter().filter(|cycle| !cycle.is_odd).collect();
    let electrical_j: f64 = usual.iter().map(|cycle| cycle.energy_electrical_j).sum();
    let friction_n = of_cells(&sensed.friction_n);
    let mean = values(&sensed.figures, cells);
    let effects = config.effect_settings()?;
    Ok(AnalysisByCurrent {
        recording: name(),
        evidence: "current",
        slope_deg: run.slope_deg,
        cells,
        samples: recording.samples(),
        duration_s: recording.time_s.last().unwrap_or(&0.0) - recording.time_s.first().unwrap_or(&0.0),
        cycle_s: pace.cycle_s,
        step_order: config.worm.step_order.clone(),
        max_deformation_m,
        max_deformation_sigma_m,
        rigid_energy_j: (friction_n.iter().sum::<f64>() + sensed.pull_n) * mean.advance_m,
        friction_n,
        friction_sigma_n: of_cells(&sensed.friction_sigma_n),
        stiffness_n_per_m: of_cells(&sensed.stiffness_n_per_m),
        stiffness_sigma_n_per_m: of_cells(&sensed.stiffness_sigma_n_per_m),
        pull_n: sensed.pull_n,
        pull_sigma_n: sensed.pull_sigma_n,
        energy_electrical_j: electrical_j / usual.len() as f64,
        mean,
        sigma: values(&sensed.figures_sigma, cells),
        theory: NominalTheory {
            nominal: theory(&Physics::of(nominal).with(&effects), pace.cycle_s),
        },
        warnings: warnings(recording, known.gear.source, sensed, &cycles),
        torque_profile: TorqueProfile::of(&sensing),
        cycles,
    })
}

/// The readings of the motor, with the slope as what a sensor would say.
fn readings<'a>(
    recording: &'a Recording,
    phase: &'a [f64],
    motor: &'a Motor,
    slope_rad: f64,
) -> impl Iterator<Item = MotorSample> + 'a {
    let [angle, velocity, current, voltage, duty, temperature] = motor.series();
    let at = |series: &[f64], sample: usize| series.get(sample).copied().unwrap_or(f64::NAN);
    recording
        .time_s
        .iter()
        .zip(phase)
        .enumerate()
        .map(move |(sample, (&time_s, &phase))| MotorSample {
            time_s,
            phase,
            angle_rad: at(angle, sample),
            velocity_rad_per_s: at(velocity, sample),
            current_a: at(current, sample),
            bus_voltage_v: at(voltage, sample),
            duty: at(duty, sample),
            temperature_c: at(temperature, sample),
            pitch_rad: slope_rad,
            stamp_ns: stamp_ns(time_s),
        })
}

fn stamp_ns(time_s: f64) -> u64 {
    (time_s.max(0.0) * 1e9) as u64
}

/// A reading, after what lies on the way to it from the one before: where readings are sparse, whole bins of the profile would hold one by
/// chance, or none.
fn with_between(
    before: Option<MotorSample>,
    reading: MotorSample,
    most_turn: f64,
) -> impl Iterator<Item = MotorSample> {
    let turned = before.map_or(0.0, |before| (reading.phase - before.phase).abs());
    let parts = if turned < LONGEST_BRIDGED_TURN {
        (turned / most_turn).ceil().max(1.0) as u32
    } else {
        1
    };
    let before = before.unwrap_or(reading);
    (1..=parts).map(move |part| {
        let share = f64::from(part) / f64::from(parts);
        let between = |of: fn(&MotorSample) -> f64| of(&before) + share * (of(&reading) - of(&before));
        if part == parts {
            return reading;
        }
        MotorSample {
            time_s: between(|sample| sample.time_s),
            phase: between(|sample| sample.phase),
            angle_rad: between(|sample| sample.angle_rad),
            velocity_rad_per_s: between(|sample| sample.velocity_rad_per_s),
            current_a: between(|sample| sample.current_a),
            bus_voltage_v: between(|sample| sample.bus_voltage_v),
            duty: between(|sample| sample.duty),
            stamp_ns: stamp_ns(between(|sample| sample.time_s)),
            ..reading
        }
    })
}

fn take(cycles: &mut Vec<CycleByCurrent>, sensed: &SelfSensed) {
    let cycle = CycleByCurrent {
        end_phase: sensed.end_phase,
        end_s: sensed.end_ns as f64 * 1e-9,
        is_odd: sensed.standing == Standing::Odd,
        advance_m: sensed.figures.advance_m,
        advance_sigma_m: sensed.figures_sigma.advance_m,
        energy_loss_j: sensed.figures.energy_loss_j,
        energy_loss_sigma_j: sensed.figures_sigma.energy_loss_j,
        energy_electrical_j: sensed.electrical_j,
    };
    // Of a worm that has changed, the same cycle is told twice: the second time everything was searched.
    match cycles.last_mut() {
        Some(last) if last.end_phase == cycle.end_phase => *last = cycle,
        _ => cycles.push(cycle),
    }
}

fn largest_deformation(sensed: &SelfSensed, cell: usize) -> (f64, f64) {
    let (friction_n, stiffness_n_per_m) = (sensed.friction_n[cell], sensed.stiffness_n_per_m[cell]);
    let deformation_m = friction_n / stiffness_n_per_m;
    let of_friction = sensed.friction_sigma_n[cell] / friction_n;
    let of_stiffness = sensed.stiffness_sigma_n_per_m[cell] / stiffness_n_per_m;
    (deformation_m, deformation_m * of_friction.hypot(of_stiffness))
}

fn values(figures: &CycleFigures, cells: usize) -> CycleValues {
    CycleValues {
        advance_m: figures.advance_m,
        forward_slide_m: figures.forward_slide_m[..cells].to_vec(),
        backward_slide_m: figures.backward_slide_m[..cells].to_vec(),
        energy_loss_j: figures.energy_loss_j,
        energy_actuator_net_j: figures.energy_net_j,
        energy_actuator_positive_j: figures.energy_positive_j,
    }
}

/// How a recording follows the cam while it turns forward.
struct Pace {
    /// Mean time of a cycle, s.
    cycle_s: f64,
    /// Readings in a cycle.
    readings: f64,
}

impl Pace {
    fn of(time_s: &[f64], phase: &[f64]) -> Self {
        let (mut turned, mut took_s, mut readings) = (0.0, 0.0, 0.0);
        for (times, phases) in time_s.windows(2).zip(phase.windows(2)) {
            let by = phases[1] - phases[0];
            if by > 0.0 {
                (turned, took_s, readings) = (turned + by, took_s + times[1] - times[0], readings + 1.0);
            }
        }
        Self {
            cycle_s: took_s / turned,
            readings: readings / turned,
        }
    }
}

fn warnings(
    recording: &Recording,
    source: CurrentSource,
    sensed: &SelfSensed,
    cycles: &[CycleByCurrent],
) -> Vec<String> {
    let mut warnings = recording.warnings.clone();
    warnings.push(
        "no positions are in this: advance, slides and losses are the model's for the worm that explains the motor's torque best, and what the \
         model does not know is not in their errors"
            .to_owned(),
    );
    if source == CurrentSource::Duty {
        warnings.push(
            "the servo reports the duty of its bridge as its current: torque and electrical energy follow from voltage, duty, velocity and the \
             winding's resistance, and are as uncertain as servo.winding_resistance_ohm and servo.torque_constant_n_m_per_a"
                .to_owned(),
        );
    }
    if cycles.len() < FEW_CYCLES {
        warnings.push(format!(
            "{} cycles after the first are few: the errors may be too small; record for longer",
            cycles.len()
        ));
    }
    let odd = cycles.iter().filter(|cycle| cycle.is_odd).count();
    if odd > 0 {
        warnings.push(format!(
            "{odd} of {} cycles are not like those before, and were set aside",
            cycles.len()
        ));
    }
    if sensed.changes.any() {
        warnings.push(
            "the worm became another on the way: the figures are those of the last cycles; --from and --to analyse a part by itself".to_owned(),
        );
    }
    warnings
}

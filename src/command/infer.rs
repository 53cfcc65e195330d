//! `wormd infer`: what the motor's current in a log says of the worm, without looking at positions.
//!
//! A log that was recorded over a network has too few ticks of a cycle for that; but it has what the running estimator inferred of all of
//! them, and that is told instead.

use super::{Failure, print, refuse_another_worm};
use crate::watch::InferredSummary;
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;
use worm_estimator::config::Config;
use worm_estimator::estimate::Inference;
use worm_estimator::message::{Cycle, Inferred, State};
use worm_estimator::self_sensing::{SelfSensed, Unknown};
use worm_log::{Log, messages};

/// Most time between a cycle's end here and the end that the estimator measured, ns.
const SAME_END_NS: u64 = 200_000_000;

/// Arguments of `wormd infer`.
#[derive(Debug, Args)]
pub struct InferArgs {
    /// The log, as `wormd record` or `wormd up --record` wrote it
    #[arg(value_name = "FILE")]
    log: PathBuf,
    /// Configuration file, instead of the one in the log: `[self_sensing]` says what is known of the gears
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs `wormd infer`.
///
/// # Errors
/// [`Failure::Unusable`] for a log or configuration that cannot be used, and for a log without a whole gait cycle.
pub fn run(args: &InferArgs) -> Result<(), Failure> {
    let log = messages(&args.log).map_err(Failure::unusable)?;
    let config = match &args.config {
        Some(file) => Config::load(file)?,
        None => log.config()?,
    };
    refuse_another_worm(&log, &args.log, &config, args.config.as_deref())?;
    let mut inference = Inference::by_current_alone(&config).map_err(Failure::unusable)?;
    let mut marks = log.commands.iter().peekable();
    let mut inferred = Vec::new();
    for state in &log.states {
        inferred.extend(inference.update(state).copied());
        while let Some(record) = marks.next_if(|record| record.time_ns <= state.time_ns) {
            inference.note_command(record);
        }
    }
    inferred.extend(inference.finish().copied());
    let answer = match (inference.sensing().sensed(), log.inferred.last()) {
        (Some(sensed), _) => Answer::new(
            inference.latest(),
            Some(CannotTell::new(sensed)),
            cycles(&inferred, &log.cycles),
            log.warnings,
        ),
        (None, Some(last)) if last.end_ns != 0 && is_thin(&log.states) => told_live(&log, last),
        (None, _) => {
            let file = args.log.display();
            let (problem, remedy) = match is_thin(&log.states) {
                true => (
                    "holds too few ticks of each cycle for the current, and nothing that the running estimator inferred",
                    "record on the robot",
                ),
                false => (
                    "holds no whole gait cycle crawled forward after the first",
                    "record for longer, or give a log with the topic `state`",
                ),
            };
            return Err(Failure::unusable(format!("{file}: {problem}: {remedy}")));
        }
    };
    if args.json {
        print::line(serde_json::to_string(&answer).map_err(Failure::failed)?)?;
    } else {
        print::line(in_words(&answer))?;
    }
    Ok(())
}

/// The cycles of these messages, each once, beside those that were measured.
fn cycles(inferred: &[Inferred], measured: &[Cycle]) -> Vec<InferredCycle> {
    let mut cycles = Vec::new();
    let mut last_ns = 0;
    for inferred in inferred {
        if inferred.end_ns != std::mem::replace(&mut last_ns, inferred.end_ns) {
            let mut ends = measured.iter();
            let measured = ends.find(|cycle| cycle.end_ns.abs_diff(inferred.end_ns) < SAME_END_NS);
            cycles.push(InferredCycle::new(inferred, measured));
        }
    }
    cycles
}

/// Whether a log has less than half of the ticks.
fn is_thin(states: &[State]) -> bool {
    let gaps = states
        .windows(2)
        .map(|pair| pair[1].sequence.saturating_sub(pair[0].sequence));
    // A log may hold any numbers.
    let missing = gaps.fold(0_u64, |missing, gap| missing.saturating_add(gap.saturating_sub(1)));
    missing > states.len() as u64
}

/// What the estimator said while the worm ran.
fn told_live(log: &Log, last: &Inferred) -> Answer {
    let note = "this log has too few ticks of each cycle for the current: what follows is what the estimator said while the worm ran, with the \
                configuration of then";
    let warnings = std::iter::once(note.to_owned()).chain(log.warnings.iter().cloned());
    Answer::new(last, None, cycles(&log.inferred, &log.cycles), warnings.collect())
}

/// What `--json` prints. Cells count from 1.
#[derive(Debug, Serialize)]
struct Answer {
    cells: usize,
    worm: InferredWorm,
    /// None where that was not recorded.
    cannot_tell: Option<CannotTell>,
    cycles: Vec<InferredCycle>,
    warnings: Vec<String>,
}

/// The worm after the last cycle.
#[derive(Debug, Serialize)]
struct InferredWorm {
    friction_n: Vec<f64>,
    friction_sigma_n: Vec<f64>,
    stiffness_n_per_m: Vec<f64>,
    stiffness_sigma_n_per_m: Vec<f64>,
    pull_n: f64,
    pull_sigma_n: f64,
    slope_deg: f64,
    slope_sigma_deg: f64,
    slope_is_measured: bool,
    residual_n_m: f64,
}

/// One gait cycle, by the message at its end.
#[derive(Debug, Serialize)]
struct InferredCycle {
    phase: f64,
    #[serde(flatten)]
    inferred: InferredSummary,
    measured: Option<MeasuredCycle>,
}

/// The same cycle as the estimator measured it, where the log has it; without positions null but for the electrical energy.
#[derive(Debug, Serialize)]
struct MeasuredCycle {
    advance_m: f64,
    energy_loss_j: f64,
    energy_actuator_net_j: f64,
    energy_electrical_j: f64,
}

/// What the current does not say.
#[derive(Debug, Serialize)]
struct CannotTell {
    twins: Vec<TwinPair>,
    not_learned: Vec<String>,
    other_pull: Option<OtherPull>,
}

#[derive(Debug, Serialize)]
struct TwinPair {
    one: String,
    other: String,
    correlation: f64,
}

#[derive(Debug, Serialize)]
struct OtherPull {
    pull_n: f64,
    probability: f64,
}

impl Answer {
    fn new(
        last: &Inferred,
        cannot_tell: Option<CannotTell>,
        cycles: Vec<InferredCycle>,
        warnings: Vec<String>,
    ) -> Self {
        let worm = InferredWorm::new(last);
        Self {
            cells: worm.friction_n.len(),
            worm,
            cannot_tell,
            cycles,
            warnings,
        }
    }
}

impl InferredWorm {
    fn new(last: &Inferred) -> Self {
        let of_cells = |values: &[f64]| values.iter().copied().take(last.cell_count as usize).collect();
        Self {
            friction_n: of_cells(&last.friction_n),
            friction_sigma_n: of_cells(&last.friction_sigma_n),
            stiffness_n_per_m: of_cells(&last.stiffness_n_per_m),
            stiffness_sigma_n_per_m: of_cells(&last.stiffness_sigma_n_per_m),
            pull_n: last.pull_n,
            pull_sigma_n: last.pull_sigma_n,
            slope_deg: last.slope_rad.to_degrees(),
            slope_sigma_deg: last.slope_sigma_rad.to_degrees(),
            slope_is_measured: last.slope_is_measured != 0,
            residual_n_m: last.residual_n_m,
        }
    }
}

impl InferredCycle {
    fn new(inferred: &Inferred, measured: Option<&Cycle>) -> Self {
        Self {
            phase: inferred.end_phase,
            inferred: InferredSummary::of(inferred, inferred.end_phase),
            measured: measured.map(|cycle| MeasuredCycle {
                advance_m: cycle.advance_m,
                energy_loss_j: cycle.energy_loss_j,
                energy_actuator_net_j: cycle.energy_actuator_net_j,
                energy_electrical_j: cycle.energy_electrical_j,
            }),
        }
    }
}

impl CannotTell {
    fn new(sensed: &SelfSensed) -> Self {
        let blind = &sensed.blind;
        Self {
            twins: blind
                .twins
                .iter()
                .flatten()
                .map(|twin| TwinPair {
                    one: twin.one.to_string(),
                    other: twin.other.to_string(),
                    correlation: twin.correlation,
                })
                .collect(),
            not_learned: not_learned(blind.unlearned()),
            other_pull: blind
                .other_pull
                .map(|(pull_n, probability)| OtherPull { pull_n, probability }),
        }
    }
}

impl CannotTell {
    /// A line for each, with its beginning.
    fn in_words(&self) -> String {
        let mut text = String::new();
        if let Some(other) = &self.other_pull {
            text += &format!(
                "\nor a pull of {:.2} N, with a probability of {:.0} %",
                other.pull_n,
                100.0 * other.probability
            );
        }
        for twin in &self.twins {
            text += &format!(
                "\nhardly told apart: {}, {} ({:+.2})",
                twin.one, twin.other, twin.correlation
            );
        }
        if !self.not_learned.is_empty() {
            text += &format!("\nnot learned: {}", self.not_learned.join(", "));
        }
        text
    }
}

/// Each unknown once: a ripple is two.
fn not_learned(unknowns: impl Iterator<Item = Unknown>) -> Vec<String> {
    let mut names: Vec<String> = unknowns.map(|unknown| unknown.to_string()).collect();
    names.dedup();
    names
}

/// A number in a column of `width`, or a dash where it was not measured.
fn known(value: f64, width: usize, digits: usize) -> String {
    if value.is_finite() {
        format!("{value:width$.digits$}")
    } else {
        format!("{:>width$}", "-")
    }
}

fn in_words(inferred: &Answer) -> String {
    let mut text = String::from(
        "cycle   advance mm          losses mJ           electrical mJ    position mm      measured: advance, losses, electrical",
    );
    for cycle in &inferred.cycles {
        let it = &cycle.inferred;
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\n{:5}  {:6.2} ± {:<6.2}  {:8.1} ± {:<6.1}  {:8.0} ± {:<5.0}  {:7.1} ± {:<5.1}",
            cycle.phase,
            1e3 * it.advance_m,
            1e3 * it.advance_sigma_m,
            1e3 * it.energy_loss_j,
            1e3 * it.energy_loss_sigma_j,
            1e3 * it.energy_electrical_j,
            1e3 * it.energy_electrical_sigma_j,
            1e3 * it.position_m,
            1e3 * it.position_sigma_m,
        );
        if let Some(measured) = &cycle.measured {
            let _ = write!(
                text,
                "  {} {} {:8.0}",
                known(1e3 * measured.advance_m, 6, 2),
                known(1e3 * measured.energy_loss_j, 8, 1),
                1e3 * measured.energy_electrical_j,
            );
        }
        for (name, cells) in [("friction lost", &it.friction_lost), ("jammed", &it.jammed)] {
            if !cells.is_empty() {
                let _ = write!(text, "  {name}: {cells:?}");
            }
        }
        text += if it.more_load { "  more load" } else { "" };
    }
    let worm = &inferred.worm;
    for cell in 0..inferred.cells {
        let _ = write!(
            text,
            "\ncell {}: friction {:.2} ± {:.2} N, stiffness {:.0} ± {:.0} N/m",
            cell + 1,
            worm.friction_n[cell],
            worm.friction_sigma_n[cell],
            worm.stiffness_n_per_m[cell],
            worm.stiffness_sigma_n_per_m[cell],
        );
    }
    let _ = write!(
        text,
        "\npull {:.2} ± {:.2} N; a slope of {:.1} ± {:.1} degrees{}",
        worm.pull_n,
        worm.pull_sigma_n,
        worm.slope_deg,
        worm.slope_sigma_deg,
        match worm.slope_is_measured {
            true => " by the inertial sensor",
            false => " if all of it is the worm's own weight: a payload or a drag looks the same",
        }
    );
    if let Some(cannot_tell) = &inferred.cannot_tell {
        text += &cannot_tell.in_words();
    }
    for warning in &inferred.warnings {
        let _ = write!(text, "\nnote: {warning}");
    }
    text
}

//! The search on the recordings of a servo.

use super::answer::ServoAnswer;
use super::assemble::{Parts, assemble};
use super::observed::Observed;
use super::recorded_servo::RecordedServo;
use crate::bench::{BenchCampaign, ServoModel, ServoRecording};
use crate::experiment::Progress;
use crate::explain::answer::Verdict;
use crate::explain::error::ExplainError;
use crate::explain::recorded::left_out;
use crate::explain::search::find::{Options, find};
use crate::explain::search::hypothesis::Hypothesis;
use crate::explain::search::law::fit::LawSearch;
use crate::explain::search::plant::{Plant, Recorded};
use crate::explain::search::recalibrate::{measure_noise, recalibrate};
use worm_physics::servo::Pendulum;

/// Difference of two goals, over their root mean square, up to which they are one trajectory.
const SAME_GOALS: f64 = 0.05;
/// Places of a trajectory at which goals are compared.
const COMPARED: usize = 200;

/// What any model of a servo is taken to be wrong by, as a fraction of the root mean square of its positions, unless the user says
/// otherwise. On the twelve recordings of a real servo the model of the answer leaves some 0.08, and any friction over speed and load as much.
const DISCREPANCY: f64 = 0.1;

/// Relative change of the electrical energy of a run, or of its positions against their root mean square, below which an effect of a servo
/// does not matter, unless the user says otherwise: half of what any model is wrong by.
const MATTERS: f64 = 0.05;

impl Options {
    /// Those of a search on a servo.
    pub fn of_servo() -> Self {
        Self {
            discrepancy: DISCREPANCY,
            matters: MATTERS,
            ..Self::default()
        }
    }
}

/// A servo on a bench with its recordings.
pub struct Bench<'a> {
    /// What it moves.
    pub pendulum: Pendulum,
    /// Voltage without load, V.
    pub supply_v: f64,
    /// Greatest duty of the servo, in (0, 1].
    pub duty_limit: f64,
    /// The nominal servo.
    pub model: &'a ServoModel,
    /// Recordings with the gain and, where it has one, the name of the trajectory.
    pub runs: Vec<(&'a ServoRecording, f64, Option<&'a str>)>,
}

impl<'a> Bench<'a> {
    /// Of a campaign and its recordings, in the order of the runs.
    pub fn new(campaign: &'a BenchCampaign, recordings: &'a [ServoRecording]) -> Self {
        let runs = campaign.runs.iter().zip(recordings);
        Self {
            pendulum: campaign.pendulum,
            supply_v: campaign.supply_v,
            duty_limit: campaign.duty_limit,
            model: &campaign.model,
            runs: runs
                .map(|(run, recording)| (recording, run.gain, run.trajectory.as_deref()))
                .collect(),
        }
    }

    /// The runs with their trajectories: those of one name, or of the same goals.
    pub(super) fn observed(&self) -> Vec<Observed<'a>> {
        let mut firsts: Vec<(&ServoRecording, Option<&str>, String)> = Vec::new();
        let mut all = Vec::with_capacity(self.runs.len());
        for &(recording, gain, name) in &self.runs {
            let known = firsts.iter().position(|(first, other, _)| match (name, other) {
                (Some(name), Some(other)) => name == *other,
                (None, None) => have_same_goals(first, recording),
                _ => false,
            });
            let trajectory = known.unwrap_or_else(|| {
                let stem = recording
                    .source
                    .file_stem()
                    .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
                firsts.push((recording, name, name.map_or(stem, str::to_owned)));
                firsts.len() - 1
            });
            all.push(Observed::new(recording, gain, trajectory, firsts[trajectory].2.clone()));
        }
        all
    }
}

fn have_same_goals(one: &ServoRecording, other: &ServoRecording) -> bool {
    let duration_s = one.duration_s().min(other.duration_s());
    let goal = |recording: &ServoRecording, after_s: f64| {
        let at = recording
            .time_s
            .partition_point(|time_s| *time_s <= recording.time_s[0] + after_s);
        recording.goal_rad[at.saturating_sub(1)]
    };
    let (mut apart, mut square) = (0.0, 0.0);
    for place in 0..COMPARED {
        let after_s = duration_s * place as f64 / COMPARED as f64;
        let (one, other) = (goal(one, after_s), goal(other, after_s));
        apart += (one - other).powi(2);
        square += 0.5 * (one * one + other * other);
    }
    apart <= SAME_GOALS * SAME_GOALS * square
}

/// Searches for the effect that the model of a servo lacks.
///
/// # Errors
/// [`ExplainError::NoRun`].
pub fn explain_servo(
    bench: &Bench<'_>,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<ServoAnswer, ExplainError> {
    if bench.runs.is_empty() {
        return Err(ExplainError::NoRun);
    }
    let mut report = |stage: &'static str, fraction: f64| progress(Progress { stage, fraction });
    report("recalibration", 0.02);
    let nominal = bench.model.on(bench.pendulum, bench.supply_v, bench.duty_limit);
    let mut servo = RecordedServo::new(bench.observed(), nominal);
    let base = Hypothesis::new(&servo.nuisances(), &[]);
    let at = measure_noise(&mut servo, &base)?;
    let (problem, discrepancy, recalibrated) = recalibrate(&servo, &base, at, options.discrepancy);
    let mut found = find(&problem, &discrepancy, &recalibrated, options, &mut report);
    let folds = servo.folds();
    let laws = found
        .laws
        .take()
        .filter(|_| found.selected.verdict == Verdict::OutsideLibrary);
    let law = laws.and_then(|laws| {
        let search = LawSearch {
            problem: &problem,
            discrepancy: &discrepancy,
            recalibrated: &recalibrated,
            without: &found.recalibrated_held_out,
            folds: &folds,
        };
        search.best(laws, &mut |fraction| report("law", 0.95 + 0.03 * fraction))
    });
    report("stages", 0.98);
    let parts = Parts {
        law,
        folds,
        recalibrated,
        found,
        discrepancy_rad: discrepancy.scale_m,
    };
    let mut answer = assemble(&problem, bench.model, &parts);
    answer.warnings.extend(left_out(options));
    Ok(answer)
}

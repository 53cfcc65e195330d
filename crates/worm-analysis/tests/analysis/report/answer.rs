//! Answers to report on: the data are the model's own motion with one cell's friction changed. Scores, errors and
//! significances are made up; nothing here shows how well the search works.

use super::sample::STIFFNESS_N_PER_M;
use worm_analysis::explain::answer::{
    Answer, Calibrated, CycleSeries, Doubt, ExperimentChange, Figures, FoundParameter, NamedEffect, NextExperiment,
    Place, Prediction, Remainder, ResidualMap, RunChange, RunSummary, Screened, ScreeningOutcome, Stage, StageKind,
    Verdict,
};
use worm_physics::effect::{self, LIBRARY};
use worm_physics::{Contact, Motion, Worm};

const SLOPES_DEG: [f64; 3] = [0.0, 30.0, 40.0];
const BINS_PER_STEP: usize = 6;
const SCATTER_M: f64 = 2.5e-5;
const NOMINAL_M: f64 = 1.75e-3;
/// True friction of cell 2.
const FACTOR: f64 = 0.62;

/// The settled cycle of a worm: displacements of the cells at evenly spaced phases.
struct Displacements {
    phase: Vec<f64>,
    cell_m: Vec<Vec<f64>>,
}

fn displacements(bounds_m: &[f64], slope_deg: f64) -> Displacements {
    let cells = bounds_m.len();
    let contact = Contact::symmetric(STIFFNESS_N_PER_M, NOMINAL_M);
    let worm = Worm::uniform(cells, contact, 0.08325 * cells as f64, 11.5e-3)
        .and_then(|worm| worm.with_max_deformations_m(bounds_m))
        .and_then(|worm| worm.with_slope_rad(slope_deg.to_radians()))
        .expect("a worm in range");
    let mut motion = Motion::at_rest(&worm, &vec![0.0; cells]);
    motion.advance_to(&worm, 4.0).expect("a worm that holds");
    let start_m = motion.positions_m().to_vec();
    let samples = 240;
    let phase: Vec<f64> = (0..=samples)
        .map(|sample| f64::from(sample) / f64::from(samples))
        .collect();
    let mut cell_m = vec![Vec::new(); cells];
    for &phase in &phase {
        motion.advance_to(&worm, 4.0 + phase).expect("a worm that holds");
        for ((displacement_m, position_m), start_m) in cell_m.iter_mut().zip(motion.positions_m()).zip(&start_m) {
            displacement_m.push(position_m - start_m);
        }
    }
    Displacements { phase, cell_m }
}

/// Equal cells except for cell 2.
fn bounds_m(cells: usize, all: f64, second: f64) -> Vec<f64> {
    let mut bounds_m = vec![NOMINAL_M * all; cells];
    bounds_m[1] *= second;
    bounds_m
}

impl Displacements {
    /// Mean displacement of the cells, minus what the stroke alone would make.
    fn of_body_m(&self) -> Vec<f64> {
        let cells = self.cell_m.len() as f64;
        let mean_m = |sample: usize| {
            self.cell_m
                .iter()
                .map(|displacement_m| displacement_m[sample])
                .sum::<f64>()
                / cells
        };
        let samples = self.phase.iter().enumerate();
        samples
            .map(|(sample, phase)| mean_m(sample) - 11.5e-3 * phase)
            .collect()
    }
}

fn map(measured: &Displacements, model: &Displacements, slope_deg: f64) -> ResidualMap {
    let cells = measured.cell_m.len();
    let bins = cells * BINS_PER_STEP;
    let at = |displacement_m: &[f64], bin: usize| displacement_m[bin * (displacement_m.len() - 1) / bins];
    let residual_m: Vec<Vec<f64>> = measured
        .cell_m
        .iter()
        .zip(&model.cell_m)
        .map(|(measured_m, model_m)| {
            let displacement_m = |bin| at(measured_m, bin) - at(model_m, bin);
            let wobble_m = |bin: usize| 2e-6 * ((bin * 7919 % 13) as f64 - 6.0);
            (0..bins)
                .map(|bin| displacement_m(bin + 1) - displacement_m(bin) + wobble_m(bin))
                .collect()
        })
        .collect();
    let significance = residual_m
        .iter()
        .map(|row| row.iter().map(|m| m / 6e-6).collect())
        .collect();
    ResidualMap {
        slope_deg,
        stepping_cell: (0..bins).map(|bin| bin / BINS_PER_STEP + 1).collect(),
        phase: (0..bins).map(|bin| (bin as f64 + 0.5) / bins as f64).collect(),
        residual_m,
        significance,
        limit: 4.0,
    }
}

fn figures(cells: usize) -> Figures {
    let mut figures = Figures::default();
    for slope_deg in SLOPES_DEG {
        let measured = displacements(&bounds_m(cells, 1.0, FACTOR), slope_deg);
        let baseline = displacements(&bounds_m(cells, 1.0, 1.0), slope_deg);
        let recalibrated = displacements(&bounds_m(cells, 0.93, 1.0), slope_deg);
        let named = displacements(&bounds_m(cells, 1.004, FACTOR + 0.005), slope_deg);
        figures.maps_before.push(map(&measured, &recalibrated, slope_deg));
        figures.maps_after.push(map(&measured, &named, slope_deg));
        figures.cycles.push(CycleSeries {
            slope_deg,
            measured_m: measured.of_body_m(),
            scatter_m: measured.phase.iter().map(|phase| SCATTER_M * (1.0 + phase)).collect(),
            baseline_m: baseline.of_body_m(),
            recalibrated_m: recalibrated.of_body_m(),
            named_m: named.of_body_m(),
            phase: measured.phase,
        });
    }
    let diff = [
        " [worm]",
        " cells = 4",
        "-max_deformation_m = 0.00175",
        "+max_deformation_m = 0.001757     # found, ± 0.000012",
        " stroke_m = 0.0115",
        " ",
        "+[[effect]]",
        "+name = \"unequal-clamping\"         # no positions can tell it from a friction coefficient of that cell",
        "+cell = 2",
        "+friction_factor = 0.625",
    ];
    figures.model_diff = diff.map(str::to_owned).to_vec();
    figures
}

/// The clearest bins of all maps.
fn places(maps: &[ResidualMap]) -> Vec<Place> {
    let mut places = Vec::new();
    for map in maps {
        for (cell, row) in map.residual_m.iter().enumerate() {
            places.extend(row.iter().enumerate().map(|(bin, &residual_m)| Place {
                cell: cell + 1,
                stepping_cell: map.stepping_cell[bin],
                phase: map.phase[bin],
                slope_deg: map.slope_deg,
                residual_m,
                significance: map.significance[cell][bin],
            }));
        }
    }
    places.sort_by(|one, other| other.significance.abs().total_cmp(&one.significance.abs()));
    places.truncate(8);
    places
}

/// An effect as found, with the library's twins and separating experiment.
pub fn found(
    name: &str,
    cell: Option<usize>,
    values: &[f64],
    closure: f64,
    margin: f64,
    improvement: f64,
) -> NamedEffect {
    let effect = effect::named(name).expect("an effect of the library");
    let parameters = effect
        .parameters
        .iter()
        .zip(values)
        .map(|(parameter, &value)| FoundParameter {
            name: parameter.name.to_owned(),
            value,
            sigma: 0.04 * value.abs(),
            unit: parameter.unit.to_owned(),
            cell,
        });
    NamedEffect {
        name: name.to_owned(),
        twins: effect
            .all_twins(cell.map(|cell| cell - 1))
            .into_iter()
            .map(str::to_owned)
            .collect(),
        parameters: parameters.collect(),
        cell,
        together_with: Vec::new(),
        closure,
        closure_interval: [closure - 0.03, closure + 0.03],
        onset: None,
        margin,
        probability: 0.5 + 0.5 * margin,
        improvement,
        separated_by: effect.separated_by.to_owned(),
    }
}

fn screening() -> Vec<Screened> {
    let mut screening: Vec<Screened> = (1..=4)
        .map(|cell| Screened {
            name: "unequal-clamping".to_owned(),
            cell: Some(cell),
            score: if cell == 2 { 812.4 } else { 40.0 + cell as f64 },
            improvement: (cell == 2).then_some(1043.7),
            outcome: if cell == 2 {
                ScreeningOutcome::Refitted
            } else {
                ScreeningOutcome::ScreenedOut
            },
        })
        .collect();
    screening.extend(LIBRARY.iter().skip(1).enumerate().map(|(number, effect)| {
        let score = 620.0 * 0.62f64.powi(number as i32);
        let (improvement, outcome) = match effect.name {
            "sensor-latency" | "motor-droop" => (None, ScreeningOutcome::NotVisible),
            "breakaway-friction" => (None, ScreeningOutcome::DidNotConverge),
            _ if number < 6 => (Some(0.8 * score), ScreeningOutcome::Refitted),
            _ => (None, ScreeningOutcome::ScreenedOut),
        };
        Screened {
            name: effect.name.to_owned(),
            cell: None,
            score: if outcome == ScreeningOutcome::NotVisible {
                0.0
            } else {
                score
            },
            improvement,
            outcome,
        }
    }));
    screening.sort_by(|one, other| other.score.total_cmp(&one.score));
    screening
}

fn stage(stage: StageKind, effect: Option<&str>, rms_mm: f64, advance_mm: f64) -> Stage {
    Stage {
        stage,
        effect: effect.map(str::to_owned),
        fit_rms_m: rms_mm * 0.97e-3,
        held_out_rms_m: rms_mm * 1e-3,
        held_out_interval_m: [0.95, 1.05].map(|factor| factor * rms_mm * 1e-3),
        torque: None,
        advance_error_m: advance_mm * 1e-3,
        advance_error_interval_m: [0.9, 1.1].map(|factor| factor * advance_mm * 1e-3),
        energy_error_j: advance_mm * 2.1e-3,
    }
}

fn stages(named: Option<&str>, wrong: Option<&str>) -> Vec<Stage> {
    let mut stages = vec![
        stage(StageKind::Baseline, None, 0.412, 0.61),
        stage(StageKind::Recalibrated, None, 0.187, 0.11),
    ];
    stages.extend(named.map(|named| stage(StageKind::Named, Some(named), 0.041, 0.012)));
    stages.extend(wrong.map(|wrong| stage(StageKind::BestWrong, Some(wrong), 0.102, 0.07)));
    stages.extend([
        stage(StageKind::FreeForm, None, 0.037, 0.004),
        stage(StageKind::Floor, None, 0.0342, 0.003),
    ]);
    stages
}

fn runs(figures: &Figures, is_named: bool) -> Vec<RunSummary> {
    let advance_m = |series: &[f64]| 11.5e-3 + series.last().copied().unwrap_or(f64::NAN);
    let run = |series: &CycleSeries| RunSummary {
        recording: format!("up{}.csv", series.slope_deg),
        slope_deg: series.slope_deg,
        payload_kg: 0.0,
        cycles: 12,
        cycle_s: 2.5,
        phase_recorded: false,
        sees_positions: true,
        laid_down: true,
        noise_m: 8e-5,
        drift_per_cycle_m: 2.4e-5,
        advance_m: [
            advance_m(&series.measured_m),
            advance_m(&series.recalibrated_m),
            if is_named { advance_m(&series.named_m) } else { f64::NAN },
        ],
        current: None,
        advance_sigma_m: None,
    };
    figures.cycles.iter().map(run).collect()
}

pub fn calibration() -> Vec<Calibrated> {
    let value = |name: &str, nominal, found, sigma, unit, at_limit| Calibrated {
        name: name.to_owned(),
        nominal,
        found,
        sigma,
        unit,
        at_limit,
    };
    vec![
        value("friction", 1.0, 0.931, 0.006, "", false),
        value("stiffness", 1.0, 1.1, 0.009, "", true),
        value("stroke", 11.5e-3, 11.462e-3, 0.011e-3, "m", false),
        value("slope of run 2", 30.0, 30.13, 0.06, "deg", false),
        value("clock", 0.0, 0.0031, 0.0008, "s", false),
    ]
}

/// One effect, explained.
pub fn explained(cells: usize) -> Answer {
    let figures = figures(cells);
    Answer {
        verdict: Verdict::Explained,
        sentence: "Cell 2 holds 38 % less than the others. With that the model follows all three recordings down to the noise, and \
                   no other effect of the library does."
            .to_owned(),
        effects: vec![found("unequal-clamping", Some(2), &[0.6241], 0.955, 0.4, 1043.7)],
        rivals: vec![found("unequal-stiffness", Some(2), &[1.31], 0.555, -0.4, 496.2)],
        r#where: places(&figures.maps_before),
        stages: stages(Some("unequal-clamping"), Some("unequal-stiffness")),
        remainder: None,
        law: None,
        next_experiment: Some(NextExperiment {
            change: ExperimentChange::Measurement("pull test of one cell"),
            value: None,
            unit: String::new(),
            slope_deg: None,
            description: "Pull cell 2 alone along the canal with a spring balance until it slides.".to_owned(),
            predictions: vec![Prediction {
                effect: "unequal-clamping".to_owned(),
                advance_m: None,
                description: "slides at 1.06 N, the others at 1.72 N".to_owned(),
            }],
            separation_sigma: None,
        }),
        calibration: calibration(),
        written_back: calibration(),
        screening: screening(),
        threshold: 14.2,
        doubt: Doubt {
            misstated_probability: None,
            null_probability: 1e-4,
            other_probability: 0.006,
            agrees_within_m: 4.1e-5,
            agrees_within_j: None,
            discrepancy_m: 1.05e-5,
            friction_scatter: Some(0.014),
        },
        runs: runs(&figures, true),
        warnings: vec!["up40.csv: 84 gaps of up to 0.06 s were bridged".to_owned()],
        repairs: Vec::new(),
        figures,
    }
}

/// Two effects that act together.
pub fn pair() -> Answer {
    Answer {
        sentence: "The pads creep and the canal has a slick stretch. Neither alone follows the data.".to_owned(),
        effects: vec![
            found("pad-creep", None, &[0.41, 0.62], 0.93, 0.35, 611.0),
            found("slick-patch", None, &[0.55, 0.131, 0.034], 0.93, 0.35, 611.0),
        ],
        stages: stages(Some("pad-creep and slick-patch"), Some("payload and slick-patch")),
        next_experiment: None,
        ..explained(4)
    }
}

/// Several effects that explain the data about as well.
pub fn ambiguous() -> Answer {
    let prediction = |effect: &str, advance_mm: f64, description: &str| Prediction {
        effect: effect.to_owned(),
        advance_m: Some(advance_mm * 1e-3),
        description: description.to_owned(),
    };
    Answer {
        verdict: Verdict::Ambiguous,
        sentence: "A canal that is 1.1° steeper than stated and a constant drag of 0.064 N explain the data about equally well."
            .to_owned(),
        effects: vec![found("slope-error", None, &[1.12], 0.941, 0.012, 402.0)],
        rivals: vec![
            found("constant-drag", None, &[0.0642], 0.929, -0.012, 398.0),
            found("actuator-compliance", None, &[1.31e-4], 0.921, -0.02, 391.0),
        ],
        stages: stages(Some("slope-error"), Some("constant-drag")),
        next_experiment: Some(NextExperiment {
            change: ExperimentChange::Run(RunChange::Payload),
            value: Some(0.1),
            unit: "kg".to_owned(),
            slope_deg: Some(30.0),
            description: "Repeat the run at 30° with 100 g fixed to the worm's body.".to_owned(),
            predictions: vec![
                prediction("slope-error", 3.112, "advances less, for the weight pulls more on the steeper canal"),
                prediction("constant-drag", 3.171, "as the believed slope says"),
                prediction("actuator-compliance", 3.02, "stands off further"),
            ],
            separation_sigma: Some(4.6),
        }),
        ..explained(4)
    }
}

/// Nothing of the library explains the data.
pub fn outside() -> Answer {
    let mut answer = explained(4);
    answer.figures.maps_after.clear();
    for run in &mut answer.figures.cycles {
        run.named_m.clear();
    }
    let runs = runs(&answer.figures, false);
    Answer {
        verdict: Verdict::OutsideLibrary,
        sentence: "A force comes and goes every 11 mm of the way; nothing in the library does that.".to_owned(),
        effects: Vec::new(),
        rivals: Vec::new(),
        stages: stages(None, None),
        remainder: Some(Remainder {
            description: "all cells, while cells 2 and 3 step, at 30° and 40°".to_owned(),
            open_share: 0.62,
            onset: None,
            period_cycles: None,
            period_m: Some(0.011),
            places: places(&answer.figures.maps_before)[..3].to_vec(),
        }),
        next_experiment: Some(NextExperiment {
            change: ExperimentChange::Run(RunChange::Start),
            value: Some(0.005),
            unit: "m".to_owned(),
            slope_deg: Some(30.0),
            description: "Lay the worm down 5 mm further up the canal and repeat the run at 30°.".to_owned(),
            predictions: Vec::new(),
            separation_sigma: Some(1.4),
        }),
        runs,
        ..answer
    }
}

/// Nothing is missing.
pub fn agrees() -> Answer {
    let answer = outside();
    let mut screening = answer.screening.clone();
    for entry in &mut screening {
        entry.score *= 0.01;
        entry.improvement = entry.improvement.map(|improvement| improvement * 0.01);
    }
    Answer {
        verdict: Verdict::Agrees,
        sentence: "The recalibrated model follows all three recordings down to the noise.".to_owned(),
        r#where: Vec::new(),
        remainder: None,
        next_experiment: None,
        warnings: Vec::new(),
        repairs: Vec::new(),
        screening,
        ..answer
    }
}

/// An answer that holds nothing but its verdict, as when the search ended early.
pub fn empty() -> Answer {
    Answer {
        verdict: Verdict::OutsideLibrary,
        sentence: String::new(),
        effects: Vec::new(),
        rivals: Vec::new(),
        r#where: Vec::new(),
        stages: Vec::new(),
        remainder: None,
        law: None,
        next_experiment: None,
        calibration: Vec::new(),
        written_back: Vec::new(),
        screening: Vec::new(),
        threshold: f64::NAN,
        doubt: Doubt::default(),
        runs: Vec::new(),
        warnings: Vec::new(),
        repairs: Vec::new(),
        figures: Figures::default(),
    }
}

//! What a person reads in the terminal: the verdict, the effects, how the gap shrinks, what to try next.

use crate::command::columns::{Row, aligned};
use worm_analysis::explain::Answer;
use worm_analysis::explain::answer::{
    Calibrated, NamedEffect, NextExperiment, Place, Remainder, RunSummary, Stage, StageKind,
};
use worm_estimator::number::{NONE, fixed};
use worm_physics::effect;

/// Places that are listed; the page has all.
const PLACES: usize = 5;
/// Most decimals of a value; what has a smaller error is told with fewer digits than it could be.
const MAX_DECIMALS: f64 = 6.0;

/// The whole answer in words and tables.
pub(super) fn text(answer: &Answer) -> String {
    let mut parts = vec![answer.sentence.clone()];
    parts.extend(answer.effects.iter().map(|named| effect_text("", named)));
    parts.extend(answer.rivals.iter().map(|named| {
        let with = named.together_with.iter().map(|other| format!("{other} with "));
        effect_text(&format!("about as well: {}", with.collect::<String>()), named)
    }));
    if !answer.r#where.is_empty() {
        parts.push(aligned(&places(&answer.r#where)));
    }
    if !answer.stages.is_empty() && !answer.is_by_advances() {
        parts.push(aligned(&gap(&answer.stages)));
    }
    if !answer.calibration.is_empty() {
        parts.push(aligned(&calibration(&answer.calibration)));
    }
    if answer.is_by_advances() {
        parts.push(aligned(&advances(&answer.runs)));
    }
    parts.extend(answer.remainder.as_ref().map(remainder));
    parts.extend(answer.next_experiment.as_ref().map(next));
    parts.join("\n\n")
}

/// An effect with its values, its twins, and what speaks for it.
fn effect_text(before: &str, named: &NamedEffect) -> String {
    let cell = named.cell.map(|cell| format!(", cell {cell}")).unwrap_or_default();
    let mut lines = vec![format!("{before}{}{cell}", named.name)];
    let known = effect::named(&named.name).ok();
    if let Some(known) = known {
        lines.push(format!("  {} {}", known.sentence, known.formula));
    }
    let values: Vec<Row> = named
        .parameters
        .iter()
        .map(|parameter| {
            let known = known.and_then(|known| known.parameters.iter().find(|known| known.name == parameter.name));
            let of_cell = parameter.cell.filter(|_| named.cell.is_none());
            let cell = of_cell.map(|cell| format!(", cell {cell}")).unwrap_or_default();
            let about = known.map_or(parameter.name.as_str(), |known| known.about);
            vec![
                format!("  {about}{cell}"),
                quantity(parameter.value, parameter.sigma, &parameter.unit),
            ]
        })
        .collect();
    lines.push(aligned(&values));
    if !named.twins.is_empty() {
        lines.push(format!("  no positions can tell it from: {}", named.twins.join("; ")));
    }
    if !named.separated_by.is_empty() {
        lines.push(format!(
            "  what would tell it from its neighbours: {}",
            named.separated_by
        ));
    }
    if !named.closure.is_finite() {
        // Of what shows in times or advances alone, nothing was held out.
        lines.push(format!("  probability {}", fixed(named.probability, 2)));
        return lines.join("\n");
    }
    let than = if named.margin < 0.0 { "less" } else { "more" };
    lines.push(format!(
        "  it closes {} % of the gap on cycles that it was not fitted to, {} points {than} than the best of another kind; \
         probability {}",
        fixed(named.closure * 1e2, 0),
        fixed(named.margin.abs() * 1e2, 0),
        fixed(named.probability, 2)
    ));
    lines.join("\n")
}

fn places(places: &[Place]) -> Vec<Row> {
    let head = [
        "where",
        "while steps",
        "phase",
        "slope",
        "beyond the model, mm a cycle",
        "σ",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.extend(places.iter().take(PLACES).map(|place| {
        vec![
            format!("  cell {}", place.cell),
            format!("cell {}", place.stepping_cell),
            fixed(place.phase, 2),
            format!("{}°", fixed(place.slope_deg, 1)),
            fixed(place.residual_m * 1e3, 3),
            fixed(place.significance, 1),
        ]
    }));
    rows
}

fn gap(stages: &[Stage]) -> Vec<Row> {
    let head = [
        "the gap",
        "held out, mm",
        "fitted, mm",
        "advance off, mm",
        "energy off, mJ",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.extend(stages.iter().map(|stage| {
        let name = match stage.stage {
            StageKind::Baseline => "believed model",
            StageKind::Recalibrated => "recalibrated",
            StageKind::BestWrong => "best wrong effect",
            StageKind::Named => "named effect",
            StageKind::FreeForm => "free form, the most that can be",
            StageKind::Floor => "noise floor",
        };
        let effect = stage
            .effect
            .as_deref()
            .map(|effect| format!(", {effect}"))
            .unwrap_or_default();
        vec![
            format!("  {name}{effect}"),
            fixed(stage.held_out_rms_m * 1e3, 3),
            fixed(stage.fit_rms_m * 1e3, 3),
            fixed(stage.advance_error_m * 1e3, 3),
            fixed(stage.energy_error_j * 1e3, 2),
        ]
    }));
    rows
}

fn advances(runs: &[RunSummary]) -> Vec<Row> {
    let head = ["advance, mm a cycle", "measured", "recalibrated", "first candidate"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.extend(runs.iter().map(|run| {
        let [measured_m, recalibrated_m, named_m] = run.advance_m;
        vec![
            format!("  {}°", fixed(run.slope_deg, 1)),
            quantity(measured_m, run.advance_sigma_m.unwrap_or(f64::NAN), "m").replace(" mm", ""),
            fixed(recalibrated_m * 1e3, 2),
            fixed(named_m * 1e3, 2),
        ]
    }));
    rows
}

fn calibration(calibration: &[Calibrated]) -> Vec<Row> {
    let mut rows = vec![["recalibrated", "believed", "found"].map(str::to_owned).to_vec()];
    rows.extend(calibration.iter().map(|calibrated| {
        let limit = if calibrated.at_limit { " (at its limit)" } else { "" };
        vec![
            format!("  {}{limit}", calibrated.name),
            quantity(calibrated.nominal, f64::NAN, calibrated.unit),
            quantity(calibrated.found, calibrated.sigma, calibrated.unit),
        ]
    }));
    rows
}

fn remainder(remainder: &Remainder) -> String {
    let in_time = remainder
        .period_cycles
        .map(|cycles| format!(", with a period of {} cycles", fixed(cycles, 1)));
    let along = remainder
        .period_m
        .map(|period_m| format!(", with a period of {} mm of canal", fixed(period_m * 1e3, 1)));
    format!(
        "what is left: {}; {} % of the gap stays open{}",
        remainder.description,
        fixed(remainder.open_share * 1e2, 0),
        in_time.or(along).unwrap_or_default()
    )
}

fn next(next: &NextExperiment) -> String {
    let mut lines = vec![format!("next experiment: {}", next.description)];
    lines.extend(next.predictions.iter().map(|prediction| {
        let advance = prediction
            .advance_m
            .map(|advance_m| format!(", {} mm a cycle", fixed(advance_m * 1e3, 2)));
        let space = if prediction.description.is_empty() { "" } else { " " };
        format!(
            "  {}:{space}{}{}",
            prediction.effect,
            prediction.description,
            advance.unwrap_or_default()
        )
    }));
    if let Some(sigma) = next.separation_sigma {
        lines.push(format!("  the two nearest predictions are {} σ apart", fixed(sigma, 1)));
    }
    lines.join("\n")
}

/// A value with its error in the units that people read, with the two digits of the error that mean something.
fn quantity(value: f64, sigma: f64, unit: &str) -> String {
    let (factor, unit) = match unit {
        "m" => (1e3, " mm"),
        "s" => (1e3, " ms"),
        "kg" => (1e3, " g"),
        "J" => (1e3, " mJ"),
        "m/N" => (1e3, " mm/N"),
        "deg" => (1.0, "°"),
        "" => (1.0, ""),
        other => return format!("{} {other}", quantity(value, sigma, "")),
    };
    let (value, sigma) = (value * factor, (sigma * factor).abs());
    if !value.is_finite() {
        return NONE.to_owned();
    }
    let decimals = |digits: f64, of: f64| (digits - 1.0 - of.log10().floor()).clamp(0.0, MAX_DECIMALS) as usize;
    if sigma.is_normal() {
        let decimals = decimals(2.0, sigma);
        return format!("{} ± {}{unit}", fixed(value, decimals), fixed(sigma, decimals));
    }
    let shortest = value.to_string();
    let shortest = if shortest.len() > 8 {
        fixed(value, decimals(4.0, value.abs()))
    } else {
        shortest
    };
    format!("{}{unit}", shortest.replace('-', "−"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use worm_analysis::explain::answer::{ExperimentChange, Figures, FoundParameter, Prediction, RunChange};
    use worm_analysis::explain::{Answer, Verdict};

    fn named(name: &str, parameter: (&str, f64, f64, &str)) -> NamedEffect {
        let (parameter, value, sigma, unit) = parameter;
        NamedEffect {
            name: name.to_owned(),
            twins: vec!["directional-friction".to_owned()],
            parameters: vec![FoundParameter {
                name: parameter.to_owned(),
                value,
                sigma,
                unit: unit.to_owned(),
                cell: None,
            }],
            cell: None,
            together_with: Vec::new(),
            closure: 0.947,
            margin: 0.312,
            probability: 0.98,
            improvement: 310.0,
            separated_by: "cut the tether".to_owned(),
        }
    }

    #[test]
    fn everything_that_was_found_is_told() {
        let answer = Answer {
            verdict: Verdict::Ambiguous,
            sentence: "Two effects explain the data about equally well.".to_owned(),
            effects: vec![named("constant-drag", ("force_n", 0.2034, 0.012, "N"))],
            rivals: vec![named("payload", ("mass_kg", 0.0412, 0.003, "kg"))],
            r#where: vec![Place {
                cell: 2,
                stepping_cell: 3,
                phase: 0.55,
                slope_deg: 30.0,
                residual_m: -0.000_31,
                significance: 7.2,
            }],
            stages: vec![Stage {
                stage: StageKind::Named,
                effect: Some("constant-drag".to_owned()),
                fit_rms_m: 5.1e-5,
                held_out_rms_m: 5.4e-5,
                advance_error_m: 1.2e-5,
                energy_error_j: 3e-4,
            }],
            remainder: Some(Remainder {
                description: "cell 1 while cell 4 steps".to_owned(),
                open_share: 0.4,
                period_cycles: Some(3.5),
                period_m: None,
                places: Vec::new(),
            }),
            next_experiment: Some(NextExperiment {
                change: ExperimentChange::Run(RunChange::Slope),
                value: Some(45.0),
                unit: "deg".to_owned(),
                slope_deg: Some(45.0),
                description: "Tilt the canal to 45°.".to_owned(),
                predictions: vec![Prediction {
                    effect: "payload".to_owned(),
                    advance_m: Some(0.001_72),
                    description: "it barely advances".to_owned(),
                }],
                separation_sigma: Some(8.4),
            }),
            calibration: vec![Calibrated {
                name: "stroke".to_owned(),
                nominal: 0.0115,
                found: 0.011_43,
                sigma: 4e-6,
                unit: "m",
                at_limit: true,
            }],
            screening: Vec::new(),
            threshold: 9.0,
            runs: Vec::new(),
            warnings: Vec::new(),
            figures: Figures::default(),
        };
        let expected = "\
Two effects explain the data about equally well.

constant-drag
  A constant force holds the worm back. F = const
  force on the whole worm towards smaller positions  0.203 ± 0.012 N
  no positions can tell it from: directional-friction
  what would tell it from its neighbours: cut the tether
  it closes 95 % of the gap on cycles that it was not fitted to, 31 points more than the best of another kind; probability 0.98

about as well: payload
  The worm is heavier than believed. m = m₀ + Δm
  mass beyond the believed one, in equal shares  41.2 ± 3.0 g
  no positions can tell it from: directional-friction
  what would tell it from its neighbours: cut the tether
  it closes 95 % of the gap on cycles that it was not fitted to, 31 points more than the best of another kind; probability 0.98

where     while steps  phase  slope  beyond the model, mm a cycle    σ
  cell 2       cell 3   0.55  30.0°                        −0.310  7.2

the gap                        held out, mm  fitted, mm  advance off, mm  energy off, mJ
  named effect, constant-drag         0.054       0.051            0.012            0.30

recalibrated             believed                found
  stroke (at its limit)   11.5 mm  11.4300 ± 0.0040 mm

what is left: cell 1 while cell 4 steps; 40 % of the gap stays open, with a period of 3.5 cycles

next experiment: Tilt the canal to 45°.
  payload: it barely advances, 1.72 mm a cycle
  the two nearest predictions are 8.4 σ apart";
        assert_eq!(text(&answer), expected);
    }

    #[test]
    fn quantities_are_told_in_the_units_of_people() {
        for (value, sigma, unit, text) in [
            (0.000_42, 0.000_013, "m", "0.420 ± 0.013 mm"),
            (0.0152, 0.0021, "s", "15.2 ± 2.1 ms"),
            (0.05, 0.012, "kg", "50 ± 12 g"),
            (-1.25, 0.31, "deg", "−1.25 ± 0.31°"),
            (0.0115, f64::NAN, "m", "11.5 mm"),
            (0.2034, 0.012, "N", "0.203 ± 0.012 N"),
            (3e-5, 2e-6, "m/N", "0.0300 ± 0.0020 mm/N"),
            (1.0, f64::NAN, "", "1"),
            (f64::NAN, 0.1, "m", NONE),
        ] {
            assert_eq!(quantity(value, sigma, unit), text);
        }
    }
}

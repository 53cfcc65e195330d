//! What `wormd explain` shows of a servo on a bench: the answer, the friction map, the runs, and how the gap closes.

mod figure;

use super::explain::view::outcome;
use super::page::{Page, Table};
use super::plot::DrawError;
use super::{ReportError, file, law};
use crate::explain::Verdict;
use crate::explain::answer::StageKind;
use crate::explain::servo::answer::{FrictionPlace, ServoAnswer, ServoStage};
use maud::html;
use std::path::{Path, PathBuf};
use worm_estimator::number::{fixed, percent, significant, to_error};

/// A section: heading, paragraphs, and a table.
struct Section {
    heading: &'static str,
    text: String,
    table: Option<Table>,
}

/// The page on an answer, as the text of one self-contained HTML file.
///
/// # Errors
/// [`DrawError`] where a figure could not be drawn.
pub fn page(answer: &ServoAnswer, title: &str) -> Result<String, DrawError> {
    let runs = answer.runs.len();
    let lead =
        format!("{runs} recordings of a servo on a bench: where its model is wrong, and which effect it misses.");
    let mut page = Page::new(title, &lead).with_style(include_str!("explain/style.css"));
    page.add(html! {
        section class={ "verdict " (class(answer.verdict)) } {
            p.badge { (badge(answer.verdict)) }
            p.headline { (headline(answer)) }
            p { (answer.sentence) }
        }
    });
    for section in sections(answer) {
        page.heading(section.heading);
        page.paragraph(&section.text);
        if let Some(table) = section.table {
            page.add(table);
        }
        match section.heading {
            MAP => page.figure(&figure::friction_map(answer)?),
            GAP => page.figure(&figure::runs(answer)?),
            LAW => {
                if let Some(law) = &answer.law {
                    page.figure(&law::figure(law)?);
                }
            }
            _ => {}
        }
    }
    page.heading("The new model");
    page.add(html! {
        pre.diff {
            @for line in &answer.figures.model_diff {
                @match line.chars().next() {
                    Some('+') => ins { (line) },
                    Some('-') => del { (line) },
                    _ => span { (line) },
                }
            }
        }
    });
    page.warnings(&answer.warnings);
    Ok(page.finish())
}

/// The same for the terminal, without figures.
pub fn text(answer: &ServoAnswer) -> String {
    let mut parts = vec![
        format!("{}. {}", badge(answer.verdict), headline(answer)),
        answer.sentence.clone(),
    ];
    for section in sections(answer) {
        let underline = "─".repeat(section.heading.chars().count());
        parts.push(format!("{}\n{underline}", section.heading));
        parts.push(section.text);
        parts.extend(section.table.map(|table| table.to_string()));
    }
    parts.retain(|part| !part.is_empty());
    parts.join("\n\n")
}

/// Writes the page as `report.html` into a directory, which is made if need be.
///
/// # Errors
/// [`ReportError::Drawing`] before anything is written; [`ReportError::File`].
pub fn write(answer: &ServoAnswer, title: &str, dir: &Path) -> Result<PathBuf, ReportError> {
    let page = page(answer, title)?;
    file::make_directory(dir)?;
    file::replace(dir.join("report.html"), page.as_bytes())
}

const GAP: &str = "How the gap closes";
const LAW: &str = "A law that nobody listed";
const MAP: &str = "Where friction is wrong";

fn badge(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agrees => "Agrees",
        Verdict::Explained => "Explained",
        Verdict::Ambiguous => "Ambiguous",
        Verdict::OutsideLibrary => "Outside the library",
    }
}

fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agrees => "agrees",
        Verdict::Explained => "explained",
        Verdict::Ambiguous => "ambiguous",
        Verdict::OutsideLibrary => "outside-library",
    }
}

fn headline(answer: &ServoAnswer) -> String {
    let names: Vec<&str> = answer.effects.iter().map(|effect| effect.name.as_str()).collect();
    match answer.verdict {
        Verdict::Agrees => "Nothing that matters is missing".to_owned(),
        Verdict::OutsideLibrary => "Something is missing that the library does not know".to_owned(),
        _ => names.join(" and "),
    }
}

fn sections(answer: &ServoAnswer) -> Vec<Section> {
    let mut sections = vec![Section {
        heading: GAP,
        text: "Mean absolute error of the positions, each run predicted from its first reading on and never reset. The last two \
               columns are of runs whose trajectory, or whose gain, the model was not fitted to."
            .to_owned(),
        table: Some(gap_table(&answer.stages)),
    }];
    if !answer.effects.is_empty() {
        sections.push(Section {
            heading: "The effects",
            text: "The severity's error counts what its law may be wrong by.".to_owned(),
            table: Some(effects_table(answer)),
        });
    }
    if answer.verdict == Verdict::OutsideLibrary {
        sections.push(Section {
            heading: LAW,
            text: match &answer.law {
                Some(law) => law::paragraphs(law).join(" "),
                None => "There is no law to report: no friction over speed and loads and no torque over the angle predicts trajectories \
                         and gains that it was not fitted to."
                    .to_owned(),
            },
            table: None,
        });
    }
    sections.push(Section {
        heading: MAP,
        text: match answer.r#where.first() {
            Some(_) => "Friction by the torque balance beyond that of the recalibrated model, by speed and torque on the gears.".to_owned(),
            None => "The recalibrated model's friction is that of the torque balance everywhere, within three standard errors.".to_owned(),
        },
        table: (!answer.r#where.is_empty()).then(|| places_table(&answer.r#where)),
    });
    sections.push(Section {
        heading: "What the reported current measures",
        text: answer.current.sentence.clone(),
        table: Some(current_table(answer)),
    });
    sections.push(Section {
        heading: "The recalibrated model",
        text: recalibration_in_words(answer),
        table: Some(calibration_table(answer)),
    });
    sections.push(Section {
        heading: "The library",
        text: format!(
            "On this campaign with nothing missing, the best of the library would improve the fit by more than {} one time in a hundred.",
            fixed(answer.threshold, 1)
        ),
        table: Some(library_table(answer)),
    });
    if let Some(next) = &answer.next_experiment {
        let predictions: Vec<String> = next
            .predictions
            .iter()
            .map(|one| format!("with {} {}", one.effect, one.description))
            .collect();
        sections.push(Section {
            heading: "The next run",
            text: format!("To decide, {}: {}.", next.description, predictions.join(", ")),
            table: None,
        });
    }
    if let Some(remainder) = &answer.remainder {
        sections.push(Section {
            heading: "What is left",
            text: format!("{}.", remainder.description),
            table: (!remainder.places.is_empty()).then(|| places_table(&remainder.places)),
        });
    }
    sections
}

fn recalibration_in_words(answer: &ServoAnswer) -> String {
    let far = answer.far_off.iter().map(|far| format!(" The {}.", far.description));
    let what = "What is only known so well may move within its prior; only what remains then is a gap.";
    std::iter::once(what.to_owned()).chain(far).collect()
}

fn stage_name(stage: &ServoStage) -> String {
    let name = match stage.stage {
        StageKind::Baseline => "nominal model",
        StageKind::Recalibrated => "recalibrated",
        StageKind::Step => "a step: with",
        StageKind::BestWrong => "best rival:",
        StageKind::Named => "with",
        StageKind::Law => "with a law,",
        StageKind::FreeForm => "any friction over speed and load",
        StageKind::Floor => "noise",
    };
    match &stage.effect {
        Some(effect) => format!("{name} {effect}"),
        None => name.to_owned(),
    }
}

fn gap_table(stages: &[ServoStage]) -> Table {
    let head = [
        "",
        "as fitted, mrad",
        "without its trajectory",
        "without its gain",
        "rms held out",
    ];
    let mrad = |rad: f64| fixed(1e3 * rad, 1);
    let row = |stage: &ServoStage| {
        vec![
            stage_name(stage),
            mrad(stage.fit_mean_absolute_error_rad),
            mrad(stage.without_trajectory_mean_absolute_error_rad.unwrap_or(f64::NAN)),
            mrad(stage.without_gain_mean_absolute_error_rad.unwrap_or(f64::NAN)),
            mrad(stage.held_out_rms_rad),
        ]
    };
    Table {
        rows: stages.iter().map(row).collect(),
        ..Table::new("The gap, stage by stage", head)
    }
}

fn effects_table(answer: &ServoAnswer) -> Table {
    let head = ["", "parameter", "unit", "value", "probability", "closes"];
    let rows = answer.effects.iter().chain(&answer.rivals).flat_map(|effect| {
        effect.parameters.iter().map(move |parameter| {
            vec![
                effect.name.clone(),
                parameter.name.clone(),
                parameter.unit.clone(),
                to_error(parameter.value, parameter.sigma),
                percent(effect.probability),
                percent(effect.closure),
            ]
        })
    });
    Table {
        rows: rows.collect(),
        ..Table::new("What was found", head).with_word_columns(3)
    }
}

fn places_table(places: &[FrictionPlace]) -> Table {
    let head = [
        "speed, rad/s",
        "load, N m",
        "friction beyond the model's, mN m",
        "standard errors",
        "most of it in",
    ];
    let range = |[from, to]: [f64; 2]| format!("{from} to {to}");
    let row = |place: &FrictionPlace| {
        vec![
            range(place.speed_rad_s),
            range(place.load_n_m),
            fixed(1e3 * place.residual_n_m, 1),
            fixed(place.significance, 1),
            format!("{}, gain {}", place.trajectory, place.position_p_gain),
        ]
    };
    Table {
        rows: places.iter().map(row).collect(),
        ..Table::new("Where friction is not the model's", head).with_word_columns(2)
    }
}

fn current_table(answer: &ServoAnswer) -> Table {
    let row = |one: &crate::explain::servo::answer::CurrentHypothesis| {
        vec![
            one.measures.in_words().to_owned(),
            significant(1e3 * one.rms_a, 2),
            fixed(one.ln_odds, 1),
        ]
    };
    Table {
        rows: answer.current.hypotheses.iter().map(row).collect(),
        note: Some("Log odds against the best; nobody should be surer than 7 of what a register means.".to_owned()),
        ..Table::new("What it may measure", ["", "left, mA rms", "log odds"])
    }
}

fn calibration_table(answer: &ServoAnswer) -> Table {
    let row = |value: &crate::explain::answer::Calibrated| {
        vec![
            value.name.clone(),
            value.unit.to_owned(),
            significant(value.nominal, 3),
            to_error(value.found, value.sigma),
            match answer.far_off.iter().any(|far| far.name == value.name) {
                _ if value.at_limit => "at the limit",
                true => "far from the nominal one",
                false => "yes",
            }
            .to_owned(),
        ]
    };
    Table {
        rows: answer.calibration.iter().map(row).collect(),
        ..Table::new(
            "Nominal and found",
            ["", "unit", "nominal", "found", "within its prior"],
        )
        .with_word_columns(2)
    }
}

fn library_table(answer: &ServoAnswer) -> Table {
    let row = |one: &crate::explain::answer::Screened| {
        vec![
            one.name.clone(),
            fixed(one.score, 1),
            fixed(one.improvement.unwrap_or(f64::NAN), 1),
            outcome(one).to_owned(),
        ]
    };
    let head = ["", "expected", "refitted", "what became of it"];
    Table {
        rows: answer.screening.iter().map(row).collect(),
        ..Table::new("Rise of twice the log likelihood", head)
    }
}

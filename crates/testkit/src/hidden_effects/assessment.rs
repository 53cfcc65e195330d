//! One answer compared with the truth.

use super::answer::{Answer, Estimate, Named, Proposal, Verdict};
use super::campaign::HiddenCampaign;
use super::follow_up::ExtraRun;
use super::truth::{CampaignKind, TrueEffect, Truth};

/// A search that is assessed.
pub trait Explainer: Sync {
    /// Explains a campaign and further runs of the same worm.
    ///
    /// # Errors
    /// The reason why there is no answer.
    fn explain(&self, campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<Answer, String>;
}

/// The result of one case; `None` where a figure does not apply to it.
#[derive(Debug, Clone)]
pub struct Assessment {
    pub truth: Truth,
    pub verdict: Verdict,
    /// The first effect named.
    pub top: Option<String>,
    /// How many effects the answer names together.
    pub named: usize,
    /// Whether the truth is the first effect or one of its exact twins.
    pub right_class: Option<bool>,
    /// Whether it is the first effect by name, and nothing else is in the set.
    pub strict: Option<bool>,
    /// Whether the cell is right, where the effect has one and is named rightly.
    pub right_cell: Option<bool>,
    /// Of a single effect: whether the answer names two or more together, of which one is not there.
    pub false_second: Option<bool>,
    /// Probability that the answer states for its verdict, and whether that is right.
    pub stated: Option<(f64, bool)>,
    pub closure: Option<f64>,
    pub margin: Option<f64>,
    /// Relative error of the severity.
    pub severity_error: Option<f64>,
    /// Whether the 90 % interval holds the true severity.
    pub covered: Option<bool>,
    /// Whether an ambiguous set holds the truth.
    pub in_set: Option<bool>,
    /// Whether exact twins are reported as such.
    pub twins_reported: Option<bool>,
    /// How many of several effects are named.
    pub of_several: Option<usize>,
    /// Of an effect that begins in mid-run: whether the answer has its beginning within one gait cycle, in the right runs.
    pub onset_right: Option<bool>,
    /// Of a single effect that is named rightly and there throughout: whether the answer lets it begin in mid-run.
    pub false_onset: Option<bool>,
    /// Whether the proposed run settles an ambiguous answer rightly.
    pub settled: Option<bool>,
}

impl Assessment {
    /// Whether it is a single effect, there from the start.
    pub fn is_single(&self) -> bool {
        self.truth.kind == CampaignKind::Single
    }

    /// Whether something was wrong with the recordings and they were refused, which is as good as a repair.
    pub fn is_refused(&self) -> bool {
        self.verdict == Verdict::Failed && !self.truth.artefacts.is_empty()
    }

    /// The result in one line.
    pub fn line(&self) -> String {
        let truth: Vec<String> = self.truth.effects.iter().map(TrueEffect::in_words).collect();
        let percent =
            |fraction: Option<f64>| fraction.map_or("-".to_owned(), |fraction| format!("{:.0} %", 100.0 * fraction));
        let right = match (self.right_class, self.strict) {
            (_, Some(true)) => "right",
            (Some(true), _) => "right class",
            (Some(false), _) => "WRONG",
            _ => "",
        };
        format!(
            "{:<32} [{}; {:.1} sigma, {:.1} %] {} {} of {} {right} closure {} severity {}",
            self.truth.case,
            truth.join(" + "),
            self.truth.sigma,
            100.0 * self.truth.impact(),
            self.verdict.name(),
            self.top.as_deref().unwrap_or(""),
            self.named,
            percent(self.closure),
            percent(self.severity_error),
        )
    }
}

/// Names that position data cannot distinguish.
const TWINS: [&[&str]; 3] = [
    &["directional-friction", "constant-drag"],
    &["payload", "softer-pads"],
    &["sensor-scale", "lost-stroke"],
];

/// Figures that say where, when or how fast, and not how strong.
const SHAPES: [&str; 5] = ["from_m", "length_m", "slip_m", "grip_s", "time_constant_s"];

impl TrueEffect {
    /// Every name that is right for it but for its exact twin.
    fn aliases(&self) -> Vec<&str> {
        // One cell's lost stroke has no twin: a wrong scale shortens every stroke.
        let twins = TWINS
            .iter()
            .find(|twins| self.cell.is_none() && twins.contains(&self.name.as_str()));
        twins.map_or(vec![self.name.as_str()], |twins| twins.to_vec())
    }

    /// Whether an answer's effect is this one or its twin.
    fn matches(&self, named: &Named) -> bool {
        let aliases = self.aliases();
        let says = |name: &str| aliases.contains(&name);
        // A fault of one cell is no twin of the same fault of all.
        let same_extent = named.name != self.name || named.cell.is_some() == self.cell.is_some();
        (says(&named.name) && same_extent) || named.twins.contains(&self.name)
    }

    /// The figure that says how strong it is: its name, its value and the value of no effect at all.
    fn severity(&self) -> Option<(&str, f64, f64)> {
        let (name, &value) = self
            .parameters
            .iter()
            .find(|(name, _)| !SHAPES.contains(&name.as_str()))?;
        let about_one = name.ends_with("_factor") || name.contains("_over_") || name == "scale";
        Some((name, value, if about_one { 1.0 } else { 0.0 }))
    }

    /// Relative error of an answer's severity, and whether its interval covers the true one.
    fn severity_of(&self, named: &Named) -> Option<(f64, bool)> {
        let (name, value, neutral) = self.severity()?;
        let estimate: &Estimate = named.parameters.iter().find(|estimate| estimate.name == name)?;
        let error = (estimate.value - value).abs() / (value - neutral).abs();
        Some((error, (estimate.low..=estimate.high).contains(&value)))
    }
}

/// Compares an answer with the truth.
pub fn compare(truth: &Truth, answer: &Answer) -> Assessment {
    let one = matches!(
        truth.kind,
        CampaignKind::Single | CampaignKind::Twin | CampaignKind::Onset | CampaignKind::Spell
    );
    let several = matches!(truth.kind, CampaignKind::Pair | CampaignKind::Triple);
    let effect = truth.effects.first().filter(|_| one);
    let top = answer.top();
    let hit = effect.and_then(|effect| top.filter(|top| effect.matches(top)).map(|top| (effect, top)));
    let by_name = hit.filter(|(effect, top)| effect.name == top.name);
    let severity = by_name.and_then(|(effect, top)| effect.severity_of(top));
    let ambiguous = answer.verdict == Verdict::Ambiguous;
    let alone = answer.verdict == Verdict::Named && answer.named.len() == 1;
    let any_true = |named: &Named| truth.effects.iter().any(|effect| effect.matches(named));
    let has_cell = |(effect, _): &(&TrueEffect, &Named)| effect.cell.is_some();
    Assessment {
        verdict: answer.verdict,
        top: top.map(|top| top.name.clone()),
        named: if answer.names() { answer.named.len() } else { 0 },
        right_class: effect.map(|_| hit.is_some()),
        strict: effect.map(|_| by_name.is_some() && alone),
        right_cell: by_name.filter(has_cell).map(|(effect, top)| effect.cell == top.cell),
        false_second: effect.map(|_| answer.names() && answer.named.len() > 1 && !answer.named.iter().all(any_true)),
        stated: answer
            .probability
            .map(|probability| (probability, is_right(truth, answer, top.is_some_and(any_true)))),
        closure: answer.closure.filter(|_| hit.is_some()),
        margin: answer.margin.filter(|_| hit.is_some()),
        severity_error: severity.map(|(error, _)| error),
        covered: severity.map(|(_, covered)| covered),
        in_set: effect
            .filter(|_| ambiguous)
            .map(|effect| answer.members().any(|member| effect.matches(member))),
        twins_reported: effect
            .filter(|_| truth.kind == CampaignKind::Twin)
            .map(|effect| hit.is_some() && names_twins_of(answer, effect)),
        of_several: several.then(|| {
            let met = |effect: &&TrueEffect| answer.names() && answer.named.iter().any(|named| effect.matches(named));
            truth.effects.iter().filter(met).count()
        }),
        onset_right: matches!(truth.kind, CampaignKind::Onset | CampaignKind::Spell).then(|| has_onset(truth, answer)),
        false_onset: hit
            .filter(|_| truth.kind == CampaignKind::Single)
            .map(|_| answer.onset.is_some()),
        settled: None,
        truth: truth.clone(),
    }
}

/// Whether a verdict is right; `top_is_true`: whether the first effect named is there.
fn is_right(truth: &Truth, answer: &Answer, top_is_true: bool) -> bool {
    match answer.verdict {
        Verdict::Nothing => truth.kind == CampaignKind::Clean || truth.is_negligible(),
        Verdict::Named | Verdict::Ambiguous => top_is_true,
        // What recalibration leaves of a discrepancy may be seen, and may be too small to matter.
        Verdict::Outside => truth.kind == CampaignKind::Stranger || truth.is_discrepant(),
        Verdict::Failed => false,
    }
}

fn has_onset(truth: &Truth, answer: &Answer) -> bool {
    // Everything hidden begins.
    let Some(found) = answer.onset.filter(|found| !found.ends) else {
        return false;
    };
    let begins_in = |run: usize| truth.runs[run].onset.is_some();
    let in_right_runs = (0..truth.runs.len()).all(|run| begins_in(run) == found.run.is_none_or(|only| only == run));
    let Some(onset) = truth.onset().filter(|_| in_right_runs) else {
        return false;
    };
    let ends_where_it_does = match (found.until_cycle, onset.until_cycle) {
        (Some(found), Some(truth)) => (found - truth).abs() <= 1.0,
        (found, truth) => found.is_none() && truth.is_none(),
    };
    if !ends_where_it_does {
        return false;
    }
    match (found.time_s, found.cycle) {
        (Some(time_s), _) => (time_s - onset.time_s).abs() <= truth.cycle_s,
        (None, Some(cycle)) => (cycle - onset.cycle).abs() <= 1.0,
        (None, None) => false,
    }
}

/// Whether the other names of an effect are given as well.
fn names_twins_of(answer: &Answer, effect: &TrueEffect) -> bool {
    // Softer pads are no effect of the library, so they may be described in words.
    let is_name = |given: &str, name: &str| given == name || (name == "softer-pads" && given.contains("soft"));
    let is_given = |name: &str| {
        answer
            .members()
            .any(|member| is_name(&member.name, name) || member.twins.iter().any(|twin| is_name(twin, name)))
    };
    effect.aliases().into_iter().all(is_given)
}

/// Compares the answer to a campaign with the truth; where the answer is ambiguous, makes the run that it proposes.
pub fn assess(campaign: &HiddenCampaign, explainer: &dyn Explainer) -> Assessment {
    let answer = explainer.explain(campaign, &[]).unwrap_or_else(|problem| {
        eprintln!("{}: {problem}", campaign.truth.case);
        Answer::failed()
    });
    let assessment = compare(&campaign.truth, &answer);
    let effect = assessment.in_set.and_then(|_| campaign.truth.effects.first());
    Assessment {
        settled: effect.and_then(|effect| is_settled(campaign, effect, &answer, explainer)),
        ..assessment
    }
}

/// Whether the proposed run leads to the right name; none where it is no run that is proposed.
fn is_settled(
    campaign: &HiddenCampaign,
    effect: &TrueEffect,
    answer: &Answer,
    explainer: &dyn Explainer,
) -> Option<bool> {
    let condition = match answer.proposal {
        Some(Proposal::Measurement) => return None,
        Some(Proposal::Run(condition)) => condition,
        None => return Some(false),
    };
    // A proposal under which the worm does not crawl settles nothing.
    let Ok(extra) = campaign.follow_up(condition, 1) else {
        return Some(false);
    };
    let settled = explainer
        .explain(campaign, &[extra])
        .is_ok_and(|answer| answer.verdict == Verdict::Named && answer.top().is_some_and(|top| effect.matches(top)));
    Some(settled)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hidden_effects::table::ScoreTable;
    use serde_json::{Value, json};

    /// A campaign of two runs of which the second has the onset, as a test bed writes it.
    fn truth(kind: &str, onset: Value, artefacts: &[&str]) -> Truth {
        let run = |onset: Value| {
            json!({
                "slope_deg": 0.0, "cycles": 12, "advance_change": 0.1, "energy_change": 0.0, "position_change_m": 1e-4,
                "onset": onset,
            })
        };
        let truth = json!({
            "bed": "own", "split": "development", "case": "a case", "kind": kind, "seed": 1, "cells": 4, "cycle_s": 2.5,
            "rate_hz": 120.0, "noise_m": 1e-4, "with_phase": true, "stranger": null, "sigma": 20.0, "sigma_per_cycle": 5.0,
            "effects": [{"name": "unequal-clamping", "cell": 2, "parameters": {"friction_factor": 0.7}}],
            "artefacts": artefacts,
            "runs": [run(Value::Null), run(onset)],
        });
        serde_json::from_value(truth).expect("a truth")
    }

    /// An answer that names the effect and lets it begin where `onset` says.
    fn answer(onset: Value) -> Answer {
        let report = json!({
            "verdict": "explained",
            "effects": [{"name": "unequal-clamping", "cell": 2, "twins": [], "onset": onset}],
            "rivals": [],
            "runs": [{"recording": "run1.csv"}, {"recording": "run2.csv"}],
        });
        Answer::from_json(&report).expect("an answer")
    }

    #[test]
    fn an_onset_is_right_within_a_cycle_and_in_its_run() {
        let hidden = truth("onset", json!({"gait_phase": 7.5, "cycle": 6.0, "time_s": 15.0}), &[]);
        let right = |onset: Value| compare(&hidden, &answer(onset)).onset_right;
        let at = |time_s: f64, run: Value| json!({"cycle": time_s / 2.5, "time_s": time_s, "run": run});
        assert_eq!(right(at(17.4, json!("run2.csv"))), Some(true));
        assert_eq!(
            right(at(17.6, json!("run2.csv"))),
            Some(false),
            "more than a cycle late"
        );
        assert_eq!(right(at(15.0, json!("run1.csv"))), Some(false), "another run");
        assert_eq!(right(at(15.0, Value::Null)), Some(false), "it is not in every run");
        assert_eq!(
            right(json!({"cycle": 5.1, "run": "run2.csv"})),
            Some(true),
            "by cycles alone"
        );
        assert_eq!(right(Value::Null), Some(false), "there throughout");
    }

    #[test]
    fn an_onset_that_is_none_is_counted() {
        let hidden = truth("single", Value::Null, &[]);
        let found = |onset: Value| compare(&hidden, &answer(onset)).false_onset;
        assert_eq!(found(Value::Null), Some(false));
        assert_eq!(found(json!({"cycle": 5.0, "time_s": 12.5, "run": null})), Some(true));
    }

    #[test]
    fn a_spoiled_capture_may_be_refused_and_no_other() {
        let spoiled = compare(&truth("single", Value::Null, &["knock"]), &Answer::failed());
        let right = compare(&truth("single", Value::Null, &[]), &Answer::failed());
        assert!(spoiled.is_refused() && !right.is_refused());
        let all = [spoiled, right];
        let table = ScoreTable(&all);
        let count = |what: &str| table.count(what).expect("the table has such a row");
        assert_eq!(count("no answer at all"), (1, 1));
        assert_eq!(count("artefact: refused"), (1, 1));
        assert_eq!(count("artefact: named what is not there"), (0, 0));
        assert_eq!(count("strong: class right"), (0, 1));
    }
}

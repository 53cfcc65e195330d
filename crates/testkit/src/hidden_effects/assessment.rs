//! One answer held against the truth.
//!
//! [`Answer`] is an explanation as far as it is scored, so that the score does not hang on how the library lays out its own.

use super::campaign::{CampaignKind, HiddenCampaign};
use super::effect::TrueEffect;
use super::follow_up::{Condition, ExtraRun};

/// What an explanation comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The believed worm, recalibrated, explains all.
    Nothing,
    /// One effect, or several together, with their exact twins.
    Named,
    /// Several effects that these runs do not separate.
    Ambiguous,
    /// Something is there, and no effect of the library explains it.
    Outside,
    /// There was no answer at all.
    Failed,
}

impl Verdict {
    /// Whether it names an effect.
    pub fn names(self) -> bool {
        matches!(self, Self::Named | Self::Ambiguous)
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Named => "named",
            Self::Ambiguous => "ambiguous",
            Self::Outside => "outside",
            Self::Failed => "failed",
        }
    }
}

/// A figure of an effect with its 90 % interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    pub name: String,
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

/// An effect as an answer names it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Named {
    pub name: String,
    /// From 0.
    pub cell: Option<usize>,
    /// The effects that it says no position data could tell from this one.
    pub twins: Vec<String>,
    pub parameters: Vec<Estimate>,
}

/// What an answer wants done next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Proposal {
    /// One more run.
    Run(Condition),
    /// Something to be measured on the bench, which no run can stand for.
    Measurement,
}

/// An effect that was looked for, and how surely it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Screened {
    pub name: String,
    /// From 0.
    pub cell: Option<usize>,
    pub sigma: f64,
}

/// An explanation as far as it is scored.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    pub verdict: Verdict,
    /// The effects in the mended model, the most telling first.
    pub named: Vec<Named>,
    /// The other members of an ambiguous set.
    pub rivals: Vec<Named>,
    /// Every effect that was looked for.
    pub screened: Vec<Screened>,
    /// Share of the recalibrated worm's held-out gap to the noise floor that the named effect closes.
    pub closure: Option<f64>,
    /// Closure beyond the best wrong rival's.
    pub margin: Option<f64>,
    /// What would separate the set.
    pub proposal: Option<Proposal>,
}

/// What is judged.
pub trait Explainer: Sync {
    /// Explains a campaign and further runs of the same worm.
    ///
    /// # Errors
    /// Says why there is no answer at all.
    fn explain(&self, campaign: &HiddenCampaign, extra: &[ExtraRun]) -> Result<Answer, String>;
}

/// How one case came out. What does not apply to it is absent.
#[derive(Debug, Clone)]
pub struct Assessment {
    pub case: String,
    pub kind: CampaignKind,
    pub truth: Vec<TrueEffect>,
    /// What the effect does to the advance and within a cycle, m.
    pub effect_size_m: [f64; 2],
    pub verdict: Verdict,
    /// The first effect named.
    pub top: Option<String>,
    /// How surely the library itself sees the true effect, standard deviations; infinite where it gives no answer, so that no
    /// failure is left out.
    pub significance_sigma: f64,
    /// Whether the truth is the first effect or one of its exact twins.
    pub right_class: Option<bool>,
    /// Whether it is the first effect by name, and nothing else is in the set.
    pub strict: Option<bool>,
    /// Whether the cell is right, where the effect has one and is named rightly.
    pub right_cell: Option<bool>,
    pub closure: Option<f64>,
    pub margin: Option<f64>,
    /// Error of the severity as a share of it.
    pub severity_error: Option<f64>,
    /// Whether the 90 % interval holds the true severity.
    pub covered: Option<bool>,
    /// Whether an ambiguous set holds the truth.
    pub in_set: Option<bool>,
    /// Whether exact twins are reported as such.
    pub twins_reported: Option<bool>,
    /// How many of a pair are named.
    pub of_pair: Option<usize>,
    /// Whether the proposed run settles an ambiguous answer rightly.
    pub settled: Option<bool>,
}

impl Assessment {
    /// All of it in a line.
    pub fn line(&self) -> String {
        let truth: Vec<String> = self.truth.iter().map(TrueEffect::in_words).collect();
        let percent =
            |fraction: Option<f64>| fraction.map_or("-".to_owned(), |fraction| format!("{:.0} %", 100.0 * fraction));
        let right = match (self.right_class, self.strict) {
            (_, Some(true)) => "right",
            (Some(true), _) => "right class",
            (Some(false), _) => "WRONG",
            _ => "",
        };
        format!(
            "{:<32} [{}; {:.2}/{:.2} mm] {} {} {:.1} sigma {right} closure {} severity {}",
            self.case,
            truth.join(" + "),
            1e3 * self.effect_size_m[0],
            1e3 * self.effect_size_m[1],
            self.verdict.name(),
            self.top.as_deref().unwrap_or(""),
            self.significance_sigma,
            percent(self.closure),
            percent(self.severity_error),
        )
    }
}

/// Names between which no position data can decide.
const TWINS: [&[&str]; 3] = [
    &["directional-friction", "constant-drag"],
    &["payload", "softer-pads"],
    &["sensor-scale", "lost-stroke"],
];

impl TrueEffect {
    /// Every name that is right for it but for its exact twin.
    fn aliases(&self) -> Vec<&'static str> {
        // One cell's lost stroke has no twin: a wrong scale shortens every stroke.
        let twins = TWINS
            .iter()
            .find(|twins| self.cell.is_none() && twins.contains(&self.name));
        twins.map_or(vec![self.name], |twins| twins.to_vec())
    }

    /// Whether an answer's effect is this one or its twin.
    fn matches(&self, named: &Named) -> bool {
        let aliases = self.aliases();
        let says = |name: &str| aliases.contains(&name);
        // A fault of one cell is no twin of the same fault of all.
        let same_extent = named.name != self.name || named.cell.is_some() == self.cell.is_some();
        (says(&named.name) && same_extent) || named.twins.iter().any(|twin| twin == self.name)
    }

    /// The figure that says how strong it is: its name, its value and the value of no effect at all.
    fn severity(&self) -> Option<(&'static str, f64, f64)> {
        // Where a slick patch lies does not say how slick it is.
        let strength = |&&(name, _): &&(&str, f64)| self.name != "slick-patch" || name == "friction_factor";
        let &(name, value) = self.parameters.iter().find(strength)?;
        let about_one = name.ends_with("_factor") || name.contains("_over_") || name == "scale";
        Some((name, value, if about_one { 1.0 } else { 0.0 }))
    }
}

/// Holds the answer to a campaign against the truth, and has the proposed run made where the answer is ambiguous.
pub fn assess(campaign: &HiddenCampaign, explainer: &dyn Explainer) -> Assessment {
    let answer = explainer.explain(campaign, &[]).unwrap_or_else(|problem| {
        eprintln!("{}: {problem}", campaign.name);
        Answer::failed()
    });
    let single = matches!(campaign.kind, CampaignKind::Single | CampaignKind::Twin);
    let truth = campaign.truth.first().filter(|_| single);
    let top = answer.top();
    let hit = truth.and_then(|truth| top.filter(|top| truth.matches(top)).map(|top| (truth, top)));
    let by_name = hit.filter(|(truth, top)| truth.name == top.name);
    let severity = by_name.and_then(|(truth, top)| {
        let (name, value, neutral) = truth.severity()?;
        let estimate = top.parameters.iter().find(|estimate| estimate.name == name)?;
        let error = (estimate.value - value).abs() / (value - neutral).abs();
        Some((error, (estimate.low..=estimate.high).contains(&value)))
    });
    let ambiguous = answer.verdict == Verdict::Ambiguous;
    let alone = answer.verdict == Verdict::Named && answer.named.len() == 1;
    let has_cell = |(truth, _): &(&TrueEffect, &Named)| truth.cell.is_some();
    Assessment {
        case: campaign.name.clone(),
        kind: campaign.kind,
        truth: campaign.truth.clone(),
        effect_size_m: [campaign.effect_size.advance_m, campaign.effect_size.within_cycle_m],
        verdict: answer.verdict,
        top: top.map(|top| top.name.clone()),
        significance_sigma: truth.map_or(0.0, |truth| answer.significance_of(truth)),
        right_class: truth.map(|_| hit.is_some()),
        strict: truth.map(|_| by_name.is_some() && alone),
        right_cell: by_name.filter(has_cell).map(|(truth, top)| truth.cell == top.cell),
        closure: answer.closure.filter(|_| hit.is_some()),
        margin: answer.margin.filter(|_| hit.is_some()),
        severity_error: severity.map(|(error, _)| error),
        covered: severity.map(|(_, covered)| covered),
        in_set: truth
            .filter(|_| ambiguous)
            .map(|truth| answer.members().any(|member| truth.matches(member))),
        twins_reported: truth
            .filter(|_| campaign.kind == CampaignKind::Twin)
            .map(|truth| hit.is_some() && answer.tells_twins_of(truth)),
        of_pair: (campaign.kind == CampaignKind::Pair).then(|| {
            let met = |truth: &&TrueEffect| answer.names() && answer.named.iter().any(|named| truth.matches(named));
            campaign.truth.iter().filter(met).count()
        }),
        settled: truth
            .filter(|_| ambiguous)
            .and_then(|truth| is_settled(campaign, truth, &answer, explainer)),
    }
}

impl Answer {
    fn failed() -> Self {
        Self {
            verdict: Verdict::Failed,
            named: Vec::new(),
            rivals: Vec::new(),
            screened: Vec::new(),
            closure: None,
            margin: None,
            proposal: None,
        }
    }

    fn names(&self) -> bool {
        self.verdict.names()
    }

    fn top(&self) -> Option<&Named> {
        self.named.first().filter(|_| self.names())
    }

    fn members(&self) -> impl Iterator<Item = &Named> {
        self.named.iter().chain(&self.rivals)
    }

    /// How surely the library sees an effect, standard deviations.
    fn significance_of(&self, truth: &TrueEffect) -> f64 {
        if self.verdict == Verdict::Failed {
            return f64::INFINITY;
        }
        let aliases = truth.aliases();
        let meant = |one: &&Screened| {
            aliases.contains(&one.name.as_str())
                && (truth.cell.is_none() || one.cell.is_none() || truth.cell == one.cell)
        };
        self.screened
            .iter()
            .filter(meant)
            .map(|one| one.sigma)
            .fold(0.0, f64::max)
    }

    /// Whether the other names of an effect are told as well.
    fn tells_twins_of(&self, truth: &TrueEffect) -> bool {
        // Softer pads are no effect of the library, so they may be told in words.
        let tells = |said: &str, name: &str| said == name || (name == "softer-pads" && said.contains("soft"));
        let told = |name: &str| {
            self.members()
                .any(|member| tells(&member.name, name) || member.twins.iter().any(|twin| tells(twin, name)))
        };
        truth.aliases().into_iter().all(told)
    }
}

/// Whether the proposed run leads to the right name; none where it is no run that is proposed.
fn is_settled(
    campaign: &HiddenCampaign,
    truth: &TrueEffect,
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
        .is_ok_and(|answer| answer.verdict == Verdict::Named && answer.top().is_some_and(|top| truth.matches(top)));
    Some(settled)
}

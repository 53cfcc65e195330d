//! Many assessments in one table: proportions with their exact 95 % intervals, medians, and the targets.
//!
//! Strong or weak is decided by the truth of the campaign and never by the search's own significance.

use super::answer::Verdict;
use super::assessment::Assessment;
use super::curves::Curves;
use super::statistics::{Proportion, median};
use super::truth::{CampaignKind, STRONG_SIGMA, TrueEffect};
use std::fmt;
use std::io;

/// Significance of each cycle after an onset from which it must be found, standard deviations.
const ONSET_SIGMA_PER_CYCLE: f64 = 2.0;
/// Stated probability that counts as certain.
const CERTAIN: f64 = 0.99;

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub what: &'static str,
    pub proportion: Proportion,
    pub target: &'static str,
}

/// All scores. Campaigns whose recordings were refused for what is wrong with them count in the rows on artefacts only.
#[derive(Debug)]
pub struct ScoreTable<'a>(pub &'a [Assessment]);

impl ScoreTable<'_> {
    fn of(&self, kind: CampaignKind) -> impl Iterator<Item = &Assessment> {
        let answered = self.0.iter().filter(|one| !one.is_refused());
        answered.filter(move |one| one.truth.kind == kind)
    }

    /// Worms with nothing wrong, or with a discrepancy put in.
    fn clean(&self, discrepant: bool) -> impl Iterator<Item = &Assessment> {
        self.of(CampaignKind::Clean)
            .filter(move |one| one.truth.is_discrepant() == discrepant)
    }

    /// Campaigns with something wrong in the recordings.
    fn spoiled(&self) -> impl Iterator<Item = &Assessment> {
        self.0.iter().filter(|one| !one.truth.artefacts.is_empty())
    }

    /// Single effects that must be found.
    fn strong(&self) -> impl Iterator<Item = &Assessment> {
        self.of(CampaignKind::Single).filter(|one| one.truth.is_strong())
    }

    fn weak(&self) -> impl Iterator<Item = &Assessment> {
        self.of(CampaignKind::Single).filter(|one| !one.truth.is_strong())
    }

    /// What the library does not know and must be noticed.
    fn strangers(&self) -> impl Iterator<Item = &Assessment> {
        self.of(CampaignKind::Stranger)
            .filter(|one| one.truth.sigma >= STRONG_SIGMA)
    }

    /// Campaigns of several effects, each of which must be found.
    fn several(&self, kind: CampaignKind) -> impl Iterator<Item = &Assessment> {
        let each_shows = |one: &&Assessment| one.truth.weakest_sigma().is_some_and(|sigma| sigma >= STRONG_SIGMA);
        self.of(kind).filter(each_shows)
    }

    /// Campaigns of this kind whose effect shows in each cycle in which it acts.
    fn in_time(&self, kind: CampaignKind) -> impl Iterator<Item = &Assessment> {
        self.of(kind)
            .filter(|one| one.truth.sigma_per_cycle >= ONSET_SIGMA_PER_CYCLE)
    }

    /// Hits of a row, and of how many; none where no row has this name.
    pub fn count(&self, what: &str) -> Option<(usize, usize)> {
        let rows = self.rows();
        let row = rows.iter().find(|row| row.what == what)?;
        Some((row.proportion.hits, row.proportion.of))
    }

    /// Every proportion.
    pub fn rows(&self) -> Vec<Row> {
        let row = |what, proportion, target| Row {
            what,
            proportion,
            target,
        };
        use CampaignKind::{Onset, Pair, Single, Spell, Triple};
        vec![
            row(
                "no answer at all",
                share(self.0.iter().filter(|one| one.truth.artefacts.is_empty()), |one| {
                    is(one, Verdict::Failed)
                }),
                "0 %",
            ),
            row(
                "artefact: refused",
                share(self.spoiled(), |one| Some(one.is_refused())),
                "",
            ),
            row(
                "artefact: named what is not there",
                share(self.spoiled().filter(|one| !one.is_refused()), names_what_is_not_there),
                "",
            ),
            row(
                "clean: an effect named",
                share(self.clean(false), names),
                "<= 3 % (MuJoCo 5 %)",
            ),
            row(
                "clean: outside the library",
                share(self.clean(false), |one| is(one, Verdict::Outside)),
                "<= 10 % (15 %)",
            ),
            row("discrepant: an effect named", share(self.clean(true), names), ""),
            row(
                "discrepant: outside the library",
                share(self.clean(true), |one| is(one, Verdict::Outside)),
                "",
            ),
            row(
                "single: strong by truth",
                share(self.of(Single), |one| Some(one.truth.is_strong())),
                "",
            ),
            row(
                "single: false second effect",
                share(self.of(Single), |one| one.false_second),
                "<= 4 % (5 %)",
            ),
            row(
                "strong: class right",
                share(self.strong(), |one| one.right_class),
                ">= 92 % (90 %)",
            ),
            row(
                "strong: strictly right",
                share(self.strong(), |one| one.strict),
                ">= 82 % (80 %)",
            ),
            row("strong: cell right", share(self.strong(), |one| one.right_cell), ""),
            row(
                "strong: agrees",
                share(self.strong(), |one| is(one, Verdict::Nothing)),
                "",
            ),
            row(
                "strong: outside the library",
                share(self.strong(), |one| is(one, Verdict::Outside)),
                "",
            ),
            row(
                "strong: 90 % interval covers",
                share(self.strong(), |one| one.covered),
                "85 to 95 % (80 to 95 %)",
            ),
            row(
                "single: 90 % interval covers",
                share(self.of(Single), |one| one.covered),
                "",
            ),
            row("weak: class right", share(self.weak(), |one| one.right_class), ""),
            row("weak: another class named", share(self.weak(), names_wrongly), ""),
            row(
                "weak: outside the library",
                share(self.weak(), |one| is(one, Verdict::Outside)),
                "",
            ),
            row(
                "stranger: detected as outside",
                share(self.strangers(), |one| is(one, Verdict::Outside)),
                ">= 65 %",
            ),
            row(
                "stranger: under another name",
                share(self.strangers(), names),
                "<= 10 %",
            ),
            row(
                "stranger: agrees",
                share(self.strangers(), |one| is(one, Verdict::Nothing)),
                "",
            ),
            row(
                "single: an onset where none is",
                share(self.of(Single), |one| one.false_onset),
                "",
            ),
            row("stated at 0.99: right", share(self.0.iter(), certain), ">= 98 % (97 %)"),
            row("named at 0.99: right", share(self.0.iter(), certain_name), ""),
            row("ambiguous: set holds truth", share(self.0.iter(), |one| one.in_set), ""),
            row(
                "ambiguous: settled by the run",
                share(self.0.iter(), |one| one.settled),
                "",
            ),
            row(
                "twins reported as twins",
                share(self.0.iter(), |one| one.twins_reported),
                "",
            ),
            row(
                "pair: one named",
                share(self.several(Pair), |one| one.of_several.map(|met| met >= 1)),
                "",
            ),
            row(
                "pair: both named",
                share(self.several(Pair), |one| one.of_several.map(|met| met >= 2)),
                ">= 75 %",
            ),
            row(
                "triple: two named",
                share(self.several(Triple), |one| one.of_several.map(|met| met >= 2)),
                "",
            ),
            row(
                "onset: class right",
                share(self.in_time(Onset), |one| one.right_class),
                ">= 85 %",
            ),
            row(
                "onset: within one cycle",
                share(self.in_time(Onset), |one| one.onset_right),
                ">= 85 %",
            ),
            row(
                "spell: class right",
                share(self.in_time(Spell), |one| one.right_class),
                "",
            ),
            row(
                "spell: both ends within one cycle",
                share(self.in_time(Spell), |one| one.onset_right),
                "",
            ),
        ]
    }

    /// Every median: its name, its value and the number of cases.
    pub fn medians(&self) -> [(&'static str, Option<f64>, usize); 3] {
        let of = |what, value: fn(&Assessment) -> Option<f64>| {
            let values: Vec<f64> = self.strong().filter_map(value).collect();
            let count = values.len();
            (what, median(values), count)
        };
        [
            of("strong: median closure", |one| one.closure),
            of("strong: median margin", |one| one.margin),
            of("strong: median severity error", |one| one.severity_error),
        ]
    }

    /// Writes a row for every case.
    ///
    /// # Errors
    /// When `to` cannot be written.
    pub fn write_csv(&self, to: impl io::Write) -> Result<(), csv::Error> {
        let mut out = csv::Writer::from_writer(to);
        out.write_record([
            "bed",
            "split",
            "case",
            "kind",
            "truth",
            "cell",
            "parameters",
            "sigma",
            "weakest_sigma",
            "sigma_per_cycle",
            "impact",
            "discrepancy_m",
            "noise_m",
            "cells",
            "cycle_s",
            "verdict",
            "top",
            "named",
            "probability",
            "probability_right",
            "right_class",
            "strict",
            "right_cell",
            "false_second",
            "closure",
            "margin",
            "severity_error",
            "covered",
            "in_set",
            "twins_reported",
            "of_several",
            "onset_right",
            "false_onset",
            "artefacts",
            "settled",
        ])?;
        for one in self.0 {
            let truth = &one.truth;
            let effects =
                |each: &dyn Fn(&TrueEffect) -> String| truth.effects.iter().map(each).collect::<Vec<_>>().join("; ");
            let hidden = truth
                .stranger
                .clone()
                .unwrap_or_else(|| effects(&|effect| effect.name.clone()));
            out.write_record([
                truth.bed.clone(),
                truth.split.clone(),
                truth.case.clone(),
                format!("{:?}", truth.kind).to_lowercase(),
                hidden,
                effects(&|effect| cell_of(effect.cell.map(|cell| cell + 1))),
                effects(&|effect| {
                    let each = effect.parameters.iter().map(|(name, value)| format!("{name}={value}"));
                    each.collect::<Vec<_>>().join(" ")
                }),
                truth.sigma.to_string(),
                cell_of(truth.weakest_sigma()),
                truth.sigma_per_cycle.to_string(),
                truth.impact().to_string(),
                truth.discrepancy_m.to_string(),
                truth.noise_m.to_string(),
                truth.cells.to_string(),
                truth.cycle_s.to_string(),
                one.verdict.name().to_owned(),
                one.top.clone().unwrap_or_default(),
                one.named.to_string(),
                cell_of(one.stated.map(|stated| stated.0)),
                cell_of(one.stated.map(|stated| stated.1)),
                cell_of(one.right_class),
                cell_of(one.strict),
                cell_of(one.right_cell),
                cell_of(one.false_second),
                cell_of(one.closure),
                cell_of(one.margin),
                cell_of(one.severity_error),
                cell_of(one.covered),
                cell_of(one.in_set),
                cell_of(one.twins_reported),
                cell_of(one.of_several),
                cell_of(one.onset_right),
                cell_of(one.false_onset),
                truth.artefacts.join("; "),
                cell_of(one.settled),
            ])?;
        }
        out.flush()?;
        Ok(())
    }
}

/// The proportion among those to which a question applies.
fn share<'a>(each: impl Iterator<Item = &'a Assessment>, value: fn(&Assessment) -> Option<bool>) -> Proportion {
    Proportion::count(each.map(value))
}

fn is(one: &Assessment, verdict: Verdict) -> Option<bool> {
    Some(one.verdict == verdict)
}

fn names(one: &Assessment) -> Option<bool> {
    Some(one.verdict.names())
}

/// Whether an answer that states certainty is right.
fn certain(one: &Assessment) -> Option<bool> {
    one.stated.filter(|stated| stated.0 >= CERTAIN).map(|stated| stated.1)
}

fn certain_name(one: &Assessment) -> Option<bool> {
    certain(one).filter(|_| one.verdict.names())
}

/// Whether a clean worm is given an effect, or another class than the true one is named first, or a second effect.
fn names_what_is_not_there(one: &Assessment) -> Option<bool> {
    let clean = one.truth.kind == CampaignKind::Clean && one.verdict.names();
    Some(clean || names_wrongly(one) == Some(true) || one.false_second == Some(true))
}

/// Whether something is named that is not there.
fn names_wrongly(one: &Assessment) -> Option<bool> {
    one.right_class.map(|right| one.verdict.names() && !right)
}

impl fmt::Display for ScoreTable<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Row {
            what,
            proportion,
            target,
        } in self.rows()
        {
            writeln!(out, "{what:<34} {:<28} {target}", proportion.to_string())?;
        }
        for (what, median, of) in self.medians() {
            let value = median.map_or("none".to_owned(), |median| format!("{:.1} % of {of}", 100.0 * median));
            writeln!(out, "{what:<34} {value}")?;
        }
        write!(out, "{}", Curves(self.0))
    }
}

fn cell_of(value: Option<impl ToString>) -> String {
    value.map_or(String::new(), |value| value.to_string())
}

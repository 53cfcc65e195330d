//! Many judgements in one table, each share with its Wilson interval and what is aimed at.

use super::assessment::{Assessment, Verdict};
use super::campaign::CampaignKind;
use std::fmt;
use std::io;

/// Significance from which an effect counts as detectable, standard deviations.
const DETECTABLE_SIGMA: f64 = 5.0;
/// Of the normal distribution, for intervals of 95 %.
const Z: f64 = 1.96;

/// How many of how many.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Proportion {
    pub hits: usize,
    pub of: usize,
}

impl Proportion {
    /// Counts what is true among what applies.
    pub fn count(each: impl Iterator<Item = Option<bool>>) -> Self {
        each.flatten().fold(Self::default(), |fraction, hit| Self {
            hits: fraction.hits + usize::from(hit),
            of: fraction.of + 1,
        })
    }

    /// Wilson's 95 % interval for the share; all from 0 to 1 where there is nothing to count.
    pub fn wilson(self) -> [f64; 2] {
        if self.of == 0 {
            return [0.0, 1.0];
        }
        let (n, p) = (self.of as f64, self.hits as f64 / self.of as f64);
        let centre = p + Z * Z / (2.0 * n);
        let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
        let scale = 1.0 + Z * Z / n;
        [((centre - half) / scale).max(0.0), ((centre + half) / scale).min(1.0)]
    }
}

impl fmt::Display for Proportion {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.of == 0 {
            return write!(out, "{:>22}", "none");
        }
        let percent = |fraction: f64| 100.0 * fraction;
        let [low, high] = self.wilson().map(percent);
        let fraction = percent(self.hits as f64 / self.of as f64);
        write!(
            out,
            "{:>3}/{:<3} {fraction:5.1} % ({low:.0} to {high:.0})",
            self.hits, self.of
        )
    }
}

/// The whole of the scores.
#[derive(Debug)]
pub struct ScoreTable<'a>(pub &'a [Assessment]);

impl ScoreTable<'_> {
    fn of(&self, kind: CampaignKind) -> impl Iterator<Item = &Assessment> {
        self.0.iter().filter(move |assessment| assessment.kind == kind)
    }

    /// Single effects that the library itself says are detectable.
    fn detectable(&self) -> impl Iterator<Item = &Assessment> {
        self.of(CampaignKind::Single)
            .filter(|assessment| assessment.significance_sigma >= DETECTABLE_SIGMA)
    }

    /// Every share: what it is of, itself, and what is aimed at.
    pub fn fractions(&self) -> Vec<(&'static str, Proportion, &'static str)> {
        let abstains =
            |assessment: &Assessment| Some(matches!(assessment.verdict, Verdict::Nothing | Verdict::Outside));
        let settled = |assessment: &&Assessment| assessment.settled.is_some();
        vec![
            (
                "no answer at all",
                Proportion::count(self.0.iter().map(|one| Some(one.verdict == Verdict::Failed))),
                "0 %",
            ),
            (
                "singles at least 5 sigma",
                Proportion::count(
                    self.of(CampaignKind::Single)
                        .map(|one| Some(one.significance_sigma >= DETECTABLE_SIGMA)),
                ),
                "",
            ),
            (
                "class, top 1, at least 5 sigma",
                Proportion::count(self.detectable().map(|one| one.right_class)),
                ">= 90 %",
            ),
            (
                "class, top 1, every severity",
                Proportion::count(self.of(CampaignKind::Single).map(|one| one.right_class)),
                "",
            ),
            (
                "strict, at least 5 sigma",
                Proportion::count(self.detectable().map(|one| one.strict)),
                ">= 75 %",
            ),
            (
                "faulty cell",
                Proportion::count(self.detectable().map(|one| one.right_cell)),
                ">= 95 %",
            ),
            (
                "clean, falsely named",
                Proportion::count(self.of(CampaignKind::Clean).map(|one| Some(one.verdict.names()))),
                "<= 5 %",
            ),
            (
                "clean, called outside",
                Proportion::count(
                    self.of(CampaignKind::Clean)
                        .map(|one| Some(one.verdict == Verdict::Outside)),
                ),
                "",
            ),
            (
                "outside, abstained",
                Proportion::count(self.of(CampaignKind::Outside).map(abstains)),
                ">= 80 %",
            ),
            (
                "outside, seen to be outside",
                Proportion::count(
                    self.of(CampaignKind::Outside)
                        .map(|one| Some(one.verdict == Verdict::Outside)),
                ),
                "",
            ),
            (
                "90 % interval covers",
                Proportion::count(self.detectable().map(|one| one.covered)),
                "85 to 95 %",
            ),
            (
                "ambiguous set holds the truth",
                Proportion::count(self.0.iter().map(|one| one.in_set)),
                "",
            ),
            (
                "ambiguous, settled by proposal",
                Proportion::count(self.0.iter().filter(settled).map(|one| one.settled)),
                ">= 80 %",
            ),
            (
                "pairs, one right",
                Proportion::count(self.0.iter().map(|one| one.of_pair.map(|met| met >= 1))),
                ">= 95 %",
            ),
            (
                "pairs, both right",
                Proportion::count(self.0.iter().map(|one| one.of_pair.map(|met| met >= 2))),
                ">= 65 %",
            ),
            (
                "twins reported as twins",
                Proportion::count(self.0.iter().map(|one| one.twins_reported)),
                "100 %",
            ),
        ]
    }

    /// Every median: what it is of, itself with the count, and what is aimed at.
    pub fn medians(&self) -> [(&'static str, Option<f64>, usize, &'static str); 3] {
        let of = |value: fn(&Assessment) -> Option<f64>| {
            let mut values: Vec<f64> = self.detectable().filter_map(value).collect();
            values.sort_by(f64::total_cmp);
            (median(&values), values.len())
        };
        let (closure, margin) = (of(|one| one.closure), of(|one| one.margin));
        let severity = of(|one| one.severity_error);
        [
            ("median held-out closure", closure.0, closure.1, ">= 90 %"),
            ("median margin", margin.0, margin.1, ""),
            ("median severity error", severity.0, severity.1, "<= 10 %"),
        ]
    }

    /// Writes a row for every case.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write_csv(&self, to: impl io::Write) -> Result<(), csv::Error> {
        let mut out = csv::Writer::from_writer(to);
        out.write_record([
            "case",
            "kind",
            "truth",
            "cell",
            "parameters",
            "advance_rms_m",
            "within_cycle_rms_m",
            "verdict",
            "top",
            "significance_sigma",
            "right_class",
            "strict",
            "right_cell",
            "closure",
            "margin",
            "severity_error",
            "covered",
            "in_set",
            "twins_reported",
            "of_pair",
            "settled",
        ])?;
        for one in self.0 {
            let truths = |each: &dyn Fn(&super::effect::TrueEffect) -> String| {
                one.truth.iter().map(each).collect::<Vec<_>>().join("; ")
            };
            out.write_record([
                one.case.clone(),
                format!("{:?}", one.kind).to_lowercase(),
                truths(&|truth| truth.name.to_owned()),
                truths(&|truth| truth.cell.map_or(String::new(), |cell| (cell + 1).to_string())),
                truths(&|truth| {
                    let each = truth.parameters.iter().map(|(name, value)| format!("{name}={value}"));
                    each.collect::<Vec<_>>().join(" ")
                }),
                one.effect_size_m[0].to_string(),
                one.effect_size_m[1].to_string(),
                one.verdict.name().to_owned(),
                one.top.clone().unwrap_or_default(),
                one.significance_sigma.to_string(),
                cell_of(one.right_class),
                cell_of(one.strict),
                cell_of(one.right_cell),
                cell_of(one.closure),
                cell_of(one.margin),
                cell_of(one.severity_error),
                cell_of(one.covered),
                cell_of(one.in_set),
                cell_of(one.twins_reported),
                cell_of(one.of_pair),
                cell_of(one.settled),
            ])?;
        }
        out.flush()?;
        Ok(())
    }
}

impl fmt::Display for ScoreTable<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (what, fraction, aim) in self.fractions() {
            writeln!(out, "{what:<32} {:<28} {aim}", fraction.to_string())?;
        }
        for (what, median, of, aim) in self.medians() {
            let told = median.map_or("none".to_owned(), |median| format!("{:.1} % of {of}", 100.0 * median));
            writeln!(out, "{what:<32} {told:<28} {aim}")?;
        }
        Ok(())
    }
}

/// The middle of sorted values.
fn median(sorted: &[f64]) -> Option<f64> {
    let upper = sorted.get(sorted.len() / 2)?;
    let lower = sorted[(sorted.len() - 1) / 2];
    Some(0.5 * (lower + upper))
}

fn cell_of(value: Option<impl ToString>) -> String {
    value.map_or(String::new(), |value| value.to_string())
}

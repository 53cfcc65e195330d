//! The scored part of an explanation, and how it is read from the JSON of `wormd explain`.
//!
//! It is read field by field, so that the score depends on the published JSON only.

use super::follow_up::Condition;
use serde_json::Value;

/// Standard errors to either end of a 90 % interval.
const NINETY_PERCENT: f64 = 1.645;

/// The conclusion of an explanation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The nominal worm, recalibrated, explains everything.
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
    /// The effects that, by the answer, position data cannot distinguish from this one.
    pub twins: Vec<String>,
    pub parameters: Vec<Estimate>,
}

/// The next step that an answer proposes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Proposal {
    /// One more run.
    Run(Condition),
    /// Something to be measured on the bench, which no run can replace.
    Measurement,
}

/// Where an effect begins, by an answer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FoundOnset {
    /// Gait cycles since the recording's start.
    pub cycle: Option<f64>,
    /// Time in the recording, s.
    pub time_s: Option<f64>,
    /// The run in which it begins, from 0; none where it begins in every run.
    pub run: Option<usize>,
    /// The effect ends there, instead.
    pub ends: bool,
    /// Where it ends again, gait cycles since the recording's start; none where it stays.
    pub until_cycle: Option<f64>,
}

/// The scored part of an explanation.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    pub verdict: Verdict,
    /// The effects in the corrected model, the most significant first.
    pub named: Vec<Named>,
    /// The other members of an ambiguous set.
    pub rivals: Vec<Named>,
    /// Probability that the answer gives to its verdict; none where it states none.
    pub probability: Option<f64>,
    /// Where the effect begins, where it says so.
    pub onset: Option<FoundOnset>,
    /// Share of the recalibrated worm's held-out gap to the noise floor that the named effect closes.
    pub closure: Option<f64>,
    /// Closure beyond the best wrong rival's.
    pub margin: Option<f64>,
    /// What would separate the set.
    pub proposal: Option<Proposal>,
}

impl Answer {
    /// No answer at all.
    pub fn failed() -> Self {
        Self {
            verdict: Verdict::Failed,
            named: Vec::new(),
            rivals: Vec::new(),
            probability: None,
            onset: None,
            closure: None,
            margin: None,
            proposal: None,
        }
    }

    /// Reads the JSON object that `wormd explain --json` prints; the proposal is left out.
    ///
    /// # Errors
    /// When it is no such object, or an onset lies in a run that it does not list.
    pub fn from_json(report: &Value) -> Result<Self, String> {
        let verdict = match report["verdict"].as_str() {
            Some("agrees") => Verdict::Nothing,
            Some("explained") => Verdict::Named,
            Some("ambiguous") => Verdict::Ambiguous,
            Some("outside-library") => Verdict::Outside,
            other => return Err(format!("the verdict is {other:?}: not the JSON of `wormd explain`")),
        };
        let each = |list: &Value| -> Vec<Named> { list.as_array().into_iter().flatten().map(named).collect() };
        let first = &report["effects"][0];
        let probability = match verdict {
            Verdict::Named | Verdict::Ambiguous => first["probability"].as_f64(),
            Verdict::Nothing => report["null_probability"].as_f64(),
            Verdict::Outside => report["other_probability"].as_f64(),
            Verdict::Failed => None,
        };
        let onsets = [&first["onset"], &report["onset"]].map(|value| onset(value, &report["runs"]));
        let [of_effect, of_all] = onsets;
        Ok(Self {
            verdict,
            named: each(&report["effects"]),
            rivals: each(&report["rivals"]),
            probability,
            onset: of_effect?.or(of_all?),
            closure: first["closure"].as_f64(),
            margin: first["margin"].as_f64(),
            proposal: None,
        })
    }

    pub fn names(&self) -> bool {
        self.verdict.names()
    }

    /// The first effect named.
    pub fn top(&self) -> Option<&Named> {
        self.named.first().filter(|_| self.names())
    }

    /// All that is named or as good.
    pub fn members(&self) -> impl Iterator<Item = &Named> {
        self.named.iter().chain(&self.rivals)
    }
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

fn named(effect: &Value) -> Named {
    let list = |value: &'_ Value| value.as_array().cloned().unwrap_or_default();
    Named {
        name: text(&effect["name"]),
        cell: effect["cell"].as_u64().map(|cell| (cell as usize).saturating_sub(1)),
        twins: list(&effect["twins"]).iter().map(text).collect(),
        parameters: list(&effect["parameters"])
            .iter()
            .filter_map(|found| {
                let value = found["value"].as_f64()?;
                let reach = NINETY_PERCENT * found["sigma"].as_f64().unwrap_or(f64::INFINITY);
                Some(Estimate {
                    name: text(&found["name"]),
                    value,
                    low: found["low"].as_f64().unwrap_or(value - reach),
                    high: found["high"].as_f64().unwrap_or(value + reach),
                })
            })
            .collect(),
    }
}

/// An onset, or the first of a list of them; its run is one of the listed runs, by the name of the recording.
fn onset(value: &Value, runs: &Value) -> Result<Option<FoundOnset>, String> {
    let value = value.get(0).unwrap_or(value);
    let run = match value["run"].as_str() {
        None => None,
        Some(name) => {
            let mut listed = runs.as_array().into_iter().flatten();
            let place = listed.position(|run| run["recording"] == name);
            Some(place.ok_or_else(|| format!("an onset lies in run {name:?}, which is none of the listed runs"))?)
        }
    };
    let found = FoundOnset {
        cycle: value["cycle"].as_f64(),
        time_s: value["time_s"].as_f64(),
        run,
        ends: value["ends"].as_bool().unwrap_or(false),
        until_cycle: value["until_cycle"].as_f64(),
    };
    Ok((found.cycle.is_some() || found.time_s.is_some()).then_some(found))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn an_answer_is_read_field_by_field() {
        let report = json!({
            "verdict": "explained",
            "effects": [{
                "name": "unequal-clamping", "cell": 2, "twins": ["friction of cell 2"], "closure": 0.9, "margin": 0.4, "probability": 0.97,
                "parameters": [{"name": "friction_factor", "value": 0.7, "sigma": 0.01, "unit": ""}],
                "onset": {"cycle": 6.0, "time_s": 15.0, "run": "b.csv"},
            }],
            "rivals": [],
            "runs": [{"recording": "a.csv"}, {"recording": "b.csv"}],
        });
        let answer = Answer::from_json(&report).expect("a report");
        assert_eq!(answer.verdict, Verdict::Named);
        assert_eq!(answer.named[0].cell, Some(1));
        assert_eq!(answer.probability, Some(0.97));
        let onset = FoundOnset {
            cycle: Some(6.0),
            time_s: Some(15.0),
            run: Some(1),
            ends: false,
            until_cycle: None,
        };
        assert_eq!(answer.onset, Some(onset));
        let mut elsewhere = report.clone();
        elsewhere["effects"][0]["onset"]["run"] = json!("c.csv");
        assert!(Answer::from_json(&elsewhere).is_err());
        let mut throughout = report.clone();
        throughout["effects"][0]["onset"] = Value::Null;
        assert_eq!(Answer::from_json(&throughout).map(|answer| answer.onset), Ok(None));
        let estimate = &answer.named[0].parameters[0];
        assert!((estimate.low - 0.68355).abs() < 1e-9 && (estimate.high - 0.71645).abs() < 1e-9);
        let agrees = json!({"verdict": "agrees", "effects": [], "rivals": [], "null_probability": 0.8});
        let agrees = Answer::from_json(&agrees).expect("a report");
        assert_eq!((agrees.verdict, agrees.probability), (Verdict::Nothing, Some(0.8)));
        assert!(Answer::from_json(&json!({"error": "no"})).is_err());
    }
}

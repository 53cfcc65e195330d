//! What a soak found, as text and as JSON.

use serde::Serialize;
use std::fmt;

/// The energies of a cycle that are held against the ledger.
pub const QUANTITIES: [&str; 6] = [
    "loss (11)",
    "net (13)",
    "positive (13)",
    "electrical",
    "copper",
    "inside",
];

/// Findings that are listed; more are only counted.
const LISTED: usize = 20;
/// Findings of one sort that are listed, so that a frequent sort does not hide the others.
const LISTED_OF_A_SORT: usize = 3;

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FindingKind {
    /// An invariant is broken.
    Invariant,
    /// An alarm that no fault explains.
    FalseAlarm,
    /// A fault that had to be noticed and was not.
    Missed,
    /// A fault that was noticed after its bound.
    Late,
}

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What.
    pub kind: FindingKind,
    /// The segment.
    pub segment: u64,
    /// Time in the segment, s.
    pub time_s: f64,
    /// Which sort it is of: the rule, or the alarm, and the fault under way.
    pub sort: String,
    /// What happened.
    pub text: String,
    /// A command line that runs exactly this segment again.
    pub command: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:?} at {:.3} s of segment {}: {}\n  {}",
            self.kind, self.time_s, self.segment, self.text, self.command
        )
    }
}

/// How many findings are of one sort.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SortCount {
    /// What is wrong.
    pub kind: FindingKind,
    /// The sort: the rule, or the alarm, and the fault under way.
    pub sort: String,
    /// How many findings.
    pub findings: u64,
    /// In how many segments.
    pub segments: u64,
}

/// What is wrong in a segment.
#[derive(Debug, Clone)]
pub struct Found {
    /// What.
    pub kind: FindingKind,
    /// Time in the segment, s.
    pub time_s: f64,
    /// Which sort it is of: the rule, or the alarm, and the fault under way.
    pub sort: String,
    /// What happened.
    pub text: String,
}

/// One kind of fault.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct FaultTally {
    /// Its name.
    pub fault: &'static str,
    /// How often it was drawn.
    pub drawn: u64,
    /// How often something was noticed of it.
    pub noticed: u64,
    /// How often it was noticed after its bound.
    pub late: u64,
    /// How often it had to be noticed and was not.
    pub missed: u64,
    /// The longest time until it was noticed, where it had to be, s.
    pub slowest_s: f64,
}

/// Error of one energy per settled cycle against the ledger.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct EnergyError {
    /// Which energy.
    pub energy: &'static str,
    /// Cycles that were compared.
    pub cycles: u64,
    /// Mean error, %.
    pub mean_percent: f64,
    /// Root mean square of the errors, %.
    pub rms_percent: f64,
    /// Largest error, %.
    pub worst_percent: f64,
}

/// Sums over errors, %.
#[derive(Debug, Clone, Copy, Default)]
pub struct ErrorSums {
    count: u64,
    sum: f64,
    squares: f64,
    worst: f64,
}

impl ErrorSums {
    /// Adds one error, %.
    pub fn add(&mut self, percent: f64) {
        self.count += 1;
        self.sum += percent;
        self.squares += percent * percent;
        if percent.abs() > self.worst.abs() {
            self.worst = percent;
        }
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.squares += other.squares;
        if other.worst.abs() > self.worst.abs() {
            self.worst = other.worst;
        }
    }
}

/// What one segment came to.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Its number.
    pub segment: u64,
    /// Simulated time, s.
    pub time_s: f64,
    /// Gait cycles that the worm did.
    pub cycles: u64,
    /// Alarms that a fault explains.
    pub true_alarms: u64,
    /// How often the operator had to permit motion despite standing alarms by a reset.
    pub permitted: u64,
    /// By kind of fault, in the order of the table.
    pub faults: Vec<FaultTally>,
    /// By energy.
    pub energies: [ErrorSums; QUANTITIES.len()],
    /// What is wrong.
    pub findings: Vec<Found>,
}

impl Tally {
    /// What is wrong in this segment of a soak with a seed.
    pub fn findings_of(&self, seed: u64) -> impl Iterator<Item = Finding> + '_ {
        self.findings.iter().map(move |found| Finding {
            kind: found.kind,
            segment: self.segment,
            time_s: found.time_s,
            sort: found.sort.clone(),
            text: found.text.clone(),
            command: format!("wormd soak --seed {seed} --segment {}", self.segment),
        })
    }
}

/// What a soak found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SoakReport {
    /// Seed of everything that was drawn.
    pub seed: u64,
    /// Segments that were run.
    pub segments: u64,
    /// Simulated time, h.
    pub hours: f64,
    /// Time that it took, s.
    pub took_s: f64,
    /// Simulated hours per minute.
    pub hours_per_minute: f64,
    /// Ticks per second.
    pub rate_hz: f64,
    /// Length of the plant's steps, s.
    pub step_s: f64,
    /// Gait cycles.
    pub cycles: u64,
    /// Faults that were drawn.
    pub drawn: u64,
    /// Alarms that a fault explains.
    pub alarms_true: u64,
    /// Alarms that no fault explains.
    pub alarms_false: u64,
    /// How often the operator had to permit motion despite standing alarms by a reset.
    pub motion_permitted: u64,
    /// Faults that had to be noticed and were not.
    pub missed: u64,
    /// Faults that were noticed after their bound.
    pub late: u64,
    /// Segments in which an invariant was broken; each ends there.
    pub broken: u64,
    /// By kind of fault.
    pub faults: Vec<FaultTally>,
    /// Energy per settled cycle without a fault, against the virtual worm's ledger.
    pub energies: Vec<EnergyError>,
    /// How many findings there are of each sort.
    pub sorts: Vec<SortCount>,
    /// The first things that are wrong of each sort, in the order of the segments, broken invariants first.
    pub findings: Vec<Finding>,
}

impl SoakReport {
    /// Sums up the segments.
    pub fn of(seed: u64, tallies: &[Tally], took_s: f64) -> Self {
        let sum = |part: fn(&Tally) -> u64| tallies.iter().map(part).sum::<u64>();
        let count = |kind| {
            let of_kind = |tally: &Tally| tally.findings.iter().filter(|finding| finding.kind == kind).count() as u64;
            tallies.iter().map(of_kind).sum::<u64>()
        };
        let hours = tallies.iter().map(|tally| tally.time_s).sum::<f64>() / 3600.0;
        let mut faults: Vec<FaultTally> = Vec::new();
        for tally in tallies {
            for one in &tally.faults {
                match faults.iter_mut().find(|fault| fault.fault == one.fault) {
                    Some(fault) => {
                        fault.drawn += one.drawn;
                        fault.noticed += one.noticed;
                        fault.late += one.late;
                        fault.missed += one.missed;
                        fault.slowest_s = fault.slowest_s.max(one.slowest_s);
                    }
                    None => faults.push(one.clone()),
                }
            }
        }
        let energies = QUANTITIES.iter().enumerate().map(|(index, energy)| {
            let mut sums = ErrorSums::default();
            tallies.iter().for_each(|tally| sums.merge(&tally.energies[index]));
            let count = (sums.count as f64).max(1.0);
            EnergyError {
                energy,
                cycles: sums.count,
                mean_percent: sums.sum / count,
                rms_percent: (sums.squares / count).sqrt(),
                worst_percent: sums.worst,
            }
        });
        let mut all: Vec<Finding> = tallies.iter().flat_map(|tally| tally.findings_of(seed)).collect();
        all.sort_by_key(|finding| (finding.kind, finding.segment));
        let sorts = count_sorts(&all);
        let mut listed: Vec<Finding> = Vec::new();
        for finding in all {
            let is_like = |other: &&Finding| (other.kind, &other.sort) == (finding.kind, &finding.sort);
            if listed.len() < LISTED && listed.iter().filter(is_like).count() < LISTED_OF_A_SORT {
                listed.push(finding);
            }
        }
        Self {
            seed,
            segments: tallies.len() as u64,
            hours,
            took_s,
            hours_per_minute: hours / (took_s / 60.0),
            rate_hz: super::RATE_HZ,
            step_s: super::STEP_S,
            cycles: sum(|tally| tally.cycles),
            drawn: faults.iter().map(|fault| fault.drawn).sum(),
            alarms_true: sum(|tally| tally.true_alarms),
            alarms_false: count(FindingKind::FalseAlarm),
            motion_permitted: sum(|tally| tally.permitted),
            missed: count(FindingKind::Missed),
            late: count(FindingKind::Late),
            broken: count(FindingKind::Invariant),
            faults,
            energies: energies.collect(),
            sorts,
            findings: listed,
        }
    }

    /// Whether everything was as it must be.
    pub fn passed(&self) -> bool {
        self.findings.is_empty()
    }
}

/// Counts the findings of each sort, the most frequent of each kind first.
fn count_sorts(findings: &[Finding]) -> Vec<SortCount> {
    let mut sorts: Vec<SortCount> = Vec::new();
    let mut last_segments: Vec<u64> = Vec::new();
    for finding in findings {
        let is_like = |sort: &SortCount| (sort.kind, &sort.sort) == (finding.kind, &finding.sort);
        let index = sorts.iter().position(is_like).unwrap_or_else(|| {
            sorts.push(SortCount {
                kind: finding.kind,
                sort: finding.sort.clone(),
                findings: 0,
                segments: 0,
            });
            last_segments.push(u64::MAX);
            sorts.len() - 1
        });
        sorts[index].findings += 1;
        if std::mem::replace(&mut last_segments[index], finding.segment) != finding.segment {
            sorts[index].segments += 1;
        }
    }
    sorts.sort_by_key(|sort| (sort.kind, std::cmp::Reverse(sort.findings)));
    sorts
}

impl fmt::Display for SoakReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "seed {}: {:.1} h in {} segments, {} gait cycles, {} faults; ticks at {} Hz, steps of {} ms; took {:.0} s ({:.1} h per minute)",
            self.seed,
            self.hours,
            self.segments,
            self.cycles,
            self.drawn,
            self.rate_hz,
            self.step_s * 1e3,
            self.took_s,
            self.hours_per_minute
        )?;
        writeln!(
            f,
            "alarms: {} true, {} false; faults: {} missed, {} late; invariants: {} broken",
            self.alarms_true, self.alarms_false, self.missed, self.late, self.broken
        )?;
        writeln!(
            f,
            "motion permitted by reset despite standing alarms: {}",
            self.motion_permitted
        )?;
        writeln!(
            f,
            "\n{:<28} {:>6} {:>8} {:>6} {:>6}  slowest",
            "fault", "drawn", "noticed", "late", "missed"
        )?;
        for fault in &self.faults {
            writeln!(
                f,
                "{:<28} {:>6} {:>8} {:>6} {:>6}  {:.3} s",
                fault.fault, fault.drawn, fault.noticed, fault.late, fault.missed, fault.slowest_s
            )?;
        }
        writeln!(f, "\nenergy per settled cycle against the ledger, %")?;
        for energy in &self.energies {
            writeln!(
                f,
                "{:<16} mean {:+.2}  rms {:.2}  worst {:+.1}  ({} cycles)",
                energy.energy, energy.mean_percent, energy.rms_percent, energy.worst_percent, energy.cycles
            )?;
        }
        if !self.sorts.is_empty() {
            writeln!(f, "\n{:<12} {:>8} {:>8}  what", "wrong", "findings", "segments")?;
        }
        for sort in &self.sorts {
            let kind = format!("{:?}", sort.kind);
            writeln!(f, "{kind:<12} {:>8} {:>8}  {}", sort.findings, sort.segments, sort.sort)?;
        }
        for finding in &self.findings {
            write!(f, "\n{finding}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frequent sort is counted and listed thrice; it hides none of the others.
    #[test]
    fn every_sort_of_finding_is_counted_and_listed() {
        let found = |kind, sort: &str| Found {
            kind,
            time_s: 1.0,
            sort: sort.to_owned(),
            text: sort.to_owned(),
        };
        let mut tallies: Vec<Tally> = (0..40)
            .map(|segment| Tally {
                segment,
                findings: vec![
                    found(FindingKind::FalseAlarm, "often"),
                    found(FindingKind::FalseAlarm, "often"),
                ],
                ..Tally::default()
            })
            .collect();
        tallies[39].findings.push(found(FindingKind::FalseAlarm, "once"));
        tallies[38].findings.push(found(FindingKind::Invariant, "rule"));
        let report = SoakReport::of(1, &tallies, 1.0);
        assert_eq!((report.alarms_false, report.broken, report.passed()), (81, 1, false));
        let sorts: Vec<_> = report
            .sorts
            .iter()
            .map(|sort| (sort.sort.as_str(), sort.findings, sort.segments))
            .collect();
        assert_eq!(sorts, [("rule", 1, 1), ("often", 80, 40), ("once", 1, 1)]);
        let listed: Vec<_> = report.findings.iter().map(|finding| finding.sort.as_str()).collect();
        assert_eq!(listed, ["rule", "often", "often", "often", "once"]);
        assert!(
            report.to_string().contains("FalseAlarm         80       40  often"),
            "{report}"
        );
    }
}

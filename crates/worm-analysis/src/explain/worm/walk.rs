//! A crawl through the samples of a recording: simulated from knot to knot until it repeats, and then repeated.

use super::clock::Clock;
use super::gears::GearErrors;
use super::observed::Observed;
use super::predicted::Predicted;
use super::start::{LEAD_CYCLES, start};
use super::track::Track;
use worm_physics::{Crawl, Mechanics};

/// Difference of two phases below which the drive rests, cycles.
const RESTS: f64 = 1e-12;

/// A crawl through the samples of a recording.
pub(in crate::explain) struct Walk<'a> {
    observed: &'a Observed<'a>,
    clock: Clock<'a>,
    crawl: Crawl,
    /// The cycle that it repeats, where that is known from the start.
    settled: Option<Track<'a>>,
    /// Phase of the last sample that was reached.
    before: f64,
    position_m: Vec<f64>, // `[sample][cell]`, flat, of the samples so far
    work_j: Vec<f64>,     // of the drive, up to each of them; empty where no current counts
    phase: Vec<f64>,      // that each of them shows; likewise
    begun_j: f64,         // work before the crawl's ledger began
}

impl<'a> Walk<'a> {
    /// From the first sample on; none where the worm slides down. The crawl of a worm that was under way has settled where it comes to
    /// repeat.
    pub fn begin(
        observed: &'a Observed<'a>,
        mut clock: Clock<'a>,
        mechanics: &Mechanics,
        damping: f64,
        may_repeat: bool,
    ) -> Option<Self> {
        let first = clock.phase_at(0);
        let settles = may_repeat && !observed.laid_down && !observed.pauses;
        let crawl = match &observed.settled {
            Some(settled) if settles => {
                let mut crawl = settled.clone();
                crawl.set_damping_ratio(Some(damping));
                crawl
            }
            _ => start(
                observed,
                mechanics,
                first,
                damping,
                if settles { 0 } else { LEAD_CYCLES },
            )?,
        };
        let mut walk = Self {
            observed,
            clock,
            crawl,
            settled: None,
            before: first,
            position_m: Vec::with_capacity(observed.cells() * observed.samples()),
            work_j: Vec::new(),
            phase: Vec::new(),
            begun_j: 0.0,
        };
        if settles {
            let first_knot = walk.knot_from(first);
            walk.crawl.begin_at_phase(mechanics, first_knot, &observed.first_m);
            let passes = (first, &observed.first_m[..]);
            walk.settled = Some(Track::settled(&mut walk.crawl, mechanics, observed, passes)?);
        }
        Some(walk)
    }

    /// The crawl after a cycle that repeats from the start; none for one that does not.
    pub fn into_settled(self) -> Option<Crawl> {
        self.settled.is_some().then_some(self.crawl)
    }

    /// Goes on through the samples up to a phase, which may be infinite; none where the worm slides down.
    pub fn go_to(&mut self, mechanics: &Mechanics, until: f64, may_repeat: bool) -> Option<()> {
        if self.observed.pauses {
            // What happens then is not a matter of the phase.
            return self.simulate(mechanics, until);
        }
        let mut track = match self.settled.take() {
            Some(track) => track,
            None => {
                self.simulate(mechanics, self.knot_from(self.crawl.phase()).min(until))?;
                Track::begin(&self.crawl, self.observed, may_repeat)
            }
        };
        self.follow(&mut track, mechanics, until)?;
        if self.next_sample() < self.observed.samples() && track.repeats() {
            self.begin_anew(&track, mechanics, until)?;
        }
        self.simulate(mechanics, until)
    }

    /// Phase of the first knot from a phase on.
    fn knot_from(&self, phase: f64) -> f64 {
        let per_cycle = self.observed.pace.knots() as f64;
        (phase * per_cycle).ceil() / per_cycle
    }

    /// Phase from which the crawl counts its cycles: that of its beginning, or the last at which it went on from what repeats.
    pub fn counts_from(&self) -> f64 {
        self.crawl.first_phase()
    }

    /// Changes the mechanics: nothing moves.
    pub fn take_up(&mut self, mechanics: &Mechanics) {
        self.crawl.take_up(mechanics);
    }

    /// The positions at all samples, as a camera with some scale sees them.
    pub fn seen_at(mut self, scale: f64) -> Predicted {
        self.position_m.iter_mut().for_each(|at_m| *at_m *= scale);
        Predicted {
            work_j: self.work_at_samples_j(),
            position_m: self.position_m,
            gears: GearErrors::default(),
        }
    }

    /// Work up to the phase that was recorded with each sample, J: the current is not as late as the positions are. Nothing where no current
    /// counts.
    fn work_at_samples_j(&self) -> Vec<f64> {
        let Some(last) = self.work_j.len().checked_sub(1) else {
            return Vec::new();
        };
        let mut after = 1;
        let at = |phase: &f64| {
            while after < last && self.phase[after] < *phase {
                after += 1;
            }
            let (low, high) = (self.phase[after - 1], self.phase[after]);
            let (low_j, high_j) = (self.work_j[after - 1], self.work_j[after]);
            if high > low {
                low_j + (high_j - low_j) * (phase - low) / (high - low)
            } else {
                high_j
            }
        };
        self.observed.phase.iter().map(at).collect()
    }

    /// Whether the drive's work is needed.
    fn counts_work(&self) -> bool {
        self.observed.torque.is_some()
    }

    fn next_sample(&self) -> usize {
        self.position_m.len() / self.observed.cells()
    }

    /// Simulates from sample to sample up to a phase.
    fn simulate(&mut self, mechanics: &Mechanics, until: f64) -> Option<()> {
        for sample in self.next_sample()..self.observed.samples() {
            let phase = self.clock.phase_at(sample);
            if phase > until {
                return self.advance(mechanics, until, sample, phase);
            }
            self.advance(mechanics, phase, sample, phase)?;
            self.position_m.extend_from_slice(self.crawl.positions_m());
            if self.counts_work() {
                self.work_j.push(self.begun_j + self.crawl.ledger().actuator_net_j);
                self.phase.push(phase);
            }
            self.before = phase;
        }
        Some(())
    }

    /// Advances to a phase on the way to a sample, at the pace at which the recording came to it.
    fn advance(&mut self, mechanics: &Mechanics, phase: f64, sample: usize, phase_of_sample: f64) -> Option<()> {
        let time_s = &self.observed.run.recording.time_s;
        let whole_s = time_s[sample] - time_s[sample.saturating_sub(1)];
        let whole = phase_of_sample - self.before;
        let duration_s = if whole.abs() < RESTS {
            whole_s
        } else {
            whole_s * (phase - self.crawl.phase()) / whole
        };
        self.crawl.advance_to(mechanics, phase, duration_s.max(0.0)).ok()
    }

    /// Takes the samples up to a phase from a track, or up to the last knot before that phase.
    fn follow(&mut self, track: &mut Track<'_>, mechanics: &Mechanics, until: f64) -> Option<()> {
        for sample in self.next_sample()..self.observed.samples() {
            let phase = self.clock.phase_at(sample);
            if phase > until {
                break;
            }
            while !track.reaches(phase) {
                if track.next_phase() > until {
                    return Some(());
                }
                track.advance(&mut self.crawl, mechanics)?;
            }
            track.extend(phase, &mut self.position_m);
            if self.counts_work() {
                self.work_j.push(self.begun_j + track.work_j(phase));
                self.phase.push(phase);
            }
            self.before = phase;
        }
        Some(())
    }

    /// Brings the crawl to a phase of a track that repeats.
    fn begin_anew(&mut self, track: &Track<'_>, mechanics: &Mechanics, until: f64) -> Option<()> {
        let ended = self.crawl.phase();
        let further = (until - ended).rem_euclid(1.0);
        let duration_s = further * self.observed.cycle_s;
        self.crawl.advance_to(mechanics, ended + further, duration_s).ok()?;
        let mut at_m = Vec::with_capacity(self.observed.cells());
        track.extend(until, &mut at_m);
        self.begun_j += track.work_j(until);
        self.crawl.begin_at_phase(mechanics, until, &at_m);
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::predict::predict;
    use crate::explain::fixture::{Campaign, record, scene};

    /// Largest distance between a crawl that is repeated and one that is simulated to the end, where the whole may be shifted, m.
    fn apart_m(laid_down: bool) -> f64 {
        let campaign = Campaign::default();
        let recordings = record(&campaign, None, 1);
        let mut scene = scene(&recordings, &campaign);
        scene.observed[1].assume_laid_down(laid_down);
        let predicted_m = |repeats: bool| {
            let predicted = predict(&scene.observed[1], &scene.nominal[1], 0.4, repeats);
            predicted.expect("it holds").position_m
        };
        let pairs = predicted_m(true).into_iter().zip(predicted_m(false));
        let differences_m: Vec<f64> = pairs.map(|(repeated, simulated)| repeated - simulated).collect();
        let (least, most) = differences_m
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), m| {
                (least.min(*m), most.max(*m))
            });
        most - least
    }

    #[test]
    fn a_cycle_that_is_repeated_is_as_good_as_one_that_is_simulated() {
        for laid_down in [true, false] {
            let apart_m = apart_m(laid_down);
            // Increments that end elsewhere make another advance, by a thousandth at most.
            assert!(apart_m < 1.2e-5, "laid down {laid_down}: {apart_m} m");
        }
    }
}

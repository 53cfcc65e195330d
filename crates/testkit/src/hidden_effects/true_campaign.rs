//! The truth about a campaign that was drawn: what its hidden effect does, from the noise-free runs with it and without.

use super::detectability::{ComparedRun, Detector};
use super::effect_size::{advances_m, whole_cycles};
use super::parameters::WormParameters;
use super::scene::{Scene, SimulatedRun};
use super::truth::{TrueOnset, TrueRun};

/// The runs of a campaign with what is hidden and without, each in the order of the scenes.
pub struct RunPairs<'a> {
    pub parameters: &'a WormParameters,
    pub scenes: &'a [Scene],
    /// Slopes as stated, degrees.
    pub slopes_deg: &'a [f64],
    pub simulated: &'a [SimulatedRun],
    pub baseline: &'a [SimulatedRun],
    /// Whether what is hidden shows in the time of a cycle only, so that both runs are compared at the same fraction of it.
    pub by_time: bool,
}

impl RunPairs<'_> {
    /// What hides an effect in these runs.
    pub fn detector(&self) -> Detector {
        let runs: Vec<ComparedRun> = self.scenes.iter().zip(self.simulated).map(compared).collect();
        let capture = &self.scenes[0].capture;
        Detector::new(self.parameters, capture, &runs)
    }

    /// What is different in the runs of `simulated`, at the middle of each bin of the campaign's own runs: of each run `[bin][cell]`, m.
    /// A run that makes fewer cycles in its time keeps its last difference.
    pub fn differences_m(&self, simulated: &[SimulatedRun]) -> Vec<Vec<Vec<f64>>> {
        let of_run = |(((scene, own), with), without): (((&Scene, &SimulatedRun), &SimulatedRun), &SimulatedRun)| {
            let first = first_whole(with);
            let [own, here] = [own, with].map(|run| compared((scene, run)));
            let last = here.phases(self.parameters.cells).last().unwrap_or(0.0);
            let bins = own.phases(self.parameters.cells).map(|bin| first + bin.min(last));
            bins.map(|phase| {
                let [one, other] = [with, without].map(|run| {
                    if self.by_time {
                        run.phase_at_time_fraction(phase)
                    } else {
                        phase
                    }
                });
                (0..self.parameters.cells)
                    .map(|cell| with.position_at(cell, one) - without.position_at(cell, other))
                    .collect()
            })
            .collect()
        };
        let own = self.scenes.iter().zip(self.simulated);
        own.zip(simulated).zip(self.baseline).map(of_run).collect()
    }

    /// What is true of each run.
    pub fn runs(&self, differences_m: &[Vec<Vec<f64>>]) -> Vec<TrueRun> {
        (0..self.scenes.len())
            .map(|run| self.run(run, &differences_m[run]))
            .collect()
    }

    /// Number of whole cycles, over all runs, in which what is hidden is there.
    pub fn affected_cycles(&self) -> usize {
        let of_run = |(scene, simulated): (&Scene, &SimulatedRun)| {
            whole_cycles(simulated)
                .filter(|&cycle| is_affected(scene, simulated, cycle))
                .count()
        };
        self.scenes.iter().zip(self.simulated).map(of_run).sum()
    }

    fn run(&self, run: usize, differences_m: &[Vec<f64>]) -> TrueRun {
        let (scene, with, without) = (&self.scenes[run], &self.simulated[run], &self.baseline[run]);
        let counted: Vec<f64> = whole_cycles(with)
            .filter(|&cycle| is_affected(scene, with, cycle))
            .collect();
        let per_cycle = |total: f64| total / counted.len().max(1) as f64;
        let first = first_whole(with);
        let mean_advance_m = |simulated: &SimulatedRun| {
            let advances_m = advances_m(simulated);
            let each = counted
                .iter()
                .filter_map(|cycle| advances_m.get((cycle - first) as usize));
            per_cycle(each.sum())
        };
        let mean_work_j = |simulated: &SimulatedRun| {
            let each = counted
                .iter()
                .map(|cycle| simulated.work_at(cycle + 1.0) - simulated.work_at(*cycle));
            per_cycle(each.sum())
        };
        let (advance_m, baseline_m) = (mean_advance_m(with), mean_advance_m(without));
        let (work_j, baseline_j) = (mean_work_j(with), mean_work_j(without));
        // Near the slope of no progress percentages explode.
        let reference_m = baseline_m.abs().max(0.25 * self.parameters.stroke_m);
        let squares = differences_m.iter().flatten().map(|m| m * m);
        let change = |difference: f64, reference: f64| {
            if counted.is_empty() {
                0.0
            } else {
                (difference / reference).abs()
            }
        };
        TrueRun {
            slope_deg: self.slopes_deg[run],
            cycles: whole_cycles(with).count(),
            advance_change: change(advance_m - baseline_m, reference_m),
            energy_change: change(work_j - baseline_j, baseline_j),
            position_change_m: (squares.clone().sum::<f64>() / squares.count().max(1) as f64).sqrt(),
            onset: scene.begins_at_cycle.is_finite().then(|| {
                let gait_phase = with.phase[0] + scene.begins_at_cycle;
                TrueOnset {
                    gait_phase,
                    cycle: scene.begins_at_cycle,
                    time_s: with.time_at(gait_phase),
                    until_cycle: Some(scene.ends_at_cycle).filter(|cycle| cycle.is_finite()),
                }
            }),
        }
    }
}

/// Whether what is hidden is there in the whole of a cycle that begins at a phase.
fn is_affected(scene: &Scene, simulated: &SimulatedRun, phase: f64) -> bool {
    let cycle = phase - simulated.phase[0];
    cycle >= scene.begins_at_cycle && cycle + 1.0 <= scene.ends_at_cycle
}

fn first_whole(simulated: &SimulatedRun) -> f64 {
    whole_cycles(simulated).next().unwrap_or(0.0)
}

fn compared((scene, simulated): (&Scene, &SimulatedRun)) -> ComparedRun {
    ComparedRun {
        slope_deg: scene.placement.slope_deg,
        cycles: whole_cycles(simulated).count(),
        cycle_s: scene.drive.cycle_s,
    }
}

//! Analyses to report on: the model's exact motion with noise and gaps in what was "measured". The errors and the
//! scatter of the cycles are made up; nothing here shows how well an analysis works.

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_analysis::experiment::{
    Analysis, CycleResult, CycleValues, FirstEstimate, PaperSearch, PhaseSource, Series, Theory, TheoryCycle,
};
use worm_physics::{Contact, Cycle, Motion, Worm, rigid_energy_j, steady_cycle};

pub const STIFFNESS_N_PER_M: f64 = 980.0;
const CYCLE_S: f64 = 2.5;
const NOISE_M: f64 = 1e-4;

/// A worm with unequal cells: the paper's four, repeated.
pub fn worm(cells: usize, slope_deg: f64) -> Worm {
    let bounds_m: Vec<f64> = [2.0e-3, 1.1e-3, 1.75e-3, 2.15e-3]
        .into_iter()
        .cycle()
        .take(cells)
        .collect();
    Worm::uniform(
        cells,
        Contact::symmetric(STIFFNESS_N_PER_M, 1.75e-3),
        0.08325 * cells as f64,
        11.5e-3,
    )
    .and_then(|worm| worm.with_max_deformations_m(&bounds_m))
    .and_then(|worm| worm.with_slope_rad(slope_deg.to_radians()))
    .expect("a worm in range")
}

/// The same with equal cells, as configured.
fn nominal(cells: usize, slope_deg: f64) -> Worm {
    let bounds_m = vec![1.75e-3; cells];
    worm(cells, slope_deg)
        .with_max_deformations_m(&bounds_m)
        .expect("bounds in range")
}

/// An analysis of so many cycles of the unequal worm.
pub fn analysis(cells: usize, slope_deg: f64, cycles: usize, samples_per_cycle: usize) -> Analysis {
    let worm = worm(cells, slope_deg);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let noise = Normal::new(0.0, NOISE_M).expect("a noise");
    let first_positions_m: Vec<f64> = (0..cells).map(|cell| 0.3 - 0.04 * cell as f64).collect();
    let mut motion = Motion::at_rest(&worm, &first_positions_m);
    let mut series = Series::default();
    let lists = [
        &mut series.measured_m,
        &mut series.position_m,
        &mut series.contact_m,
        &mut series.deformation_m,
        &mut series.theory_m,
    ];
    lists.into_iter().for_each(|list| list.resize(cells, Vec::new()));
    series.sliding.resize(cells, Vec::new());
    let mut marks = vec![motion.clone()];
    for sample in 0..=cycles * samples_per_cycle {
        let phase = sample as f64 / samples_per_cycle as f64;
        let before = motion.clone();
        if motion.advance_to(&worm, phase).is_err() {
            motion.translate(&worm, -1e-4);
        }
        if sample > 0 && sample % samples_per_cycle == 0 {
            marks.push(motion.clone());
        }
        series.time_s.push(phase * CYCLE_S);
        series.phase.push(phase);
        series.stepping_cell.push(motion.stepping_cell(&worm));
        for cell in 0..cells {
            let wander_m: f64 = 0.2 * noise.sample(&mut random);
            let position_m = motion.positions_m()[cell];
            let is_seen = (sample + 37 * cell) % 200 > 6;
            let measured_m = position_m + noise.sample(&mut random);
            series.measured_m[cell].push(if is_seen { measured_m } else { f64::NAN });
            series.position_m[cell].push(position_m + wander_m);
            series.contact_m[cell].push(motion.tip_m(cell));
            series.deformation_m[cell].push(motion.deformation_m(cell) + wander_m);
            let slid_m = motion.tip_m(cell) - before.tip_m(cell);
            series.sliding[cell].push(if slid_m.abs() < 1e-9 { 0 } else { slid_m.signum() as i8 });
            series.theory_m[cell].push(position_m);
        }
        let force_n = STIFFNESS_N_PER_M * noise.sample(&mut random) * 0.4;
        series.total_force_n.push(motion.unbalanced_force_n(&worm) + force_n);
        series.extension_m.push(motion.extension_m(&worm));
        series.actuator_force_n.push(motion.actuator_force_n(&worm));
        series.energy_loss_j.push(motion.ledger().loss_j());
        series.energy_actuator_net_j.push(motion.ledger().actuator_net_j);
    }
    let results: Vec<CycleResult> = marks
        .windows(2)
        .enumerate()
        .map(|(index, ends)| CycleResult {
            index,
            start_s: index as f64 * CYCLE_S,
            duration_s: CYCLE_S,
            settled: index > 0 || cycles == 1,
            values: values(
                cells,
                &ends[0],
                &ends[1],
                1.0 + 0.02 * noise.sample(&mut random) / NOISE_M,
            ),
        })
        .collect();
    let settled: Vec<&CycleValues> = results
        .iter()
        .filter(|cycle| cycle.settled)
        .map(|cycle| &cycle.values)
        .collect();
    let (mean, std) = statistics(&settled);
    let bounds_m: Vec<f64> = worm.contacts().iter().map(|contact| contact.forward_bound_m).collect();
    let theory = |worm: &Worm| {
        let cycle = steady_cycle(worm).cycle().cloned()?;
        Some(theory_cycle(worm, &cycle))
    };
    let mass_kg = 0.08325 * cells as f64;
    Analysis {
        recording: format!("up{slope_deg}.csv"),
        slope_deg,
        cells,
        samples: series.time_s.len(),
        duration_s: cycles as f64 * CYCLE_S,
        cycle_s: CYCLE_S,
        step_order: (1..=cells).collect(),
        phase_source: PhaseSource::Positions,
        stroke_m: 11.5e-3,
        noise_m: NOISE_M,
        first_estimate: FirstEstimate {
            max_deformation_m: bounds_m.iter().map(|bound_m| bound_m * 0.95).collect(),
        },
        paper_search: (cells <= 4).then(|| PaperSearch {
            max_deformation_m: bounds_m.clone(),
            candidates: 2401,
            mean_force_n: 0.002,
            force_std_n: 0.05,
        }),
        max_deformation_sigma_m: bounds_m.iter().map(|bound_m| bound_m * 0.012).collect(),
        max_deformation_m: bounds_m,
        laid_down: false,
        damping_ratio: 1.2,
        misfit_ratio: 1.03,
        mean_deformation_m: -mass_kg * 9.81 * slope_deg.to_radians().sin() / STIFFNESS_N_PER_M,
        mass_estimate_kg: (slope_deg != 0.0).then(|| mass_kg - 0.004 / (9.81 * slope_deg.to_radians().sin())),
        mass_sigma_kg: (slope_deg != 0.0).then_some(0.004),
        momentum_violation_n: 0.004,
        cycles: results,
        rigid_energy_j: rigid_energy_j(&worm, mean.advance_m),
        mean,
        std,
        theory: Theory {
            identified: theory(&worm),
            nominal: theory(&nominal(cells, slope_deg)),
        },
        warnings: vec!["x2_m: 84 gaps of up to 0.06 s were bridged".to_owned()],
        repairs: Vec::new(),
        torque_profile: None,
        series,
    }
}

fn values(cells: usize, from: &Motion, to: &Motion, scatter: f64) -> CycleValues {
    let account = to.ledger().since(from.ledger());
    CycleValues {
        advance_m: (to.mean_position_m() - from.mean_position_m()) * scatter,
        forward_slide_m: account.forward_slide_m[..cells]
            .iter()
            .map(|slide_m| slide_m * scatter)
            .collect(),
        backward_slide_m: account.backward_slide_m[..cells]
            .iter()
            .map(|slide_m| slide_m * scatter)
            .collect(),
        energy_loss_j: account.loss_j() * scatter,
        energy_actuator_net_j: account.actuator_net_j * (0.5 + 0.5 * scatter),
        energy_actuator_positive_j: account.actuator_positive_j * (0.5 + 0.5 * scatter),
    }
}

fn theory_cycle(worm: &Worm, cycle: &Cycle) -> TheoryCycle {
    let cells = worm.cells();
    TheoryCycle {
        values: CycleValues {
            advance_m: cycle.advance_m,
            forward_slide_m: cycle.forward_slide_m[..cells].to_vec(),
            backward_slide_m: cycle.backward_slide_m[..cells].to_vec(),
            energy_loss_j: cycle.energy_loss_j,
            energy_actuator_net_j: cycle.energy_actuator_net_j,
            energy_actuator_positive_j: cycle.energy_actuator_positive_j,
        },
        max_deformation_m: worm.contacts().iter().map(|contact| contact.forward_bound_m).collect(),
        rigid_energy_j: rigid_energy_j(worm, cycle.advance_m),
    }
}

/// Mean and standard deviation of each figure.
fn statistics(cycles: &[&CycleValues]) -> (CycleValues, CycleValues) {
    let of = |pick: &dyn Fn(&CycleValues) -> f64| {
        let count = cycles.len() as f64;
        let mean = cycles.iter().map(|values| pick(values)).sum::<f64>() / count;
        let squares = cycles.iter().map(|values| (pick(values) - mean).powi(2)).sum::<f64>();
        (mean, (squares / (count - 1.0)).sqrt())
    };
    let cells = cycles.first().map_or(0, |values| values.forward_slide_m.len());
    let advance = of(&|values| values.advance_m);
    let loss = of(&|values| values.energy_loss_j);
    let net = of(&|values| values.energy_actuator_net_j);
    let positive = of(&|values| values.energy_actuator_positive_j);
    let forward: Vec<_> = (0..cells)
        .map(|cell| of(&|values| values.forward_slide_m[cell]))
        .collect();
    let backward: Vec<_> = (0..cells)
        .map(|cell| of(&|values| values.backward_slide_m[cell]))
        .collect();
    let collect = |side: fn(&(f64, f64)) -> f64| CycleValues {
        advance_m: side(&advance),
        forward_slide_m: forward.iter().map(side).collect(),
        backward_slide_m: backward.iter().map(side).collect(),
        energy_loss_j: side(&loss),
        energy_actuator_net_j: side(&net),
        energy_actuator_positive_j: side(&positive),
    };
    (collect(|pair| pair.0), collect(|pair| pair.1))
}

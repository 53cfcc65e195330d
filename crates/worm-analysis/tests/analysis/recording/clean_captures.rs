//! What is not damaged is not repaired: clean recordings of all kinds of worms pass to the last bit.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::borrow::Cow;
use std::collections::BTreeMap;
use testkit::hidden_effects::campaign::draw_sized;
use testkit::hidden_effects::effect::{Effect, SeverityRange};
use testkit::hidden_effects::hidden::Hidden;
use testkit::hidden_effects::setting::CampaignSize;
use testkit::random::log_uniform;
use worm_analysis::experiment::{Simulation, simulate};
use worm_analysis::identify::{GaitError, Prior, gait, steady};
use worm_analysis::recording::{OpenOptions, Recording};
use worm_estimator::config::{self, Config};
use worm_physics::effect::{LIBRARY, Parameter, Scope};

/// Seeds of the drawn recordings; several hundred in all.
const SIMULATED: u64 = 300;
const CAMPAIGNS: u64 = 60;

/// What a check of one recording found.
enum Outcome {
    Untouched,
    /// No gait was found, so knocks were not looked for; why.
    NoGait(String),
    Touched(String),
}

fn outcome(recording: &Recording, config: &Config) -> Outcome {
    let checked = match recording.clone().checked(&OpenOptions::default()) {
        Ok(checked) => checked,
        Err(error) => return Outcome::Touched(error.to_string()),
    };
    let bits = |recording: &Recording| -> Vec<Vec<u64>> {
        let of_each = |series: &Vec<f64>| series.iter().map(|at_m| at_m.to_bits()).collect();
        recording.position_m.iter().map(of_each).collect()
    };
    let step_order = config.worm.step_order_from_zero();
    let steadied = steady(&checked, |measured_m, filled_m| {
        let prior = Prior {
            step_order: &step_order,
            phase: checked.gait_phase.as_deref(),
        };
        gait::find(&checked.time_s, measured_m, filled_m, prior)
    });
    match steadied {
        Ok(steadied) if !steadied.repairs.is_empty() => {
            Outcome::Touched(steadied.repairs.iter().map(|repair| format!("{repair}; ")).collect())
        }
        Err(error @ GaitError::Knocks { .. }) => Outcome::Touched(error.to_string()),
        _ if !checked.repairs.is_empty() => Outcome::Touched(format!("{:?}", checked.repairs)),
        _ if bits(&checked) != bits(recording) || checked.time_s != recording.time_s => {
            Outcome::Touched("changed without a note".to_owned())
        }
        Ok(steadied) if !matches!(steadied.recording, Cow::Borrowed(_)) => Outcome::Touched("copied".to_owned()),
        Ok(_) => Outcome::Untouched,
        Err(error) => Outcome::NoGait(error.to_string()),
    }
}

/// A value of a parameter: from half way to where the effect does nothing, up to what is allowed within reason.
fn value(parameter: &Parameter, rng: &mut Xoshiro256PlusPlus) -> f64 {
    let end = if rng.random::<bool>() {
        parameter.min
    } else {
        parameter.max
    };
    let far = end.clamp(
        parameter.neutral - 40.0 * parameter.notable,
        parameter.neutral + 40.0 * parameter.notable,
    );
    parameter.neutral + (far - parameter.neutral) * rng.random_range(0.0..0.9)
}

/// A worm of the model's own kind, with up to two effects of the library, as any laboratory might record it.
pub fn drawn(seed: u64) -> (String, Recording, Config) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    loop {
        let mut config = Config::default();
        let cells = rng.random_range(3..=8);
        config.worm.cells = cells;
        config.worm.step_order = (1..=cells).collect();
        for _ in 0..rng.random_range(0..3) {
            let effect = LIBRARY[rng.random_range(0..LIBRARY.len())];
            let mut parameters: BTreeMap<String, f64> = effect
                .parameters
                .iter()
                .map(|parameter| (parameter.name.to_owned(), value(parameter, &mut rng)))
                .collect();
            if let Some(from_m) = parameters.get_mut("from_m") {
                *from_m = rng.random_range(-0.05..0.3);
                parameters.insert("length_m".to_owned(), rng.random_range(0.01..0.15));
            }
            let one_cell = effect.scope == Scope::OneCell || effect.scope == Scope::AnyCells && rng.random::<bool>();
            config.effect.push(config::Effect {
                name: effect.name.to_owned(),
                cell: one_cell.then(|| rng.random_range(1..=cells)),
                table: config::TableFields::default(),
                parameters,
            });
        }
        let simulation = Simulation {
            slope_deg: rng.random_range(0.0..40.0),
            cycles: rng.random_range(3.0..16.0),
            rate_hz: [60.0, 100.0, 120.0, 240.0][rng.random_range(0..4)],
            noise_m: log_uniform(0.02e-3, 0.3e-3, &mut rng),
            seed,
            dropout_share: [0.0, 0.02, 0.08][rng.random_range(0..3)],
            max_deformation_m: None,
            cycle_s: Some(log_uniform(0.8, 10.0, &mut rng)),
            rest_s: [0.0, 2.0][rng.random_range(0..2)],
            positions_only: rng.random(),
        };
        if let Ok(recording) = simulate(&config, &simulation) {
            return (format!("seed {seed}: {:?}", recording.source), recording, config);
        }
    }
}

fn assert_untouched(recordings: impl Iterator<Item = (String, Recording, Config)>) {
    let (mut all, mut no_gait, mut touched) = (0, Vec::new(), Vec::new());
    for (name, recording, config) in recordings {
        all += 1;
        match outcome(&recording, &config) {
            Outcome::Untouched => {}
            Outcome::NoGait(why) => no_gait.push(format!("{name}: {why}")),
            Outcome::Touched(how) => touched.push(format!("{name}: {how}")),
        }
    }
    println!(
        "{} of {all} repaired, no gait in {}:\n{}",
        touched.len(),
        no_gait.len(),
        no_gait.join("\n")
    );
    assert!(
        touched.is_empty(),
        "{} of {all} repaired:\n{}",
        touched.len(),
        touched.join("\n")
    );
}

#[test]
fn simulated_recordings_of_every_size_and_effect_pass_untouched() {
    assert_untouched((1..=SIMULATED).map(drawn));
}

#[test]
fn worms_of_the_independent_simulator_pass_untouched() {
    let campaigns = (0..CAMPAIGNS).flat_map(|number| {
        let seed = 5000 + number;
        let hidden = match number % 4 {
            0 => Hidden::Outside(number / 4),
            1 => Hidden::Pair,
            _ => Hidden::Single(Effect::ALL[number as usize % Effect::ALL.len()], SeverityRange::WHOLE),
        };
        let campaign = draw_sized(
            hidden,
            seed,
            CampaignSize {
                cycles: 8.0,
                ..CampaignSize::FULL
            },
        );
        let config = campaign.config.clone();
        campaign
            .recordings
            .into_iter()
            .map(move |recording| {
                (
                    format!("{}, seed {seed}", campaign.truth.case),
                    recording,
                    config.clone(),
                )
            })
            .collect::<Vec<_>>()
    });
    assert_untouched(campaigns);
}

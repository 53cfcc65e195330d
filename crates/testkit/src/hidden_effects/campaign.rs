//! Campaigns with a hidden effect: three runs of one worm on three slopes, and the truth about it.

use super::body::Worm;
use super::crawling::{crawl, crawl_steepest};
use super::deviations::Deviations;
use super::discrepancy;
use super::effect::Effect;
use super::effect_size::EffectSize;
use super::hidden::{Hidden, hide};
use super::parameters::WormParameters;
use super::scene::{CrawlFailed, Scene, SimulatedRun};
use super::setting::{CampaignSize, Setting, usual_setting};
use super::true_campaign::RunPairs;
use super::truth::{CampaignKind, TrueEffect, Truth};
use super::variety;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_analysis::experiment::RecordedRun;
use worm_analysis::recording::Recording;
use worm_estimator::config::Config;

/// Draws after which the ranges must be wrong.
const MAX_DRAWS: u64 = 200;

/// Three runs of one worm, and what is hidden in it.
#[derive(Debug, Clone)]
pub struct HiddenCampaign {
    /// What is hidden, and how much it does.
    pub truth: Truth,
    /// The nominal worm.
    pub config: Config,
    pub recordings: Vec<Recording>,
    /// Slope of each run as stated, degrees.
    pub slopes_deg: Vec<f64>,
    /// Time of a gait cycle as ordered on every run, s.
    pub cycle_s: f64,
    /// What it does to the positions.
    pub effect_size: EffectSize,
    /// The worm itself.
    pub worm: Worm,
    /// How each run was made.
    pub scenes: Vec<Scene>,
}

impl HiddenCampaign {
    /// Its runs, as stated, with what was recorded on them: `recordings` has its own, as they are or repaired.
    pub fn runs<'r>(&self, recordings: &'r [Recording]) -> Vec<RecordedRun<'r>> {
        let runs = recordings.iter().zip(&self.slopes_deg);
        runs.map(|(recording, &slope_deg)| RecordedRun {
            recording,
            slope_deg,
            payload_kg: 0.0,
            cycle_s: Some(self.cycle_s),
        })
        .collect()
    }
}

/// A campaign with something hidden in it; the same for the same seed.
///
/// # Panics
/// When no worm crawls: the ranges are wrong.
pub fn draw(hidden: Hidden, seed: u64) -> HiddenCampaign {
    draw_sized(hidden, seed, CampaignSize::FULL)
}

/// The same of another size: the same random draws, so the same worm where it crawls at either size.
///
/// # Panics
/// When no worm crawls: the ranges are wrong.
pub fn draw_sized(hidden: Hidden, seed: u64, size: CampaignSize) -> HiddenCampaign {
    draw_by(seed, |rng| complete(hidden, usual_setting(size, rng), seed, rng))
}

/// The same with the phase of the drive recorded, and so the motor's current.
///
/// # Panics
/// When no worm crawls: the ranges are wrong.
pub fn draw_with_phase(hidden: Hidden, seed: u64) -> HiddenCampaign {
    draw_with_phase_sized(hidden, seed, CampaignSize::FULL)
}

/// The same of another size.
///
/// # Panics
/// When no worm crawls: the ranges are wrong.
pub fn draw_with_phase_sized(hidden: Hidden, seed: u64, size: CampaignSize) -> HiddenCampaign {
    draw_by(seed, |rng| {
        let mut setting = usual_setting(size, rng);
        setting.scenes.iter_mut().for_each(|scene| scene.with_phase = true);
        complete(hidden, setting, seed, rng)
    })
}

/// A campaign of any size, of a worm from wider ranges and with laws of other forms than the library's.
///
/// # Panics
/// When no worm crawls: the ranges are wrong.
pub fn draw_varied(hidden: Hidden, seed: u64) -> HiddenCampaign {
    draw_by(seed, |rng| complete(hidden, variety::setting(hidden, rng), seed, rng))
}

/// The same with at most two runs, of as few cycles as the search can use, before a slow camera.
///
/// # Panics
/// When no worm crawls: the ranges are wrong.
pub fn draw_varied_short(hidden: Hidden, seed: u64) -> HiddenCampaign {
    draw_by(seed, |rng| {
        complete(hidden, variety::setting(hidden, rng).shortened(), seed, rng)
    })
}

fn draw_by(seed: u64, attempt: impl Fn(&mut Xoshiro256PlusPlus) -> Option<HiddenCampaign>) -> HiddenCampaign {
    (0..MAX_DRAWS)
        .map(|number| seed.wrapping_mul(MAX_DRAWS).wrapping_add(number))
        .find_map(|seed| attempt(&mut Xoshiro256PlusPlus::seed_from_u64(seed)))
        .unwrap_or_else(|| panic!("no worm crawls with seed {seed}"))
}

/// What the paper measured, Table 4: slope in degrees and mean advance of a cycle in m, and nothing else. Three scalars
/// cannot decide between effects, so the right answer is to name none.
pub fn table4() -> [(f64, f64); 3] {
    [(0.0, 7.18e-3), (30.0, 3.76e-3), (45.0, 2.08e-3)]
}

/// Hides something in a worm and makes its runs; none where it does not crawl.
fn complete(hidden: Hidden, setting: Setting, seed: u64, rng: &mut Xoshiro256PlusPlus) -> Option<HiddenCampaign> {
    let Setting {
        parameters,
        mut scenes,
        slopes_deg: choices,
        cycle_s,
        laws,
        artefact,
        discrepancy_m,
    } = setting;
    let clean = Deviations {
        laws,
        ..Deviations::default()
    };
    scenes.iter_mut().for_each(|scene| scene.servo = seed);
    let mut unmodelled = None;
    let (effects, deviations) = hide(hidden, &clean, parameters.cells, &mut unmodelled, rng);
    let needs_phase =
        |(effect, _): &(TrueEffect, Deviations)| Effect::named(&effect.name).is_some_and(Effect::needs_phase);
    if effects.iter().any(needs_phase) {
        scenes.iter_mut().for_each(|scene| scene.with_phase = true);
    }
    let artefact = artefact.filter(|artefact| artefact.shows(scenes[0].with_phase));
    let mut worm = Worm {
        parameters,
        deviations: Deviations {
            discrepancy_m,
            ..deviations
        },
        unmodelled,
    };
    let baseline_worm = Worm {
        deviations: clean,
        unmodelled: None,
        ..worm.clone()
    };
    let is_hidden = hidden.kind() != CampaignKind::Clean || discrepancy_m > 0.0;
    let (slopes_deg, mut simulated, baseline) =
        crawl_steepest(&worm, &baseline_worm, is_hidden, &mut scenes, &choices)?;
    let mut discrepancy_left_m = 0.0;
    if discrepancy_m > 0.0 {
        let scaled = discrepancy::scale(&mut worm, discrepancy_m, &scenes, &simulated, &baseline).ok()?;
        simulated = scaled.simulated;
        discrepancy_left_m = scaled.remaining_m;
    }

    let pairs = RunPairs {
        parameters: &worm.parameters,
        scenes: &scenes,
        slopes_deg: &slopes_deg,
        simulated: &simulated,
        baseline: &baseline,
        by_time: effects
            .iter()
            .any(|(effect, _)| effect.name == Effect::MotorDroop.name()),
    };
    let differences_m = pairs.differences_m(&simulated);
    let detector = is_hidden.then(|| pairs.detector());
    let sigma = detector.as_ref().map_or(0.0, |detector| detector.sigma(&differences_m));
    let mut true_effects = Vec::new();
    let several = effects.len() > 1;
    for (mut effect, alone) in effects {
        effect.sigma = sigma;
        if let Some(detector) = detector.as_ref().filter(|_| several) {
            let worm = Worm {
                deviations: alone,
                ..baseline_worm.clone()
            };
            let crawled: Result<Vec<SimulatedRun>, CrawlFailed> =
                scenes.iter().map(|scene| crawl(&worm, scene)).collect();
            effect.sigma = detector.sigma(&pairs.differences_m(&crawled.ok()?));
        }
        true_effects.push(effect);
    }
    let what: Vec<&str> = match &worm.unmodelled {
        Some(unmodelled) => vec![unmodelled.name()],
        None => true_effects.iter().map(|effect| effect.name.as_str()).collect(),
    };
    let what = match what.as_slice() {
        [] if discrepancy_m > 0.0 => "discrepant".to_owned(),
        [] => "clean".to_owned(),
        what => what.join("+"),
    };
    let truth = Truth {
        bed: "own".to_owned(),
        split: String::new(),
        case: format!("{what}-{seed}"),
        kind: hidden.kind(),
        seed,
        cells: worm.parameters.cells,
        cycle_s,
        rate_hz: scenes[0].capture.camera.rate_hz,
        noise_m: scenes[0].capture.camera.noise_m,
        with_phase: scenes[0].with_phase,
        stranger: worm.unmodelled.as_ref().map(|unmodelled| unmodelled.name().to_owned()),
        effects: true_effects,
        sigma,
        sigma_per_cycle: sigma / (pairs.affected_cycles().max(1) as f64).sqrt(),
        discrepancy_m: discrepancy_left_m,
        artefacts: artefact.iter().map(|artefact| artefact.name().to_owned()).collect(),
        runs: pairs.runs(&differences_m),
    };
    let effect_size = EffectSize::between(&simulated, &baseline);
    let mut recordings: Vec<Recording> = simulated.into_iter().map(|simulated| simulated.recording).collect();
    if let Some(artefact) = artefact {
        artefact.spoil(&mut recordings, rng);
    }
    let mut config = Config::default();
    config.worm.cells = worm.parameters.cells;
    config.worm.mass_kg *= worm.parameters.cells as f64 / WormParameters::nominal().cells as f64;
    config.worm.step_order = worm.parameters.step_order.iter().map(|cell| cell + 1).collect();
    config.gait.cycle_s = cycle_s;
    Some(HiddenCampaign {
        truth,
        config,
        effect_size,
        recordings,
        slopes_deg,
        cycle_s,
        worm,
        scenes,
    })
}

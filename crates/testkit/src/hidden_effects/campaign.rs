//! Campaigns with something hidden in them: three runs of one worm on three slopes, and what is true of it.

use super::body::{Placement, Worm};
use super::deviations::Deviations;
use super::effect::{Effect, SeverityRange, TrueEffect, shorten_every_stroke, soften};
use super::effect_size::{EffectSize, advances_m};
use super::parameters::WormParameters;
use super::scene::{CrawlFailed, MotionCapture, STEP_S, Scene, SimulatedRun};
use super::unmodelled::UnmodelledEffect;
use crate::random::truncated_normal;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_analysis::recording::Recording;
use worm_estimator::config::Config;

/// Least advance of a worm that counts as crawling, m: mean over the cycles of a run.
const MIN_ADVANCE_M: f64 = 0.5e-3;
/// And of its poorest cycle after the first, m.
const MIN_IN_A_CYCLE_M: f64 = 0.2e-3;
/// Worms thrown before the ranges are to blame.
const MAX_DRAWS: u64 = 200;
/// Standard deviation of a slope about what is stated, degrees.
pub const SLOPE_SIGMA_DEG: f64 = 0.1;

/// How much is recorded of a worm: what a search takes goes with the number of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CampaignSize {
    /// Runs, each on a steeper slope than the one before, the first on the level.
    pub runs: usize,
    /// Gait cycles in each run.
    pub cycles: f64,
    /// Pictures that the camera takes in a second.
    pub rate_hz: f64,
}

impl CampaignSize {
    /// What the score is told of.
    pub const FULL: Self = Self {
        runs: 3,
        cycles: 12.0,
        rate_hz: 120.0,
    };
    /// The least that the search can work on: several slopes, and cycles enough to tell scatter from cause.
    pub const SMALL: Self = Self {
        runs: 2,
        cycles: 6.0,
        rate_hz: 60.0,
    };
}

/// What a campaign is to test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CampaignKind {
    /// Nothing is hidden.
    Clean,
    /// One effect of the library.
    Single,
    /// Something that the library does not know.
    Outside,
    /// Two effects of different classes.
    Pair,
    /// One of two that no position data can separate.
    Twin,
}

/// One of the exact twins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Twin {
    DirectionalFriction,
    ConstantDrag,
    Payload,
    SofterPads,
    SensorScale,
    LostStroke,
}

impl Twin {
    pub const ALL: [Self; 6] = [
        Self::DirectionalFriction,
        Self::Payload,
        Self::SensorScale,
        Self::ConstantDrag,
        Self::SofterPads,
        Self::LostStroke,
    ];
}

/// What is to be hidden.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hidden {
    Clean,
    Single(Effect, SeverityRange),
    /// The kind of [`UnmodelledEffect`], counted from 0.
    Outside(u64),
    Pair,
    Twin(Twin),
}

impl Hidden {
    pub fn kind(self) -> CampaignKind {
        match self {
            Self::Clean => CampaignKind::Clean,
            Self::Single(..) => CampaignKind::Single,
            Self::Outside(_) => CampaignKind::Outside,
            Self::Pair => CampaignKind::Pair,
            Self::Twin(_) => CampaignKind::Twin,
        }
    }
}

/// Three runs of one worm, and what is hidden in it.
#[derive(Debug, Clone)]
pub struct HiddenCampaign {
    /// What is hidden and the seed.
    pub name: String,
    pub kind: CampaignKind,
    pub seed: u64,
    /// What is believed of the worm.
    pub config: Config,
    pub recordings: Vec<Recording>,
    /// Slope of each run as stated, degrees.
    pub slopes_deg: Vec<f64>,
    /// Time of a gait cycle as ordered on every run, s.
    pub cycle_s: f64,
    /// What is hidden; nothing in a clean campaign.
    pub truth: Vec<TrueEffect>,
    /// What it does to the positions.
    pub effect_size: EffectSize,
    /// The worm itself.
    pub worm: Worm,
    /// How each run was made.
    pub scenes: Vec<Scene>,
}

/// A campaign with something hidden in it; the same for the same seed.
///
/// # Panics
/// When no worm crawls, which is the ranges' fault.
pub fn draw(hidden: Hidden, seed: u64) -> HiddenCampaign {
    draw_sized(hidden, seed, CampaignSize::FULL)
}

/// The same of another size: the same dice, so the same worm where it crawls at either size.
///
/// # Panics
/// When no worm crawls, which is the ranges' fault.
pub fn draw_sized(hidden: Hidden, seed: u64, size: CampaignSize) -> HiddenCampaign {
    (0..MAX_DRAWS)
        .find_map(|attempt| try_draw(hidden, seed, attempt, size))
        .unwrap_or_else(|| panic!("no worm crawls with {hidden:?} in it, seed {seed}"))
}

/// What the paper measured, Table 4: slope in degrees and mean advance of a cycle in m, and nothing else. Three scalars
/// cannot decide between effects, so the right answer is to name none.
pub fn table4() -> [(f64, f64); 3] {
    [(0.0, 7.18e-3), (30.0, 3.76e-3), (45.0, 2.08e-3)]
}

fn try_draw(hidden: Hidden, seed: u64, attempt: u64, size: CampaignSize) -> Option<HiddenCampaign> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(MAX_DRAWS).wrapping_add(attempt));
    let config = Config::default();
    let cycle_s = config.gait.cycle_s;
    let parameters = WormParameters::draw(&mut rng);
    let mut capture = MotionCapture::draw(&mut rng);
    capture.camera.rate_hz = size.rate_hz;
    let under_way = rng.random_range(0..3) == 0;
    let phase_is_recorded = rng.random::<bool>();
    let steepest_deg = if rng.random::<bool>() { 45.0 } else { 40.0 };
    let warm_up_cycles = if under_way { rng.random_range(1.2..2.2) } else { 0.0 };
    let mut scenes: Vec<Scene> = (0..3)
        .map(|run| Scene {
            placement: Placement {
                slope_deg: SLOPE_SIGMA_DEG * truncated_normal(&mut rng),
                payload_kg: 0.0,
                start_m: 0.0,
            },
            drive: parameters.motor.drive(cycle_s, &mut rng),
            capture: capture.clone(),
            warm_up_cycles,
            cycles: size.cycles,
            dwell_s: 0.0,
            jump_at_cycle: [f64::INFINITY, 0.5 * size.cycles, f64::NEG_INFINITY][run],
            with_phase: phase_is_recorded,
            seed: rng.random(),
            step_s: STEP_S,
        })
        .collect();

    // All are thrown, so that the same dice are left for what is hidden.
    scenes.truncate(size.runs);

    let mut deviations = Deviations::default();
    let mut unmodelled = None;
    let truth = hide(hidden, &mut deviations, &mut unmodelled, &mut rng);
    let needs_phase = |effect: &TrueEffect| Effect::named(effect.name).is_some_and(Effect::needs_phase);
    if truth.iter().any(needs_phase) {
        scenes.iter_mut().for_each(|scene| scene.with_phase = true);
    }
    let worm = Worm {
        parameters,
        deviations,
        unmodelled,
    };
    let (slopes_deg, simulated, baseline) = crawl_steepest(&worm, !truth.is_empty(), &mut scenes, steepest_deg)?;

    let what: Vec<&str> = truth.iter().map(|effect| effect.name).collect();
    let what = if what.is_empty() {
        "clean".to_owned()
    } else {
        what.join("+")
    };
    let mut config = config;
    config.worm.step_order = worm.parameters.step_order.iter().map(|cell| cell + 1).collect();
    Some(HiddenCampaign {
        name: format!("{what}-{seed}"),
        kind: hidden.kind(),
        seed,
        config,
        effect_size: EffectSize::between(&simulated, &baseline),
        recordings: simulated.into_iter().map(|simulated| simulated.recording).collect(),
        slopes_deg,
        cycle_s,
        truth,
        worm,
        scenes,
    })
}

/// Throws what is wanted into the worm.
fn hide(
    hidden: Hidden,
    deviations: &mut Deviations,
    unmodelled: &mut Option<UnmodelledEffect>,
    rng: &mut Xoshiro256PlusPlus,
) -> Vec<TrueEffect> {
    let strong = SeverityRange::UPPER_HALF;
    match hidden {
        Hidden::Clean => Vec::new(),
        Hidden::Single(effect, range) => vec![effect.hide(range, deviations, rng)],
        Hidden::Outside(kind) => {
            let drawn = unmodelled.insert(UnmodelledEffect::draw(kind, rng));
            vec![TrueEffect {
                name: drawn.name(),
                cell: None,
                parameters: drawn.parameters(),
            }]
        }
        Hidden::Pair => {
            let mut any = || Effect::ALL[rng.random_range(0..Effect::ALL.len())];
            let first = any();
            let second = loop {
                let second = any();
                if second.class() != first.class() {
                    break second;
                }
            };
            vec![
                first.hide(strong, deviations, rng),
                second.hide(strong, deviations, rng),
            ]
        }
        Hidden::Twin(twin) => vec![match twin {
            Twin::DirectionalFriction => Effect::DirectionalFriction.hide(strong, deviations, rng),
            Twin::ConstantDrag => Effect::ConstantDrag.hide(strong, deviations, rng),
            Twin::Payload => Effect::Payload.hide(strong, deviations, rng),
            Twin::SensorScale => Effect::SensorScale.hide(strong, deviations, rng),
            Twin::SofterPads => soften(deviations, rng),
            Twin::LostStroke => TrueEffect {
                name: Effect::LostStroke.name(),
                cell: None,
                parameters: vec![("lost_share", shorten_every_stroke(strong, deviations, rng))],
            },
        }],
    }
}

type SteepestRuns = (Vec<f64>, Vec<SimulatedRun>, Vec<SimulatedRun>);

/// Plays every run on the steepest of its slopes on which the worm crawls with what is hidden in it and without.
fn crawl_steepest(worm: &Worm, has_effect: bool, scenes: &mut [Scene], steepest_deg: f64) -> Option<SteepestRuns> {
    let steep = [45.0, 40.0, 35.0, 25.0, 18.0];
    let choices: [&[f64]; 3] = [&[0.0], &[30.0, 20.0, 12.0], &steep];
    let mut all = SteepestRuns::default();
    for (scene, choices) in scenes.iter_mut().zip(choices) {
        let error_deg = scene.placement.slope_deg;
        let gentlest_deg = all.0.last().map_or(0.0, |&before_deg| before_deg + 5.0);
        let mut able = choices
            .iter()
            .copied()
            .filter(|&deg| deg <= steepest_deg && (deg == 0.0 || deg >= gentlest_deg));
        let (slope_deg, simulated, baseline) = able.find_map(|slope_deg| {
            scene.placement.slope_deg = slope_deg + error_deg;
            let simulated = crawl(worm, scene).ok()?;
            let baseline = if has_effect {
                crawl(&worm.baseline(), scene).ok()?
            } else {
                simulated.clone()
            };
            Some((slope_deg, simulated, baseline))
        })?;
        all.0.push(slope_deg);
        all.1.push(simulated);
        all.2.push(baseline);
    }
    Some(all)
}

/// Plays a run.
///
/// # Errors
/// [`CrawlFailed`] when the worm slides down or hardly gets on.
pub fn crawl(worm: &Worm, scene: &Scene) -> Result<SimulatedRun, CrawlFailed> {
    let simulated = scene.simulate(worm)?;
    let advances_m = advances_m(&simulated);
    let mean_m = advances_m.iter().sum::<f64>() / advances_m.len() as f64;
    let min_m = advances_m.iter().skip(1).copied().fold(f64::INFINITY, f64::min);
    if mean_m >= MIN_ADVANCE_M && min_m >= MIN_IN_A_CYCLE_M {
        Ok(simulated)
    } else {
        Err(CrawlFailed)
    }
}

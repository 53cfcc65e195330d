//! Campaigns with something hidden in them: three runs of one worm on three slopes, and what is true of it.

use super::body::{Place, Worm};
use super::effect::{Band, Effect, TrueEffect, lose_all, soften};
use super::flaws::Flaws;
use super::make::{Make, normal};
use super::scene::{Eyes, Lost, Played, STEP_S, Scene};
use super::stranger::Stranger;
use super::visible::{Visible, advances_m};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use worm_analysis::recording::Recording;
use worm_estimator::config::Config;

/// Least advance of a worm that counts as crawling, m: mean over the cycles of a run.
const MIN_ADVANCE_M: f64 = 0.5e-3;
/// And of its poorest cycle after the first, m.
const MIN_IN_A_CYCLE_M: f64 = 0.2e-3;
/// Worms thrown before the ranges are to blame.
const MAX_THROWS: u64 = 200;
/// Standard deviation of a slope about what is stated, degrees.
pub const SLOPE_SIGMA_DEG: f64 = 0.1;

/// How much is recorded of a worm: what a search takes goes with the number of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Runs, each on a steeper slope than the one before, the first on the level.
    pub runs: usize,
    /// Gait cycles in each run.
    pub cycles: f64,
    /// Pictures that the camera takes in a second.
    pub rate_hz: f64,
}

impl Size {
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
pub enum Wanted {
    Clean,
    Single(Effect, Band),
    /// The kind of [`Stranger`], counted from 0.
    Outside(u64),
    Pair,
    Twin(Twin),
}

impl Wanted {
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
    pub visible: Visible,
    /// The worm itself.
    pub worm: Worm,
    /// How each run was made.
    pub scenes: Vec<Scene>,
}

/// A campaign with something hidden in it; the same for the same seed.
///
/// # Panics
/// When no worm crawls, which is the ranges' fault.
pub fn draw(wanted: Wanted, seed: u64) -> HiddenCampaign {
    draw_sized(wanted, seed, Size::FULL)
}

/// The same of another size: the same dice, so the same worm where it crawls at either size.
///
/// # Panics
/// When no worm crawls, which is the ranges' fault.
pub fn draw_sized(wanted: Wanted, seed: u64, size: Size) -> HiddenCampaign {
    (0..MAX_THROWS)
        .find_map(|throw| thrown(wanted, seed, throw, size))
        .unwrap_or_else(|| panic!("no worm crawls with {wanted:?} in it, seed {seed}"))
}

/// What the paper measured, Table 4: slope in degrees and mean advance of a cycle in m, and nothing else. Three scalars
/// cannot decide between effects, so the right answer is to name none.
pub fn table4() -> [(f64, f64); 3] {
    [(0.0, 7.18e-3), (30.0, 3.76e-3), (45.0, 2.08e-3)]
}

fn thrown(wanted: Wanted, seed: u64, throw: u64, size: Size) -> Option<HiddenCampaign> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(MAX_THROWS).wrapping_add(throw));
    let config = Config::default();
    let cycle_s = config.gait.cycle_s;
    let make = Make::draw(&mut rng);
    let mut eyes = Eyes::draw(&mut rng);
    eyes.camera.rate_hz = size.rate_hz;
    let under_way = rng.random_range(0..3) == 0;
    let phase_is_recorded = rng.random::<bool>();
    let steepest_deg = if rng.random::<bool>() { 45.0 } else { 40.0 };
    let warm_up_cycles = if under_way { rng.random_range(1.2..2.2) } else { 0.0 };
    let mut scenes: Vec<Scene> = (0..3)
        .map(|run| Scene {
            place: Place {
                slope_deg: SLOPE_SIGMA_DEG * normal(&mut rng),
                payload_kg: 0.0,
                start_m: 0.0,
            },
            drive: make.motor.drive(cycle_s, &mut rng),
            eyes: eyes.clone(),
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

    let mut flaws = Flaws::default();
    let mut stranger = None;
    let truth = hidden(wanted, &mut flaws, &mut stranger, &mut rng);
    let needs_phase = |effect: &TrueEffect| Effect::named(effect.name).is_some_and(Effect::needs_phase);
    if truth.iter().any(needs_phase) {
        scenes.iter_mut().for_each(|scene| scene.with_phase = true);
    }
    let worm = Worm { make, flaws, stranger };
    let (slopes_deg, played, honest) = crawled(&worm, !truth.is_empty(), &mut scenes, steepest_deg)?;

    let what: Vec<&str> = truth.iter().map(|effect| effect.name).collect();
    let what = if what.is_empty() {
        "clean".to_owned()
    } else {
        what.join("+")
    };
    let mut config = config;
    config.worm.step_order = worm.make.step_order.iter().map(|cell| cell + 1).collect();
    Some(HiddenCampaign {
        name: format!("{what}-{seed}"),
        kind: wanted.kind(),
        seed,
        config,
        visible: Visible::between(&played, &honest),
        recordings: played.into_iter().map(|played| played.recording).collect(),
        slopes_deg,
        cycle_s,
        truth,
        worm,
        scenes,
    })
}

/// Throws what is wanted into the worm.
fn hidden(
    wanted: Wanted,
    flaws: &mut Flaws,
    stranger: &mut Option<Stranger>,
    rng: &mut Xoshiro256PlusPlus,
) -> Vec<TrueEffect> {
    let strong = Band::UPPER_HALF;
    match wanted {
        Wanted::Clean => Vec::new(),
        Wanted::Single(effect, band) => vec![effect.hide(band, flaws, rng)],
        Wanted::Outside(kind) => {
            let drawn = stranger.insert(Stranger::draw(kind, rng));
            vec![TrueEffect {
                name: drawn.name(),
                cell: None,
                parameters: drawn.parameters(),
            }]
        }
        Wanted::Pair => {
            let mut any = || Effect::ALL[rng.random_range(0..Effect::ALL.len())];
            let first = any();
            let second = loop {
                let second = any();
                if second.class() != first.class() {
                    break second;
                }
            };
            vec![first.hide(strong, flaws, rng), second.hide(strong, flaws, rng)]
        }
        Wanted::Twin(twin) => vec![match twin {
            Twin::DirectionalFriction => Effect::DirectionalFriction.hide(strong, flaws, rng),
            Twin::ConstantDrag => Effect::ConstantDrag.hide(strong, flaws, rng),
            Twin::Payload => Effect::Payload.hide(strong, flaws, rng),
            Twin::SensorScale => Effect::SensorScale.hide(strong, flaws, rng),
            Twin::SofterPads => soften(flaws, rng),
            Twin::LostStroke => TrueEffect {
                name: Effect::LostStroke.name(),
                cell: None,
                parameters: vec![("lost_share", lose_all(strong, flaws, rng))],
            },
        }],
    }
}

type Crawled = (Vec<f64>, Vec<Played>, Vec<Played>);

/// Plays every run on the steepest of its slopes on which the worm crawls with what is hidden in it and without.
fn crawled(worm: &Worm, is_flawed: bool, scenes: &mut [Scene], steepest_deg: f64) -> Option<Crawled> {
    let steep = [45.0, 40.0, 35.0, 25.0, 18.0];
    let choices: [&[f64]; 3] = [&[0.0], &[30.0, 20.0, 12.0], &steep];
    let mut all = Crawled::default();
    for (scene, choices) in scenes.iter_mut().zip(choices) {
        let error_deg = scene.place.slope_deg;
        let gentlest_deg = all.0.last().map_or(0.0, |&before_deg| before_deg + 5.0);
        let mut able = choices
            .iter()
            .copied()
            .filter(|&deg| deg <= steepest_deg && (deg == 0.0 || deg >= gentlest_deg));
        let (slope_deg, played, honest) = able.find_map(|slope_deg| {
            scene.place.slope_deg = slope_deg + error_deg;
            let played = crawl(worm, scene).ok()?;
            let honest = if is_flawed {
                crawl(&worm.honest(), scene).ok()?
            } else {
                played.clone()
            };
            Some((slope_deg, played, honest))
        })?;
        all.0.push(slope_deg);
        all.1.push(played);
        all.2.push(honest);
    }
    Some(all)
}

/// Plays a run.
///
/// # Errors
/// [`Lost`] when the worm slides down or hardly gets on.
pub fn crawl(worm: &Worm, scene: &Scene) -> Result<Played, Lost> {
    let played = scene.play(worm)?;
    let advances_m = advances_m(&played);
    let mean_m = advances_m.iter().sum::<f64>() / advances_m.len() as f64;
    let min_m = advances_m.iter().skip(1).copied().fold(f64::INFINITY, f64::min);
    if mean_m >= MIN_ADVANCE_M && min_m >= MIN_IN_A_CYCLE_M {
        Ok(played)
    } else {
        Err(Lost)
    }
}

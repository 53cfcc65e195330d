//! What may be hidden in a worm, and how it is put there.

use super::deviations::Deviations;
use super::effect::{Effect, SeverityRange, shorten_every_stroke, soften};
use super::truth::{CampaignKind, TrueEffect};
use super::unmodelled::UnmodelledEffect;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

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
    /// Two effects of different classes.
    Pair,
    /// Three of different classes.
    Triple,
    Twin(Twin),
    /// An effect that begins in mid-run.
    Onset(Effect, SeverityRange),
    /// An effect that begins in mid-run and ends again.
    Spell(Effect, SeverityRange),
    /// Nothing but a discrepancy in the law of all pads, of which recalibration leaves about so many micrometres.
    Discrepant(u32),
}

impl Hidden {
    pub fn kind(self) -> CampaignKind {
        match self {
            Self::Clean | Self::Discrepant(_) => CampaignKind::Clean,
            Self::Single(..) => CampaignKind::Single,
            Self::Outside(_) => CampaignKind::Stranger,
            Self::Pair => CampaignKind::Pair,
            Self::Triple => CampaignKind::Triple,
            Self::Onset(..) => CampaignKind::Onset,
            Self::Spell(..) => CampaignKind::Spell,
            Self::Twin(_) => CampaignKind::Twin,
        }
    }
}

/// Draws what is hidden: each effect with what it is by itself, and all together.
pub fn hide(
    hidden: Hidden,
    clean: &Deviations,
    cells: usize,
    unmodelled: &mut Option<UnmodelledEffect>,
    rng: &mut Xoshiro256PlusPlus,
) -> (Vec<(TrueEffect, Deviations)>, Deviations) {
    let strong = SeverityRange::UPPER_HALF;
    let mut all = clean.clone();
    let mut put = |rng: &mut Xoshiro256PlusPlus,
                   hide: &dyn Fn(&mut Deviations, &mut Xoshiro256PlusPlus) -> TrueEffect| {
        let mut alone = clean.clone();
        hide(&mut alone, &mut rng.clone());
        (hide(&mut all, rng), alone)
    };
    let one = |effect: Effect, range: SeverityRange| {
        move |deviations: &mut Deviations, rng: &mut Xoshiro256PlusPlus| effect.hide(range, cells, deviations, rng)
    };
    let effects = match hidden {
        Hidden::Clean | Hidden::Discrepant(_) => Vec::new(),
        Hidden::Single(effect, range) | Hidden::Onset(effect, range) | Hidden::Spell(effect, range) => {
            vec![put(rng, &one(effect, range))]
        }
        Hidden::Outside(kind) => {
            *unmodelled = Some(UnmodelledEffect::draw(kind, cells, rng));
            Vec::new()
        }
        Hidden::Pair => {
            let effects = of_different_classes(2, rng);
            effects
                .into_iter()
                .map(|effect| put(rng, &one(effect, strong)))
                .collect()
        }
        Hidden::Triple => {
            let effects = of_different_classes(3, rng);
            effects
                .into_iter()
                .map(|effect| put(rng, &one(effect, strong)))
                .collect()
        }
        Hidden::Twin(twin) => vec![match twin {
            Twin::DirectionalFriction => put(rng, &one(Effect::DirectionalFriction, strong)),
            Twin::ConstantDrag => put(rng, &one(Effect::ConstantDrag, strong)),
            Twin::Payload => put(rng, &one(Effect::Payload, strong)),
            Twin::SensorScale => put(rng, &one(Effect::SensorScale, strong)),
            Twin::SofterPads => put(rng, &|deviations, rng| soften(deviations, rng)),
            Twin::LostStroke => put(rng, &|deviations, rng| {
                let lost = shorten_every_stroke(strong, deviations, rng);
                TrueEffect::new(Effect::LostStroke.name(), None, &[("lost_share", lost)])
            }),
        }],
    };
    (effects, all)
}

/// Effects no two of which look alike.
fn of_different_classes(count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<Effect> {
    let mut effects: Vec<Effect> = Vec::new();
    while effects.len() < count {
        let effect = Effect::ALL[rng.random_range(0..Effect::ALL.len())];
        if effects.iter().all(|other| other.class() != effect.class()) {
            effects.push(effect);
        }
    }
    effects
}

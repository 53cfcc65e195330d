//! The cases: a development split to tune on and a sealed test split, from disjoint ranges of seeds and with strangers of disjoint
//! kinds, and the few that the tests of the search run at a smaller size.

use super::campaign::{HiddenCampaign, draw, draw_varied, draw_varied_short, draw_with_phase};
use super::effect::{Effect, SeverityRange};
use super::hidden::{Hidden, Twin};
use super::unmodelled::{DEVELOPMENT_KINDS, TEST_KINDS};

/// One of the sets of cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// To tune thresholds on.
    Development,
    /// To be run once they are frozen.
    Test,
    /// What `tests/analysis/search.rs` runs at a smaller size.
    Search,
    /// One of each kind, as varied as in the splits but recorded for a short time: what `tests/analysis/own_sample.rs` runs.
    Sample,
    /// One of each effect, the strangers of the development split and clean worms, of the usual size and with a further run on a slope
    /// between: for the laws that are found where the library does not explain the data.
    Laws,
    /// Payloads, softer pads and clean worms, of the usual size and with the drive's phase: what positions cannot tell apart and the
    /// motor's current can.
    Current,
    /// One of each effect, twice over, and the strangers of the development split, of the usual size and with the drive's phase: what the
    /// motor's current shows of each.
    CurrentLibrary,
}

/// The seed of every case of [`Split::Search`]: in no range of the others.
pub const SEARCH_SEED: u64 = 501;
/// The seed of every case of [`Split::Sample`].
const SAMPLE_SEED: u64 = 701;
/// Clean worms of [`Split::Laws`].
const LAWS_CLEAN: usize = 20;
/// Worms of each kind of [`Split::Current`].
const CURRENT_OF_EACH: usize = 20;
/// Its payloads: from 30 g to 150 g.
const FROM_30_G: SeverityRange = SeverityRange { from: 0.527, to: 1.0 };

impl Split {
    /// Below the first seed.
    fn base(self) -> u64 {
        match self {
            Self::Development => 52_600_000,
            Self::Test => 88_400_000,
            Self::Search => SEARCH_SEED,
            Self::Sample => SAMPLE_SEED,
            Self::Laws => 57_300_000,
            Self::Current => 57_400_000,
            Self::CurrentLibrary => 57_500_000,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Development => "development",
            Self::Test => "test",
            Self::Search => "search",
            Self::Sample => "sample",
            Self::Laws => "laws",
            Self::Current => "current",
            Self::CurrentLibrary => "current-library",
        }
    }

    fn counts(self) -> Counts {
        match self {
            Self::Development => Counts {
                severities: 4,
                clean: 40,
                discrepant: 16,
                outside: 36,
                pairs: 16,
                triples: 8,
                twins: 6,
                onsets: 16,
                spells: 16,
            },
            Self::Test | Self::Search | Self::Sample | Self::Laws | Self::Current | Self::CurrentLibrary => Counts {
                severities: 10,
                clean: 132,
                discrepant: 48,
                outside: 126,
                pairs: 110,
                triples: 30,
                twins: 12,
                onsets: 110,
                spells: 32,
            },
        }
    }

    /// The kinds of strangers in it.
    fn stranger_kinds(self) -> [u64; 9] {
        match self {
            Self::Development | Self::Sample | Self::Laws | Self::Current | Self::CurrentLibrary => DEVELOPMENT_KINDS,
            Self::Test | Self::Search => TEST_KINDS,
        }
    }

    /// The split of a name.
    pub fn named(name: &str) -> Option<Self> {
        let all = [
            Self::Development,
            Self::Test,
            Self::Search,
            Self::Sample,
            Self::Laws,
            Self::Current,
            Self::CurrentLibrary,
        ];
        all.into_iter().find(|split| split.name() == name)
    }
}

/// One campaign to be drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    pub split: Split,
    pub hidden: Hidden,
    pub seed: u64,
}

impl Case {
    /// All values of [`what`](Self::what).
    pub fn words() -> impl Iterator<Item = &'static str> {
        let others = [
            "clean",
            "discrepant",
            "outside",
            "pair",
            "triple",
            "twin",
            "onset",
            "spell",
        ];
        Effect::ALL.iter().map(|effect| effect.name()).chain(others)
    }

    /// What is hidden, in a word.
    pub fn what(self) -> &'static str {
        match self.hidden {
            Hidden::Clean => "clean",
            Hidden::Single(effect, _) => effect.name(),
            Hidden::Outside(_) => "outside",
            Hidden::Discrepant(_) => "discrepant",
            Hidden::Onset(..) => "onset",
            Hidden::Spell(..) => "spell",
            Hidden::Triple => "triple",
            Hidden::Pair => "pair",
            Hidden::Twin(_) => "twin",
        }
    }

    /// Makes the campaign; it takes a second or a few.
    pub fn draw(self) -> HiddenCampaign {
        let mut campaign = match self.split {
            Split::Search | Split::Laws => draw(self.hidden, self.seed),
            Split::Current | Split::CurrentLibrary => draw_with_phase(self.hidden, self.seed),
            Split::Sample => draw_varied_short(self.hidden, self.seed),
            Split::Development | Split::Test => draw_varied(self.hidden, self.seed),
        };
        self.split.name().clone_into(&mut campaign.truth.split);
        campaign
    }
}

/// How many cases of each kind a split has.
struct Counts {
    /// Of each effect.
    severities: usize,
    clean: usize,
    discrepant: usize,
    outside: usize,
    pairs: usize,
    triples: usize,
    twins: usize,
    onsets: usize,
    spells: usize,
}

/// Sizes of the discrepancies put in, micrometres.
const DISCREPANCIES: [u32; 4] = [5, 10, 20, 40];
/// What can begin in mid-run.
const WITH_ONSET: [Effect; 7] = [
    Effect::UnequalClamping,
    Effect::UnequalStiffness,
    Effect::ConstantDrag,
    Effect::LostStroke,
    Effect::Payload,
    Effect::DirectionalFriction,
    Effect::ViscousDrag,
];

/// The cases of a split. `scale` multiplies how many there are of each kind; a case has the same seed at any scale. Those of the
/// tests are the same few at any scale.
pub fn split(split: Split, scale: f64) -> Vec<Case> {
    let case = |hidden, seed| Case { split, hidden, seed };
    if split == Split::Sample {
        let hidden = [
            Hidden::Clean,
            Hidden::Discrepant(10),
            Hidden::Single(Effect::UnequalStiffness, SeverityRange::UPPER_HALF),
            Hidden::Outside(11),
            Hidden::Pair,
            Hidden::Onset(Effect::UnequalClamping, SeverityRange::UPPER_HALF),
        ];
        return hidden.map(|hidden| case(hidden, split.base())).to_vec();
    }
    if split == Split::Search {
        let hidden = [
            Hidden::Clean,
            Hidden::Single(Effect::UnequalClamping, SeverityRange::UPPER_HALF),
            Hidden::Twin(Twin::ConstantDrag),
            Hidden::Outside(5),
        ];
        return hidden.map(|hidden| case(hidden, split.base())).to_vec();
    }
    let numbered = |all: &mut dyn Iterator<Item = Hidden>| -> Vec<Case> {
        let all = all.enumerate();
        all.map(|(number, hidden)| case(hidden, split.base() + number as u64))
            .collect()
    };
    let singles = || {
        Effect::ALL
            .iter()
            .map(|&effect| Hidden::Single(effect, SeverityRange::UPPER_HALF))
    };
    let strangers = || split.stranger_kinds().into_iter().map(Hidden::Outside);
    let count = |count: usize| ((count as f64 * scale).round() as usize).max(1);
    if split == Split::Laws {
        // Each round has seeds of its own: the second is of worms on which nothing was tuned.
        let round = |_| {
            let clean = std::iter::repeat_n(Hidden::Clean, LAWS_CLEAN);
            singles().chain(strangers()).chain(clean)
        };
        return numbered(&mut (0..count(1)).flat_map(round));
    }
    if split == Split::CurrentLibrary {
        return numbered(&mut singles().chain(singles()).chain(strangers()));
    }
    if split == Split::Current {
        let kinds = [
            Hidden::Single(Effect::Payload, FROM_30_G),
            Hidden::Twin(Twin::SofterPads),
            Hidden::Clean,
        ];
        return numbered(&mut kinds.into_iter().cycle().take(kinds.len() * count(CURRENT_OF_EACH)));
    }
    let counts = split.counts();
    let seed = |group: usize, number: usize| split.base() + 1000 * group as u64 + number as u64;
    let mut cases = Vec::new();
    for (group, &effect) in Effect::ALL.iter().enumerate() {
        let severities = count(counts.severities);
        for number in 0..severities {
            let hidden = Hidden::Single(effect, SeverityRange::part(number, severities));
            // Severities of different scales get different seeds.
            cases.push(case(hidden, seed(group, 10 * severities + number)));
        }
    }
    let effects = Effect::ALL.len();
    let kinds = split.stranger_kinds();
    let mut several = |group: usize, of: usize, hidden: &dyn Fn(usize) -> Hidden| {
        cases.extend((0..count(of)).map(|number| case(hidden(number), seed(effects + group, number))));
    };
    several(0, counts.clean, &|_| Hidden::Clean);
    several(1, counts.outside, &|number| {
        Hidden::Outside(kinds[number % kinds.len()])
    });
    several(2, counts.pairs, &|_| Hidden::Pair);
    several(3, counts.twins, &|number| {
        Hidden::Twin(Twin::ALL[number % Twin::ALL.len()])
    });
    several(4, counts.triples, &|_| Hidden::Triple);
    several(5, counts.onsets, &|number| {
        Hidden::Onset(WITH_ONSET[number % WITH_ONSET.len()], SeverityRange::UPPER_HALF)
    });
    several(6, counts.discrepant, &|number| {
        Hidden::Discrepant(DISCREPANCIES[number % DISCREPANCIES.len()])
    });
    several(7, counts.spells, &|number| {
        Hidden::Spell(WITH_ONSET[number % WITH_ONSET.len()], SeverityRange::UPPER_HALF)
    });
    cases
}

/// The scale that `WORMD_CASES` gives, 1 where it is not set.
///
/// # Panics
/// When it is no number above 0 and up to 7.
pub fn scale_from_environment() -> f64 {
    let Ok(hidden) = std::env::var("WORMD_CASES") else {
        return 1.0;
    };
    match hidden.parse::<f64>() {
        Ok(scale) if scale > 0.0 && scale <= 7.0 => scale,
        _ => panic!("WORMD_CASES is \"{hidden}\": give a scale above 0 and up to 7, 1 for the usual count"),
    }
}

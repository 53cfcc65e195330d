//! Which cases are run: a development split to tune on and a sealed test split, from disjoint ranges of seeds, and the few that
//! the tests of the search run in small.

use super::campaign::{Hidden, HiddenCampaign, Twin, draw};
use super::effect::{Effect, SeverityRange};

/// One of the sets of cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// To tune thresholds on.
    Development,
    /// To be run once they are frozen.
    Test,
    /// What `tests/explain_search.rs` runs in small.
    Search,
}

/// The seed of every case of [`Split::Search`]: in no range of the others.
pub const SEARCH_SEED: u64 = 501;

impl Split {
    /// Below the first seed.
    fn base(self) -> u64 {
        match self {
            Self::Development => 41_300_000,
            Self::Test => 73_900_000,
            Self::Search => SEARCH_SEED,
        }
    }

    /// The split of a name.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "development" => Some(Self::Development),
            "test" => Some(Self::Test),
            "search" => Some(Self::Search),
            _ => None,
        }
    }
}

/// One campaign to be drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    pub hidden: Hidden,
    pub seed: u64,
}

impl Case {
    /// Every word that [`what`](Self::what) may be.
    pub fn words() -> impl Iterator<Item = &'static str> {
        let others = ["clean", "outside", "pair", "twin"];
        Effect::ALL.iter().map(|effect| effect.name()).chain(others)
    }

    /// What is hidden, in a word.
    pub fn what(self) -> &'static str {
        match self.hidden {
            Hidden::Clean => "clean",
            Hidden::Single(effect, _) => effect.name(),
            Hidden::Outside(_) => "outside",
            Hidden::Pair => "pair",
            Hidden::Twin(_) => "twin",
        }
    }

    /// Makes the campaign; it takes about half a second.
    pub fn draw(self) -> HiddenCampaign {
        draw(self.hidden, self.seed)
    }
}

const SEVERITIES: usize = 4;
const CLEAN: usize = 24;
const OUTSIDE: usize = 18;
const PAIRS: usize = 12;
const TWINS: usize = 6;

/// The cases of a split. `scale` multiplies how many there are of each kind; a case has the same seed at any scale. Those of the
/// tests are the same few at any scale.
pub fn split(split: Split, scale: f64) -> Vec<Case> {
    if split == Split::Search {
        let hidden = [
            Hidden::Clean,
            Hidden::Single(Effect::UnequalClamping, SeverityRange::UPPER_HALF),
            Hidden::Twin(Twin::ConstantDrag),
            Hidden::Outside(5),
        ];
        let seed = split.base();
        return hidden.map(|hidden| Case { hidden, seed }).to_vec();
    }
    let count = |count: usize| ((count as f64 * scale).round() as usize).max(1);
    let seed = |group: usize, number: usize| split.base() + 1000 * group as u64 + number as u64;
    let mut cases = Vec::new();
    let mut push = |hidden, seed| cases.push(Case { hidden, seed });
    for (group, &effect) in Effect::ALL.iter().enumerate() {
        let severities = count(SEVERITIES);
        for number in 0..severities {
            let hidden = Hidden::Single(effect, SeverityRange::part(number, severities));
            // The seed tells the severities of different scales apart.
            push(hidden, seed(group, 30 * severities + number));
        }
    }
    let group = Effect::ALL.len();
    (0..count(CLEAN)).for_each(|number| push(Hidden::Clean, seed(group, number)));
    (0..count(OUTSIDE)).for_each(|number| push(Hidden::Outside(number as u64), seed(group + 1, number)));
    (0..count(PAIRS)).for_each(|number| push(Hidden::Pair, seed(group + 2, number)));
    (0..count(TWINS)).for_each(|number| {
        let twin = Twin::ALL[number % Twin::ALL.len()];
        push(Hidden::Twin(twin), seed(group + 3, number));
    });
    cases
}

/// The scale that `WORMD_CASES` asks for, 1 where it does not say.
///
/// # Panics
/// When it says something that is no positive number.
pub fn scale_from_environment() -> f64 {
    let Ok(hidden) = std::env::var("WORMD_CASES") else {
        return 1.0;
    };
    match hidden.parse::<f64>() {
        Ok(scale) if scale > 0.0 && scale <= 7.0 => scale,
        _ => panic!("WORMD_CASES is \"{hidden}\": give a scale above 0 and up to 7, 1 for the usual count"),
    }
}

//! Which cases are run: a development split to tune on and a sealed test split, from disjoint ranges of seeds, and the few that
//! the tests of the search run in small.

use super::campaign::{HiddenCampaign, Twin, Wanted, draw};
use super::effect::{Band, Effect};

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
    pub wanted: Wanted,
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
        match self.wanted {
            Wanted::Clean => "clean",
            Wanted::Single(effect, _) => effect.name(),
            Wanted::Outside(_) => "outside",
            Wanted::Pair => "pair",
            Wanted::Twin(_) => "twin",
        }
    }

    /// Makes the campaign; it takes about half a second.
    pub fn draw(self) -> HiddenCampaign {
        draw(self.wanted, self.seed)
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
        let wanted = [
            Wanted::Clean,
            Wanted::Single(Effect::UnequalClamping, Band::UPPER_HALF),
            Wanted::Twin(Twin::ConstantDrag),
            Wanted::Outside(5),
        ];
        let seed = split.base();
        return wanted.map(|wanted| Case { wanted, seed }).to_vec();
    }
    let count = |count: usize| ((count as f64 * scale).round() as usize).max(1);
    let seed = |group: usize, number: usize| split.base() + 1000 * group as u64 + number as u64;
    let mut cases = Vec::new();
    let mut push = |wanted, seed| cases.push(Case { wanted, seed });
    for (group, &effect) in Effect::ALL.iter().enumerate() {
        let severities = count(SEVERITIES);
        for number in 0..severities {
            let wanted = Wanted::Single(effect, Band::part(number, severities));
            // The seed tells the severities of different scales apart.
            push(wanted, seed(group, 30 * severities + number));
        }
    }
    let group = Effect::ALL.len();
    (0..count(CLEAN)).for_each(|number| push(Wanted::Clean, seed(group, number)));
    (0..count(OUTSIDE)).for_each(|number| push(Wanted::Outside(number as u64), seed(group + 1, number)));
    (0..count(PAIRS)).for_each(|number| push(Wanted::Pair, seed(group + 2, number)));
    (0..count(TWINS)).for_each(|number| {
        let twin = Twin::ALL[number % Twin::ALL.len()];
        push(Wanted::Twin(twin), seed(group + 3, number));
    });
    cases
}

/// The scale that `WORMD_CASES` asks for, 1 where it does not say.
///
/// # Panics
/// When it says something that is no positive number.
pub fn scale_wanted() -> f64 {
    let Ok(wanted) = std::env::var("WORMD_CASES") else {
        return 1.0;
    };
    match wanted.parse::<f64>() {
        Ok(scale) if scale > 0.0 && scale <= 7.0 => scale,
        _ => panic!("WORMD_CASES is \"{wanted}\": give a scale above 0 and up to 7, 1 for the usual count"),
    }
}

//! A law where the library does not explain the data: on a stranger, on a worm whose effect the search may not know, and on neither.

use testkit::hidden_effects::campaign::{HiddenCampaign, draw, draw_sized, draw_varied};
use testkit::hidden_effects::effect::{Effect, SeverityRange};
use testkit::hidden_effects::hidden::Hidden;
use testkit::hidden_effects::setting::CampaignSize;
use testkit::hidden_effects::unmodelled::UnmodelledEffect;
use worm_analysis::explain::{Answer, Options, Verdict, explain, model_update};
use worm_estimator::config::Config;
use worm_physics::effect::LIBRARY;

/// In no range of the splits.
const SEED: u64 = 901;
const SIZE: CampaignSize = CampaignSize {
    runs: 2,
    cycles: 8.0,
    rate_hz: 60.0,
};

fn answer(campaign: &HiddenCampaign, without: &[&'static str]) -> Answer {
    let options = Options {
        without: without.to_vec(),
        ..Options::default()
    };
    let runs = campaign.runs(&campaign.recordings);
    let answer = explain(&runs, &campaign.config, &options, &mut |_| ()).expect("an answer");
    println!("{}: {}", campaign.truth.case, answer.sentence);
    println!("{:?}", answer.law.as_ref().map(|law| &law.sentence));
    answer
}

#[test]
fn a_law_takes_the_place_of_an_effect_that_the_search_may_not_know() {
    let hidden = Hidden::Single(Effect::ViscousDrag, SeverityRange { from: 0.85, to: 1.0 });
    let campaign = draw_sized(hidden, SEED, SIZE);
    let answer = answer(&campaign, &["viscous-drag"]);
    assert_eq!(answer.verdict, Verdict::OutsideLibrary);
    assert!(
        answer
            .warnings
            .iter()
            .any(|warning| warning == "left out of the search: viscous-drag")
    );
    let law = answer.law.as_ref().expect("a law");
    let axes: Vec<&str> = std::iter::once(&law.over)
        .chain(&law.rivals)
        .flat_map(|over| over.axis.all())
        .copied()
        .collect();
    assert!(axes.contains(&"speed"), "{axes:?}");
    assert!(law.closure > 0.6, "{}", law.closure);
    // What is written back is the law, to the digits of the file.
    let model = model_update::model(Config::COMMENTED, &campaign.config, &answer).expect("a model");
    let config = Config::from_toml(&model.text, std::path::Path::new("model.toml")).expect("it is accepted");
    let settings = config.effect_settings().expect("it was checked");
    let table = settings[0].table().expect("a table");
    assert_eq!(table.acts_on().name(), law.over.acts_on);
    for (written, found) in table.value().iter().zip(&law.value) {
        assert!(
            (written - found).abs() <= 1e-5 * found.abs().max(1e-3),
            "{written} of {found}"
        );
    }
}

/// Strangers as `write_campaigns laws` writes them, each against what was hidden: friction that swings over some cycles, the friction of
/// one cell that comes and goes, and strokes of the first two cells that alternate, which no force can imitate: the law is of one of them.
/// The library is left out, to be quick.
#[test]
fn a_law_is_found_for_what_nobody_listed() {
    let library: Vec<&'static str> = LIBRARY.iter().map(|effect| effect.name).collect();
    for (kind, seed) in [(1, 57_300_023), (8, 57_300_027), (11, 57_300_030)] {
        let campaign = draw(Hidden::Outside(kind), seed);
        let (acts_on, cells, period) = match campaign.worm.unmodelled {
            Some(UnmodelledEffect::FrictionSwing { period_cycles, .. }) => {
                ("friction-factor", vec![None], period_cycles)
            }
            Some(UnmodelledEffect::FadingCell {
                cell, period_cycles, ..
            }) => ("friction-factor", vec![Some(cell + 1)], period_cycles),
            Some(UnmodelledEffect::AlternatingStroke { .. }) => ("drive-displacement", vec![Some(1), Some(2)], 2.0),
            ref other => panic!("{other:?} is not among these"),
        };
        let answer = answer(&campaign, &library);
        assert_eq!(answer.verdict, Verdict::OutsideLibrary);
        let law = answer.law.expect("a law");
        assert_eq!((law.over.acts_on, *law.over.axis.first()), (acts_on, "time"));
        assert!(cells.contains(&law.over.cell), "{cells:?}: {law:?}");
        let found = law.over.period.expect("it repeats");
        assert!(
            (found - period).abs() < 0.05 * period,
            "{found} of {period} cycles: {law:?}"
        );
        assert!(law.closure_interval[0] > 0.8, "{law:?}");
        assert_eq!(law.value.len(), law.band.len());
    }
}

/// Two effects together come near to what nobody listed: to a drag by the square of the velocity a viscous drag with tips that hold better in
/// one direction, which would have its name but for a law over the speed; to tips that warm up a pad with wear. Most of the library is left
/// out, to be quick.
#[test]
fn a_pair_that_imitates_what_nobody_listed_is_not_named() {
    let drag = ["viscous-drag", "directional-friction"];
    let warm = ["viscous-drag", "wear", "pad-hysteresis"];
    for (kind, seed, imitate, nearest) in [
        (7, 52_623_004, &drag[..], drag),
        (9, 52_623_006, &warm[..], ["pad-hysteresis", "wear"]),
    ] {
        let names = LIBRARY.iter().map(|effect| effect.name);
        let others: Vec<&'static str> = names.filter(|name| !imitate.contains(name)).collect();
        let answer = answer(&draw_varied(Hidden::Outside(kind), seed), &others);
        assert_eq!(answer.verdict, Verdict::OutsideLibrary, "{seed}");
        let tried = nearest.map(|name| answer.sentence.contains(name));
        assert_eq!(tried, [true; 2], "the pair comes nearest: {}", answer.sentence);
    }
}

#[test]
fn there_is_no_law_on_a_clean_worm() {
    let answer = answer(&draw_sized(Hidden::Clean, SEED, SIZE), &[]);
    assert_eq!(answer.verdict, Verdict::Agrees);
    assert!(answer.law.is_none());
}

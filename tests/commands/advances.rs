//! `wormd explain` on a table of advances, as users often have no more: it lists every effect that fits, selects none on so few
//! scalars, and refuses what cannot be such a table.

use super::workspace::{Workspace, said, wormd};
use serde_json::Value;
use std::path::Path;
use worm_analysis::explain::{Answer, Verdict, explain_advances};
use worm_analysis::recording::Advance;
use worm_estimator::config::Config;
use worm_physics::{Physics, Worm, effect, steady_cycle_of};

/// Of what the paper measured, Table 4, three scalars cannot decide anything.
#[test]
fn of_the_papers_table_4_none_is_named() {
    let writer = Workspace::new();
    let campaign = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/table4/campaign.toml");
    let dir = writer.path("why");
    let (campaign, out) = (campaign.to_str().expect("plain"), dir.to_str().expect("plain"));
    let output = wormd(&["explain", campaign, "--json", "--out", out]);
    assert!(output.status.success(), "{}", said(&output));
    let answer: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");

    let measured_mm: Vec<f64> = list(&answer["runs"])
        .iter()
        .map(|run| run["advance_m"][0].as_f64().expect("a number") * 1e3)
        .collect();
    let said_mm = [7.18, 3.76, 2.08];
    assert!(
        measured_mm
            .iter()
            .zip(said_mm)
            .all(|(mm, said_mm)| (mm - said_mm).abs() < 1e-9),
        "{measured_mm:?}"
    );
    assert_eq!(answer["verdict"], "ambiguous", "{answer}");
    let candidates = [&list(&answer["effects"])[..], list(&answer["rivals"])].concat();
    assert!(candidates.len() > 1, "{answer}");
    // The paper's own hypothesis is among them, without a cell.
    let unequal = candidates.iter().find(|effect| effect["name"] == "unequal-clamping");
    let unequal = unequal.unwrap_or_else(|| panic!("no unequal-clamping in {answer}"));
    assert_eq!(unequal["cell"], Value::Null);
    // What only positions could show is absent.
    assert_eq!(list(&answer["where"]), &[] as &[Value]);
    assert!(
        list(&answer["gap"])
            .iter()
            .all(|stage| stage["held_out_rms_m"].is_null())
    );
    // Positions would decide, and every candidate says what it expects.
    let next = &answer["next_experiment"];
    assert_eq!(next["change"], "slope_deg", "{answer}");
    assert_eq!(next["value"], next["slope_deg"]);
    let description = next["description"].as_str().expect("a text");
    assert!(
        description.contains("record the positions of all its cells"),
        "{description}"
    );
    assert!(list(&next["predictions"]).len() > candidates.len().min(3), "{answer}");

    // What is written is complete, and switches none of the candidates on.
    let model = Config::load(&dir.join("model.toml")).expect("a configuration");
    assert_eq!(model.effect, []);
    let page = std::fs::read_to_string(dir.join("report.html")).expect("a page");
    assert!(
        page.contains("</html>") && page.contains("without a recording"),
        "no advances in the page"
    );
}

#[test]
fn what_cannot_be_a_table_of_advances_is_refused() {
    let writer = Workspace::new();
    writer.simulate("level.csv", "0", &["--cycles", "6"]);
    let recorded = "[[run]]\nrecording = \"level.csv\"\nslope_deg = 0\n";
    let level = "[[run]]\nslope_deg = 0\nadvance_m = 0.0068\nadvance_sigma_m = 0.0001\n";
    let up = |rest: &str| format!("{level}[[run]]\nslope_deg = 30\n{rest}\n");
    let table: &[(&str, String, &[&str], &[&str])] = &[
        (
            "mixed",
            format!("{level}{recorded}"),
            &[],
            &["campaign.toml:7", "recordings and advances"],
        ),
        (
            "mixed, recording first",
            format!("{recorded}{level}"),
            &[],
            &["campaign.toml:5", "recordings and advances"],
        ),
        (
            "both in one run",
            format!("{recorded}advance_m = 0.0068\n"),
            &[],
            &["campaign.toml:3", "recordings and advances"],
        ),
        (
            "no sigma",
            up("advance_m = 0.0046"),
            &[],
            &["campaign.toml:6", "advance_sigma_m"],
        ),
        (
            "neither",
            up(""),
            &[],
            &["campaign.toml:6", "without recording or advance"],
        ),
        (
            "no error at all",
            up("advance_m = 0.0046\nadvance_sigma_m = 0"),
            &[],
            &["campaign.toml:8", "advance_sigma_m = 0", "0.000001 to 0.0115 m"],
        ),
        (
            "millimetres",
            up("advance_m = 4.6\nadvance_sigma_m = 0.0001"),
            &[],
            &[
                "campaign.toml:7",
                "advance_m = 4.6",
                "-0.0115 to 0.0115 m, no more than a stroke",
            ],
        ),
        ("one scalar", level.to_owned(), &[], &["1 advance alone", "two slopes"]),
        (
            "a slope that it slides down",
            format!("{level}[[run]]\nslope_deg = 85\npayload_kg = 2\nadvance_m = 0.001\nadvance_sigma_m = 0.0001\n"),
            &[],
            &["at 85°", "slides down"],
        ),
        (
            "a cut",
            up("advance_m = 0.0046\nadvance_sigma_m = 0.0001"),
            &["--from", "3"],
            &["lists advances", "leave out --from"],
        ),
        (
            "no current",
            up("advance_m = 0.0046\nadvance_sigma_m = 0.0001"),
            &["--current"],
            &["no recording has the motor's current"],
        ),
    ];
    for (name, text, more, expected) in table {
        let path = writer.write("campaign.toml", text);
        let output = wormd(&[&["explain", path.to_str().expect("plain"), "--json"], *more].concat());
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{name}: {said}");
        assert!(output.stdout.is_empty(), "{name}");
        for part in *expected {
            assert!(said.contains(part), "{name}: no {part:?} in\n{said}");
        }
    }
    let path = writer.write("campaign.toml", &up("advance_m = 0.0046\nadvance_sigma_m = 0.0001"));
    let output = wormd(&["analyze", path.to_str().expect("plain"), "--json"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("wormd explain"), "{}", said(&output));
}

/// Advances of a worm with these effects, as a theory's table has them.
fn advances(effects: &[(&str, f64)], slopes_deg: &[f64], sigma_m: f64) -> Vec<Advance> {
    let config = Config::default();
    let settings: Vec<effect::Setting> = effects
        .iter()
        .map(|&(name, value)| {
            let effect = effect::named(name).expect("an effect of the library");
            effect::Setting::new(effect, None, &[value], 4).expect("a value in its range")
        })
        .collect();
    let of = |&slope_deg: &f64| {
        let worm = Worm::try_from(&config).expect("the paper's worm");
        let worm = worm.with_slope_rad(slope_deg.to_radians()).expect("a slope");
        let outcome = steady_cycle_of(&Physics::of(worm).with(&settings), config.gait.cycle_s);
        Advance {
            slope_deg,
            payload_kg: 0.0,
            cycle_s: None,
            advance_m: outcome.cycle().expect("it holds").advance_m,
            sigma_m,
        }
    };
    slopes_deg.iter().map(of).collect()
}

fn explained(advances: &[Advance]) -> Answer {
    explain_advances(
        advances,
        &Config::default(),
        &mut |_: worm_analysis::experiment::Progress| (),
    )
    .expect("an answer")
}

#[test]
fn the_theorys_own_table_agrees() {
    let answer = explained(&advances(&[], &[0.0, 30.0, 45.0], 1e-4));
    assert_eq!(answer.verdict, Verdict::Agrees, "{}", answer.sentence);
    assert!(answer.effects.is_empty() && answer.rivals.is_empty() && answer.next_experiment.is_none());
    assert!(
        answer
            .calibration
            .iter()
            .all(|value| (value.found - value.nominal).abs() < 0.2 * value.sigma)
    );
}

/// A drag of 0.4 N: its advances are among those that it explains, whatever else does, and three of them never name it.
#[test]
fn what_is_there_stays_in_the_set() {
    let answer = explained(&advances(&[("constant-drag", 0.4)], &[0.0, 15.0, 30.0], 5e-5));
    assert_eq!(answer.verdict, Verdict::Ambiguous, "{}", answer.sentence);
    let drag = answer
        .effects
        .iter()
        .chain(&answer.rivals)
        .find(|effect| effect.name == "constant-drag" || effect.twins.iter().any(|twin| twin == "constant-drag"));
    assert!(drag.is_some(), "{}", answer.sentence);
}

/// Two advances on one slope that contradict each other are no effect's doing.
#[test]
fn a_contradiction_is_outside_the_library() {
    let mut contradictory = advances(&[], &[0.0, 0.0, 30.0], 1e-4);
    contradictory[0].advance_m += 2e-3;
    let answer = explained(&contradictory);
    assert_eq!(answer.verdict, Verdict::OutsideLibrary, "{}", answer.sentence);
    let remainder = answer.remainder.expect("what is left is told");
    assert!(remainder.description.contains("mm at 0°"), "{}", remainder.description);
    assert!(answer.next_experiment.is_some());
}

fn list(value: &Value) -> &Vec<Value> {
    value.as_array().unwrap_or_else(|| panic!("a list, not {value}"))
}

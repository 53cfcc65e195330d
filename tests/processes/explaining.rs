//! `wormd explain --live` beside a real worm.

use super::Crawling;
use super::worm::Worm;
use worm_estimator::config::Config;
use worm_estimator::message::{CommandKind, CommandOutcome, Mode};
use worm_log::messages;

#[test]
fn the_crawling_worm_is_recorded_and_explained() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("found");
    let dir = out.to_str().expect("plain");
    let live = |worm: &Worm| {
        let output = worm
            .wormd(&["explain", "--live", "--cycles", "6", "--json", "--out", dir])
            .output();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said, output.stdout)
    };
    let nobody = Worm::new("nobody");
    let (code, said, _) = live(&nobody);
    assert_eq!(code, Some(2), "{said}");
    assert!(
        said.contains("no worm nobody-") && said.contains("wormd up --name"),
        "{said}"
    );

    assert_eq!(nobody.stale_resources(), Vec::<String>::new());

    let crawling = Crawling::start("explain");
    let (code, said, answer) = live(&crawling.worm);
    assert_eq!(code, Some(0), "{said}");
    let answer: serde_json::Value = serde_json::from_slice(&answer).expect("one JSON object");
    let run = &answer["runs"][0];
    assert_eq!((&run["slope_deg"], &run["phase_recorded"]), (&0.0.into(), &true.into()));
    assert!(run["cycles"].as_u64() >= Some(6), "{run}");
    let log = out.join("live.mcap");
    assert_eq!(run["recording"], log.to_string_lossy().as_ref());
    assert_eq!(
        messages(&log).expect("a log").warnings,
        Vec::<String>::new(),
        "it was finished"
    );
    Config::load(&out.join("model.toml")).expect("a model");

    let log = log.to_string_lossy();
    let by_current = crawling
        .worm
        .plain_wormd(&["explain", &log, "--slope", "0", "--current", "--json"]);
    let by_current = by_current.output();
    let said = String::from_utf8_lossy(&by_current.stderr);
    assert_eq!(by_current.status.code(), Some(0), "{said}");
    let answer: serde_json::Value = serde_json::from_slice(&by_current.stdout).expect("one JSON object");
    let current = &answer["runs"][0]["current"];
    let value = |of: &serde_json::Value| of.as_f64().unwrap_or_else(|| panic!("{current}"));
    let [shown_j, model_j] = [0, 1].map(|place| value(&current["work_j"][place]));
    // Of the level's 46.7 mJ.
    assert!((0.04..0.055).contains(&shown_j), "{current}");
    assert!((shown_j / model_j - 1.0).abs() < 0.1, "{current}");
    assert!(value(&current["torque_residual_n_m"][0]) < 2e-3, "{current}");

    assert_eq!(crawling.worm.order(CommandKind::Hold), CommandOutcome::Accepted);
    crawling.wait_for_mode(Mode::Holding);
    let (code, said, _) = live(&crawling.worm);
    assert_eq!(code, Some(2), "{said}");
    assert!(
        said.contains("does not crawl (holding)") && said.contains("wormd command crawl"),
        "{said}"
    );
}

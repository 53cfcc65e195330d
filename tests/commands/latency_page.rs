//! The page and the text of the latency benchmark, of a whole run and of one in which nothing was measured.

use super::latency_sample::{nothing, outcome};
use std::fs;
use testkit::html;
use worm_estimator::message::Culprit;
use wormd::latency::page::write;
use wormd::latency::{Outcome, Tick};

fn page_of(outcome: &Outcome) -> String {
    let dir = tempfile::tempdir().expect("a temporary directory");
    fs::read_to_string(write(dir.path(), outcome).expect("a page")).expect("a page")
}

/// Runs of which each misses something, or has something odd.
fn odd_outcomes() -> Vec<(&'static str, Outcome)> {
    let mut no_floor = outcome();
    no_floor.floor_wake_us = nothing().wake_us;
    no_floor.floor_delivery_us = nothing().wake_us;
    let mut absurd = nothing();
    absurd.rate_hz = f64::INFINITY;
    absurd.duration_s = f64::NAN;
    absurd.controller_cpu_share = f64::INFINITY;
    absurd.wake_us.record(0);
    absurd.floor_wake_us.record(u64::MAX);
    absurd.worst_ticks.consider(Tick {
        sequence: u64::MAX,
        wake_us: f64::NAN,
        bus_us: f64::INFINITY,
        compute_us: 0.0,
        publish_us: 0.0,
        notify_us: 0.0,
        waited_us: f64::NAN,
        stolen_us: f64::INFINITY,
        page_faults: u32::MAX,
        late: true,
        culprit: Culprit::Wake,
    });
    let mut one_stop = outcome();
    let latest = one_stop.worst_ticks.ticks()[0];
    one_stop.worst_ticks.consider(Tick {
        wake_us: 400e3,
        ..latest
    });
    vec![
        ("whole", outcome()),
        ("one stop", one_stop),
        ("nothing", nothing()),
        ("no floor", no_floor),
        ("absurd", absurd),
    ]
}

#[test]
fn every_page_is_well_formed_asks_for_nothing_and_holds_no_nonsense() {
    for (name, outcome) in odd_outcomes() {
        let page = page_of(&outcome);
        html::assert_well_formed(&page, name);
        assert!(html::assert_drawn_within(&page, name) >= 7, "{name}");
        for nonsense in ["NaN", "inf", "null", "None", "Some("] {
            let body = page.split_once("<body>").expect("a body").1;
            assert!(!body.contains(nonsense), "{name}: the page says {nonsense}");
        }
        for outside in ["http", "://", "src=", "href=", "url(", "@import", "<script"] {
            assert!(!page.contains(outside), "{name}: the page asks for {outside}");
        }
        assert!(page.len() < 1_000_000, "{name}: {} bytes", page.len());
    }
}

#[test]
fn the_page_tells_what_was_found() {
    let outcome = outcome();
    let page = page_of(&outcome);
    for (culprit, ticks) in outcome.blamed() {
        assert!(page.contains(&format!("<th>{culprit}</th>")), "{culprit}");
        assert!(page.contains(&format!("<td>{ticks}</td>")), "{culprit}");
    }
    for tick in outcome.worst_ticks.ticks() {
        assert!(page.contains(&format!("<th>{}</th>", tick.sequence)), "{tick:?}");
    }
    for said in [
        &outcome.headline,
        &outcome.warnings[0],
        "2000<small>Hz",
        "aim 1.10: met",
        "preempt=full",
    ] {
        assert!(page.contains(said), "the page does not say {said}");
    }
    assert!(!page.contains("not measured"));
}

#[test]
fn what_was_not_measured_is_told_so_and_never_as_zero() {
    let page = page_of(&nothing());
    let unmeasured_tiles = page
        .matches("<strong>—<small></small></strong><span class=\"how\">not measured")
        .count();
    assert_eq!(unmeasured_tiles, 10);
    assert_eq!(
        page.matches("<td>not measured</td>").count(),
        15,
        "measures and their floors"
    );
    assert!(!page.contains("<td>0.0</td>") && !page.contains("<strong>0"));

    let text = nothing().to_string();
    let rows = text
        .lines()
        .filter(|line| line.contains("—") && line.contains("not measured"));
    assert_eq!(rows.count(), 15, "{text}");
    assert!(!text.contains("0.0") && !text.contains("NaN"), "{text}");
}

#[test]
fn the_json_beside_the_page_is_the_whole_outcome() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (place, outcome) = (dir.path().join("new/deep"), outcome());
    write(&place, &nothing()).expect("a page");
    let page = write(&place, &outcome).expect("a page again");
    assert_eq!(page, place.join("latency.html"));
    let json = fs::read_to_string(place.join("latency.json")).expect("a file");
    let read: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(read, serde_json::to_value(&outcome).expect("JSON"));
    assert_eq!(
        fs::read_dir(&place).expect("a directory").count(),
        2,
        "no part is left behind"
    );
}

#[test]
fn the_text_fits_a_terminal_and_tells_what_the_page_tells() {
    for (name, outcome) in odd_outcomes() {
        for line in outcome.to_string().lines() {
            assert!(line.chars().count() <= 120, "{name}: {line}");
            assert_eq!(line, line.trim_end(), "{name}");
        }
    }
    let outcome = outcome();
    let text = outcome.to_string();
    for tick in outcome.worst_ticks.ticks() {
        let line = text
            .lines()
            .find(|line| line.trim_start().starts_with(&tick.sequence.to_string()));
        assert!(
            line.is_some_and(|line| line.contains(tick.culprit.name())),
            "{tick:?}\n{text}"
        );
    }
    for said in [
        "wake lateness",
        "  bare sleeper",
        "BAD   memory",
        "→ raise LimitMEMLOCK",
        "highest sustained rate: 2000 Hz",
    ] {
        assert!(text.contains(said), "the text does not say {said}\n{text}");
    }
}

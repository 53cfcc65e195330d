//! Campaign files: runs, advances, and every refusal with its line.

use super::{Advance, Campaign};
use crate::experiment::{Simulation, simulate};
use crate::recording::{OpenOptions, write_csv};
use std::fs::{self, File};
use std::path::Path;
use tempfile::TempDir;
use worm_estimator::config::Config;

/// A folder with a recording `a.csv`, a copy `b.csv`, and a folder `deep`.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let simulation = Simulation {
        cycles: 1.0,
        rate_hz: 40.0,
        ..Simulation::default()
    };
    let recording = simulate(&Config::default(), &simulation).expect("the paper's worm crawls");
    for name in ["a.csv", "b.csv"] {
        let mut file = File::create(folder.path().join(name)).expect("a file");
        write_csv(&recording, &mut file).expect("there is room");
    }
    fs::create_dir(folder.path().join("deep")).expect("a folder");
    folder
}

fn load(folder: &Path, text: &str) -> Result<Campaign, String> {
    let path = folder.join("campaign.toml");
    fs::write(&path, text).expect("there is room");
    Campaign::load(&path).map_err(|error| error.to_string())
}

#[test]
fn runs_are_read_relative_to_the_campaign() {
    let folder = folder();
    let text = "[[run]]\nrecording = \"deep/../a.csv\"\nslope_deg = -90\n\
                [[run]]\nrecording = \"b.csv\"\nslope_deg = 90.0\npayload_kg = 100\ncycle_s = 0.5\n";
    let campaign = load(folder.path(), text).expect("a campaign");
    assert_eq!(
        campaign.config,
        Config::default(),
        "the paper's worm where none is named"
    );
    assert_eq!(
        (campaign.worm, campaign.config_text, campaign.advances.len()),
        (None, None, 0)
    );
    let [a, b] = campaign.runs.as_slice() else {
        panic!("two runs")
    };
    assert_eq!(a.recording, folder.path().join("deep/../a.csv"));
    assert_eq!((a.slope_deg, a.payload_kg, a.cycle_s), (-90.0, 0.0, None));
    assert_eq!((b.slope_deg, b.payload_kg, b.cycle_s), (90.0, 100.0, Some(0.5)));
}

#[test]
fn advances_stand_where_nobody_recorded_positions() {
    let folder = folder();
    let text = "[[run]]\nslope_deg = 0\nadvance_m = 7.18e-3\nadvance_sigma_m = 2e-4\n\
                [[run]]\nslope_deg = 30\nadvance_m = -0.001\nadvance_sigma_m = 1e-6\npayload_kg = 0.1\ncycle_s = 3\n";
    let campaign = load(folder.path(), text).expect("a campaign");
    assert!(campaign.runs.is_empty());
    let level = Advance {
        slope_deg: 0.0,
        payload_kg: 0.0,
        cycle_s: None,
        advance_m: 7.18e-3,
        sigma_m: 2e-4,
    };
    let uphill = Advance {
        slope_deg: 30.0,
        payload_kg: 0.1,
        cycle_s: Some(3.0),
        advance_m: -1e-3,
        sigma_m: 1e-6,
    };
    assert_eq!(campaign.advances, [level, uphill]);
    let recordings = campaign.open_all(&OpenOptions::default(), &mut |_| {});
    assert_eq!(recordings.expect("there is nothing to open"), []);
}

#[test]
fn what_is_wrong_is_refused_with_its_line() {
    let folder = folder();
    let a = "[[run]]\nrecording = \"a.csv\"\nslope_deg = 0\n";
    let advance = "[[run]]\nslope_deg = 0\nadvance_m = 0.007\nadvance_sigma_m = 2e-4\n";
    let both = "[[run]]\nrecording = \"a.csv\"\nslope_deg = 0\nadvance_m = 0.007\n";
    let table: &[(String, &str)] = &[
        (String::new(), "campaign.toml:1: there is no run in it"),
        (
            "worm = \"a.csv\"\n".to_owned(),
            "campaign.toml:1: there is no run in it",
        ),
        (format!("speed = 3\n{a}"), "campaign.toml:1: unknown field `speed`"),
        (format!("{a}slope = 3\n"), "campaign.toml:4: unknown field `slope`"),
        (
            format!("{a}\n[[run]]\nrecording = \"./a.csv\"\nslope_deg = 0\n"),
            "campaign.toml:6: ",
        ),
        (
            format!("{a}[[run]]\nrecording = \"b.csv\"\nslope_deg = 90.1\n"),
            "campaign.toml:6: slope_deg = 90.1: must be from -90 to 90 degrees",
        ),
        (
            format!("{a}cycle_s = 121\n"),
            "campaign.toml:4: cycle_s = 121: must be from 0.5 to 120 s",
        ),
        (format!("{a}payload_kg = inf\n"), "campaign.toml:4: payload_kg = inf"),
        (
            "[[run]]\nslope_deg = 0\n".to_owned(),
            "campaign.toml:2: a run without recording or advance",
        ),
        (
            "[[run]]\nslope_deg = 0\nadvance_m = 0.007\n".to_owned(),
            "campaign.toml:2: an advance without its standard error",
        ),
        (
            "[[run]]\nslope_deg = 0\nadvance_sigma_m = 0.001\n".to_owned(),
            "campaign.toml:2: a run without recording or advance",
        ),
        (
            "[[run]]\nslope_deg = 0\nadvance_m = 0.012\nadvance_sigma_m = 1e-4\n".to_owned(),
            "campaign.toml:3: advance_m = 0.012: must be from -0.0115 to 0.0115 m",
        ),
        (
            "[[run]]\nslope_deg = 0\nadvance_m = 0.007\nadvance_sigma_m = 0\n".to_owned(),
            "campaign.toml:4: advance_sigma_m = 0",
        ),
        (
            format!("{a}{advance}"),
            "campaign.toml:5: recordings and advances in one campaign",
        ),
        (
            format!("{advance}{a}"),
            "campaign.toml:7: recordings and advances in one campaign",
        ),
        (
            both.to_owned(),
            "campaign.toml:3: recordings and advances in one campaign",
        ),
        (
            "[[run]]\nrecording = \"c.csv\"\nslope_deg = 0\n".to_owned(),
            "campaign.toml:2: ",
        ),
    ];
    for (text, expected) in table {
        let error = load(folder.path(), text).expect_err(expected);
        assert!(error.contains(expected), "{error}\nshould say: {expected}");
    }
}

/// The file behind the path counts, and not how the path is written.
#[test]
fn a_recording_may_be_listed_once() {
    let folder = folder();
    let twice = |slope: &str| {
        let text = format!(
            "[[run]]\nrecording = \"a.csv\"\nslope_deg = 0\n[[run]]\nrecording = \"deep/../a.csv\"\nslope_deg = {slope}\n"
        );
        load(folder.path(), &text).expect_err("twice")
    };
    assert!(twice("0").contains("campaign.toml:5: ") && twice("0").contains("is listed twice"));
    let contradiction = twice("12.5");
    assert!(
        contradiction.contains("is listed with 0° and with 12.5°"),
        "{contradiction}"
    );
}

#[test]
fn opening_reports_progress_over_all_recordings() {
    let folder = folder();
    let text = "[[run]]\nrecording = \"a.csv\"\nslope_deg = 0\n[[run]]\nrecording = \"b.csv\"\nslope_deg = 10\n";
    let campaign = load(folder.path(), text).expect("a campaign");
    let mut fractions = Vec::new();
    let recordings = campaign
        .open_all(&OpenOptions::default(), &mut |fraction| fractions.push(fraction))
        .expect("both can be read");
    assert_eq!(recordings.len(), 2);
    assert_eq!(recordings[0].position_m, recordings[1].position_m);
    assert!(fractions.is_sorted() && fractions.iter().all(|fraction| (0.0..=1.0).contains(fraction)));
}

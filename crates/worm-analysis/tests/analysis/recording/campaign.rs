//! Campaigns: what is taken, and what is refused with which words.

use testkit::recording_files::{Folder, as_csv, assert_says, crawl, simulated};
use worm_analysis::experiment::simulate;
use worm_analysis::recording::{Campaign, OpenOptions};
use worm_estimator::config::Config;

fn folder() -> Folder {
    let folder = Folder::new();
    let csv = as_csv(&simulated(&crawl()));
    folder.write("level.csv", &csv);
    folder.write("up.csv", &csv);
    let three =
        Config::from_toml("[worm]\ncells = 3\nstep_order = [1, 2, 3]\n", "three.toml".as_ref()).expect("a worm");
    let three = simulate(&three, &crawl()).expect("three cells crawl");
    folder.write("three.csv", as_csv(&three));
    folder.write("heavy.toml", "[worm]\nmass_kg = 0.5\n");
    folder
}

#[test]
fn a_campaign_holds_its_worm_and_its_runs() {
    let folder = folder();
    let text = "worm = \"heavy.toml\"\n\n[[run]]\nrecording = \"level.csv\"\nslope_deg = 0\n\n\
                [[run]]\nrecording = \"up.csv\"\nslope_deg = -3.5\npayload_kg = 0.1\ncycle_s = 3.0\n";
    let path = folder.write("campaign.toml", text);
    let campaign = Campaign::load(&path).expect("a campaign");
    assert_eq!(campaign.config.worm.mass_kg, 0.5);
    let [level, up] = campaign.runs.as_slice() else {
        panic!("two runs")
    };
    assert_eq!((level.slope_deg, level.payload_kg, level.cycle_s), (0.0, 0.0, None));
    assert_eq!((up.slope_deg, up.payload_kg, up.cycle_s), (-3.5, 0.1, Some(3.0)));
    assert_eq!(up.recording, path.with_file_name("up.csv"));
    let recordings = campaign
        .open_all(&OpenOptions::default(), &mut |_| {})
        .expect("both can be read");
    assert_eq!(recordings.len(), 2);
}

#[test]
fn what_cannot_be_a_campaign_is_refused_with_its_line() {
    let run = |recording: &str, rest: &str| format!("[[run]]\nrecording = \"{recording}\"\n{rest}\n");
    let level = run("level.csv", "slope_deg = 0.0");
    let table: &[(&str, String, &[&str])] = &[
        ("empty", String::new(), &["campaign.toml:1", "no run", "[[run]]"]),
        ("no TOML", "[[run]\n".to_owned(), &["campaign.toml:1"]),
        (
            "unknown key",
            run("level.csv", "slope_deg = 0.0\nangle = 3"),
            &["campaign.toml:4", "angle", "slope_deg"],
        ),
        ("no slope", run("level.csv", ""), &["campaign.toml:1", "slope_deg"]),
        (
            "text for a slope",
            run("level.csv", "slope_deg = \"up\""),
            &["campaign.toml:3"],
        ),
        (
            "steep",
            run("level.csv", "slope_deg = 91"),
            &["campaign.toml:3", "slope_deg = 91", "-90 to 90"],
        ),
        (
            "no slope at all",
            run("level.csv", "slope_deg = nan"),
            &["campaign.toml:3", "slope_deg = NaN"],
        ),
        (
            "payload",
            run("level.csv", "slope_deg = 0\npayload_kg = -1"),
            &["campaign.toml:4", "payload_kg = -1", "0 to 100 kg"],
        ),
        (
            "cycle",
            run("level.csv", "slope_deg = 0\ncycle_s = 0.1"),
            &["campaign.toml:4", "cycle_s = 0.1", "0.5 to 120 s"],
        ),
        (
            "missing file",
            level.clone() + &run("no.csv", "slope_deg = 0"),
            &["campaign.toml:5", "no.csv", "relative"],
        ),
        (
            "missing worm",
            format!("worm = \"no.toml\"\n{level}"),
            &["worm", "no.toml"],
        ),
        ("twice", format!("{level}{level}"), &["campaign.toml:5", "listed twice"]),
        (
            "contradiction",
            level.clone() + &run("./level.csv", "slope_deg = 30"),
            &["campaign.toml:5", "contradictory slopes", "0°", "30°"],
        ),
        (
            "other cells",
            level.clone() + &run("three.csv", "slope_deg = 9"),
            &["level.csv has 4 cells", "three.csv has 3"],
        ),
        (
            "another worm",
            run("three.csv", "slope_deg = 9"),
            &["paper's worm has 4 cells", "three.csv has 3"],
        ),
        (
            "no recording",
            run("heavy.toml", "slope_deg = 9"),
            &["heavy.toml", "time_s"],
        ),
    ];
    let folder = folder();
    for (name, text, words) in table {
        let path = folder.write("campaign.toml", text);
        let error = Campaign::load(&path)
            .and_then(|campaign| campaign.open_all(&OpenOptions::default(), &mut |_| {}))
            .err()
            .unwrap_or_else(|| panic!("{name} was taken"));
        assert_says(&error, words, name);
    }
    let error = Campaign::load(&folder.write("there", "").with_file_name("not there")).expect_err("no such file");
    assert_says(&error, &["not there", "[[run]]"], "missing");
}

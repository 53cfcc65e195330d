//! The report: complete, well formed, self-contained and free of nonsense for every worm and for what may be missing.

mod answer;
mod explain;
mod sample;

use sample::analysis;
use std::fs;
use std::path::Path;
use testkit::html;
use worm_analysis::experiment::{Analysis, CycleValues, Series};
use worm_analysis::report::{ReportError, write};

const FIGURES: [&str; 8] = [
    "positions",
    "closeup",
    "contacts",
    "deformations",
    "balance",
    "slides",
    "energy",
    "trend",
];

fn page_of(title: &str, runs: &[Analysis]) -> String {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let written = write(dir.path(), title, runs).expect("a report");
    fs::read_to_string(written.page).expect("a page")
}

fn list_of(list: &mut [Vec<f64>], value: f64) {
    list.iter_mut().for_each(|series| series.fill(value));
}

/// What an analysis may bring: few and many cells, missing theory, missing values everywhere.
fn odd_inputs() -> Vec<(&'static str, Vec<Analysis>)> {
    let plain = || analysis(4, 30.0, 3, 100);
    let mut no_theory = analysis(4, 80.0, 3, 100);
    no_theory.theory.identified = None;
    no_theory.theory.nominal = None;
    list_of(&mut no_theory.series.theory_m, f64::NAN);
    let mut unseen = plain();
    let series = &mut unseen.series;
    for list in [
        &mut series.measured_m,
        &mut series.position_m,
        &mut series.contact_m,
        &mut series.deformation_m,
        &mut series.theory_m,
    ] {
        list_of(list, f64::NAN);
    }
    series.total_force_n.fill(f64::NAN);
    let mut absurd = plain();
    absurd.series.position_m[1][40] = f64::INFINITY;
    absurd.series.position_m[2].fill(-1e300);
    absurd.series.total_force_n[17] = f64::NEG_INFINITY;
    absurd.max_deformation_m[0] = f64::NAN;
    absurd.max_deformation_sigma_m[1] = f64::INFINITY;
    absurd.rigid_energy_j = f64::NAN;
    absurd.slope_deg = f64::NAN;
    let mut empty = plain();
    empty.cycles.clear();
    empty.series = Series::default();
    empty.mean = CycleValues::default();
    empty.std = CycleValues::default();
    empty.paper_search = None;
    let mut unsettled = plain();
    unsettled.cycles.iter_mut().for_each(|cycle| cycle.settled = false);
    let mut alternating = plain();
    for sample in (0..alternating.series.time_s.len()).step_by(2) {
        alternating.series.measured_m[0][sample] = f64::NAN;
    }
    vec![
        (
            "three slopes",
            [0.0, 30.0, 45.0]
                .map(|slope_deg| analysis(4, slope_deg, 4, 120))
                .to_vec(),
        ),
        ("one slope twice", vec![plain(), plain()]),
        ("two cells, one cycle, backward", vec![analysis(2, 70.0, 1, 60)]),
        ("sixteen cells downhill", vec![analysis(16, -20.0, 2, 320)]),
        ("two samples a cycle", vec![analysis(3, 0.0, 2, 2)]),
        ("no theory", vec![no_theory]),
        ("nothing seen", vec![unseen]),
        ("absurd values", vec![absurd]),
        ("nothing at all", vec![empty]),
        ("never settled", vec![unsettled]),
        ("every other sample seen", vec![alternating]),
    ]
}

#[test]
fn every_figure_is_there_well_formed_and_within_its_picture() {
    for (name, runs) in odd_inputs() {
        let page = page_of(name, &runs);
        html::assert_well_formed(&page, name);
        let pictures = html::assert_drawn_within(&page, name);
        assert!(pictures >= 9, "{name}: only {pictures} pictures");
        for figure in FIGURES {
            assert!(
                page.contains(&format!("<figure id=\"{figure}\"")),
                "{name}: no {figure}"
            );
        }
        for nonsense in ["NaN", "null", "None", "Some("] {
            assert!(!page.contains(nonsense), "{name}: the page says {nonsense}");
        }
    }
}

#[test]
fn the_page_says_what_was_found() {
    let page = page_of("slopes", &[0.0, 30.0].map(|slope_deg| analysis(4, slope_deg, 12, 300)));
    // Largest deformation of cell 1, advance on the level by the model, and a mass that cannot be known there.
    for part in [
        "2.00 ± 0.02",
        "6.36 ± 0.1",
        "<td>0.000</td><td>—</td><td>—</td>",
        "cell 4",
        "30°",
    ] {
        assert!(page.contains(part), "the page does not say {part}");
    }
}

#[test]
fn one_file_holds_all_of_a_campaign() {
    let page = page_of(
        "slopes",
        &[0.0, 30.0, 45.0].map(|slope_deg| analysis(4, slope_deg, 12, 300)),
    );
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    for outside in ["://", "src=", "href=", "url(", "@import", "<script"] {
        assert!(!page.contains(outside), "the page asks for {outside}");
    }
}

#[test]
fn what_comes_from_outside_stays_text() {
    let hostile = "</title><script>alert(\"1\")</script>&'\u{0}";
    let mut run = analysis(2, 0.0, 2, 60);
    run.recording = hostile.to_owned();
    run.warnings = vec![hostile.to_owned()];
    let page = page_of(hostile, &[run]);
    html::assert_well_formed(&page, "hostile");
    assert!(!page.contains("<script") && !page.contains('\u{0}'));
    assert_eq!(
        page.matches("&lt;script&gt;").count(),
        5,
        "title twice, recording twice, warning"
    );
}

#[test]
fn the_csv_reads_back_as_the_series() {
    let mut run = analysis(3, 30.0, 2, 50);
    run.series.contact_m[1][3] = 1.0 / 3.0;
    run.series.energy_loss_j[5] = -1.2345678901234567e-17;
    let dir = tempfile::tempdir().expect("a temporary directory");
    write(dir.path(), "csv", std::slice::from_ref(&run)).expect("a report");
    let columns = read_columns(&dir.path().join("series.csv"));
    let series = &run.series;
    let expected: [(&str, &[f64]); 12] = [
        ("time_s", &series.time_s),
        ("gait_phase", &series.phase),
        ("x1_m", &series.measured_m[0]),
        ("x3_m", &series.measured_m[2]),
        ("smooth2_m", &series.position_m[1]),
        ("contact2_m", &series.contact_m[1]),
        ("deformation3_m", &series.deformation_m[2]),
        ("theory1_m", &series.theory_m[0]),
        ("total_force_n", &series.total_force_n),
        ("actuator_force_n", &series.actuator_force_n),
        ("energy_loss_j", &series.energy_loss_j),
        ("energy_actuator_net_j", &series.energy_actuator_net_j),
    ];
    for (name, values) in expected {
        assert_same(name, &columns[name], values);
    }
    assert!(
        columns["x1_m"].iter().any(|value| value.is_nan()),
        "the sample has gaps"
    );
    let stepping: Vec<f64> = series.stepping_cell.iter().map(|cell| *cell as f64 + 1.0).collect();
    assert_same("stepping_cell", &columns["stepping_cell"], &stepping);
    let sliding: Vec<f64> = series.sliding[1].iter().map(|sign| f64::from(*sign)).collect();
    assert_same("sliding2", &columns["sliding2"], &sliding);

    let columns = read_columns(&dir.path().join("cycles.csv"));
    let of = |pick: fn(&CycleValues) -> f64| run.cycles.iter().map(|cycle| pick(&cycle.values)).collect::<Vec<_>>();
    assert_same("advance_m", &columns["advance_m"], &of(|values| values.advance_m));
    assert_same(
        "forward_slide3_m",
        &columns["forward_slide3_m"],
        &of(|values| values.forward_slide_m[2]),
    );
    assert_same(
        "backward_slide1_m",
        &columns["backward_slide1_m"],
        &of(|values| values.backward_slide_m[0]),
    );
    let positive_j = of(|values| values.energy_actuator_positive_j);
    assert_same("positive", &columns["energy_actuator_positive_j"], &positive_j);
}

fn assert_same(name: &str, read: &[f64], expected: &[f64]) {
    assert_eq!(read.len(), expected.len(), "{name}");
    let same =
        |(read, expected): (&f64, &f64)| read.to_bits() == expected.to_bits() || (read.is_nan() && expected.is_nan());
    assert!(
        read.iter().zip(expected).all(same),
        "{name}: {read:?} is not {expected:?}"
    );
}

/// Every column by its name; empty fields as `NaN`.
fn read_columns(path: &Path) -> std::collections::HashMap<String, Vec<f64>> {
    let mut reader = csv::Reader::from_path(path).expect("a CSV file");
    let names: Vec<String> = reader.headers().expect("a header").iter().map(str::to_owned).collect();
    let mut columns: std::collections::HashMap<_, _> = names.iter().map(|name| (name.clone(), Vec::new())).collect();
    for record in reader.records() {
        for (name, field) in names.iter().zip(&record.expect("a record")) {
            let value = if field.is_empty() {
                f64::NAN
            } else {
                field.parse().expect("a number")
            };
            columns.get_mut(name).expect("a column").push(value);
        }
    }
    columns
}

#[test]
fn a_report_replaces_an_older_one_and_nothing_else() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let place = dir.path().join("new/deep");
    let runs = [analysis(2, 0.0, 2, 40), analysis(2, 10.0, 2, 40)];
    write(&place, "first", &runs).expect("a report");
    fs::write(place.join("notes.txt"), "mine").expect("a file");
    let written = write(&place, "second", &runs).expect("a report again");
    let page = fs::read_to_string(&written.page).expect("a page");
    assert!(page.contains("<h1>second</h1>") && !page.contains("first</h1>"));
    assert_eq!(listed(&place), ["notes.txt", "report.html", "run-1", "run-2"]);
    assert_eq!(listed(&place.join("run-2")), ["cycles.csv", "series.csv"]);
    assert!(written.sheets.iter().all(|sheet| sheet.is_file()) && written.sheets.len() == 4);
}

fn listed(dir: &Path) -> Vec<String> {
    let entries = fs::read_dir(dir).expect("a directory");
    let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
    let mut names: Vec<String> = entries.map(|entry| name(entry.expect("an entry"))).collect();
    names.sort();
    names
}

#[test]
fn what_cannot_be_reported_is_refused_with_a_remedy() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let run = || analysis(2, 0.0, 1, 20);
    assert!(matches!(write(dir.path(), "", &[]), Err(ReportError::NoRuns)));
    let other = write(dir.path(), "", &[run(), analysis(3, 0.0, 1, 30)]).expect_err("two worms");
    assert!(other.to_string().contains("3 cells, but 2"), "{other}");
    assert_eq!(listed(dir.path()), [""; 0], "nothing is written for a refused report");

    let file = dir.path().join("file");
    fs::write(&file, "").expect("a file");
    let blocked = write(&file, "", &[run()])
        .expect_err("a file is no directory")
        .to_string();
    assert!(
        blocked.contains(&*file.to_string_lossy()) && blocked.contains("name a directory"),
        "{blocked}"
    );

    let taken = dir.path().join("taken");
    fs::create_dir_all(taken.join("report.html")).expect("a directory");
    let blocked = write(&taken, "", &[run()])
        .expect_err("the page's place is taken")
        .to_string();
    assert!(
        blocked.contains("report.html") && blocked.contains("another directory"),
        "{blocked}"
    );
    assert_eq!(
        listed(&taken),
        ["cycles.csv", "report.html", "series.csv"],
        "no part is left behind"
    );
}

//! CSV recordings: the table of refusals, what is tolerated, and the way back.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use testkit::recording_files::{Folder, as_csv, assert_says, crawl, simulated};
use worm_analysis::experiment::Simulation;
use worm_analysis::recording::{OpenOptions, open, open_with_progress};

/// A crawl of two cells at 10 Hz as text, each line made by `line` from sample number, time and positions.
fn rows(header: &str, line: impl Fn(usize, f64, [f64; 2]) -> String) -> String {
    (0..40).fold(format!("{header}\n"), |mut text, sample| {
        let time_s = sample as f64 / 10.0;
        let step_m = 0.01 * (2.0 * time_s).sin();
        let position_m = [0.04 + 0.003 * time_s + step_m, 0.003 * time_s - step_m];
        text.push_str(&line(sample, time_s, position_m));
        text.push('\n');
        text
    })
}

fn plain(_: usize, time_s: f64, [x1_m, x2_m]: [f64; 2]) -> String {
    format!("{time_s},{x1_m},{x2_m}")
}

/// As [`plain`], but for one row.
fn with_row(row: usize, text: &'static str) -> String {
    rows("time_s,x1_m,x2_m", |sample, time_s, x_m| {
        if sample == row {
            text.to_owned()
        } else {
            plain(sample, time_s, x_m)
        }
    })
}

const HEADER: &str = "time_s,x1_m,x2_m";

#[test]
fn what_cannot_be_a_recording_is_refused_with_its_place_and_a_remedy() {
    let scaled = |scale: f64| {
        rows(HEADER, move |sample, time_s, x_m| {
            plain(sample, time_s, x_m.map(|x_m| x_m * scale))
        })
    };
    let unseen = |cells: &'static [bool; 2]| {
        rows(HEADER, move |_, time_s, x_m| {
            let field = |cell: usize| {
                if cells[cell] {
                    String::new()
                } else {
                    x_m[cell].to_string()
                }
            };
            format!("{time_s},{},{}", field(0), field(1))
        })
    };
    let cells = |count: usize| {
        let header: Vec<String> = (1..=count).map(|cell| format!("x{cell}_m")).collect();
        format!("time_s,{}\n0,0\n", header.join(","))
    };
    let gap = rows(HEADER, |sample, time_s, x_m| match sample {
        10..15 => format!("{time_s},{},nan", x_m[0]),
        _ => plain(sample, time_s, x_m),
    });
    let late = rows(HEADER, |sample, time_s, x_m| match sample {
        0..5 => format!("{time_s},,{}", x_m[1]),
        _ => plain(sample, time_s, x_m),
    });
    let hole = rows(HEADER, |sample, time_s, x_m| {
        plain(sample, time_s + if sample > 20 { 1.0 } else { 0.0 }, x_m)
    });
    let phase = rows("time_s,x1_m,x2_m,gait_phase", |sample, time_s, x_m| {
        let phase = if (5..20).contains(&sample) {
            "nan".to_owned()
        } else {
            time_s.to_string()
        };
        format!("{},{phase}", plain(sample, time_s, x_m))
    });
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let noise_m: Vec<f64> = (0..80)
        .map(|_| StandardNormal.sample(&mut rng))
        .map(|noise: f64| noise * 1e-3)
        .collect();
    let still = rows(HEADER, |sample, time_s, _| {
        plain(sample, time_s, [0.04 + noise_m[sample], noise_m[sample + 40]])
    });
    let table: &[(&str, String, &[&str])] = &[
        ("empty", String::new(), &["is empty", "CSV"]),
        ("comments only", "# nothing\n".to_owned(), &["nothing but comments"]),
        ("header only", format!("{HEADER}\n"), &["0 samples", "10"]),
        ("few samples", format!("{HEADER}\n0,0,0\n1,1,1\n"), &["2 samples", "10"]),
        (
            "no time",
            "t,x1_m,x2_m\n0,0,0\n".to_owned(),
            &["line 1", "time_s", "t, x1_m"],
        ),
        (
            "no cells",
            "time_s,a,b\n0,0,0\n".to_owned(),
            &["line 1", "x1_m", "time_s, a, b"],
        ),
        (
            "one cell",
            "time_s,x1_m\n0,0\n".to_owned(),
            &["only one cell", "2 cells"],
        ),
        (
            "missing cell",
            "time_s,x1_m,x2_m,x4_m\n".to_owned(),
            &["x3_m is missing", "x4_m"],
        ),
        ("cells from 2", "time_s,x2_m,x3_m\n".to_owned(), &["x1_m is missing"]),
        ("many cells", cells(17), &["17 cells", "16"]),
        (
            "twice",
            "time_s,x1_m,x2_m,x1_m\n".to_owned(),
            &["line 1, column 4", "x1_m appears twice", "column 2"],
        ),
        (
            "millimetres named",
            "time_s,x1_mm,x2_mm\n".to_owned(),
            &["column 2", "x1_mm", "millimetres", "x1_m,"],
        ),
        (
            "no unit named",
            "time_s,x1,x2\n".to_owned(),
            &["column 2", "no unit", "metres"],
        ),
        (
            "no header",
            "0.0,0.1,0.2\n".to_owned(),
            &["line 1", "header", "time_s,x1_m"],
        ),
        (
            "semicolons",
            rows("time_s;x1_m;x2_m", plain).replace(',', ";"),
            &["line 1", "semicolons"],
        ),
        (
            "decimal commas",
            with_row(3, "0,3,0,04,0,01"),
            &["line 5, column 4", "more fields", "point"],
        ),
        (
            "no number",
            with_row(3, "0.3,0.04,left"),
            &["line 5, column 3 (x2_m)", "\"left\" is not a number"],
        ),
        (
            "not text",
            with_row(3, "0.3,\u{1b}[31mred,0"),
            &["line 5, column 2 (x1_m)", "[31mred"],
        ),
        (
            "short row",
            with_row(3, "0.3,0.04"),
            &["line 5, column 3 (x2_m)", "2 of 3 fields"],
        ),
        (
            "infinite",
            with_row(3, "0.3,inf,0"),
            &["line 5, column 2 (x1_m)", "inf"],
        ),
        (
            "too large",
            with_row(3, "0.3,1e999,0"),
            &["line 5, column 2 (x1_m)", "inf"],
        ),
        (
            "no time in a row",
            with_row(3, "nan,0.04,0"),
            &["line 5, column 1 (time_s)", "no time"],
        ),
        (
            "time back",
            with_row(3, "0.15,0.04,0"),
            &["line 5, column 1", "goes back", "0.15 s after 0.2 s"],
        ),
        (
            "time stands",
            with_row(3, "0.2,0.04,0"),
            &["line 5, column 1", "repeats", "0.2 s after 0.2 s"],
        ),
        ("never seen", unseen(&[true, true]), &["no cell is ever seen", "--from"]),
        (
            "one never seen",
            unseen(&[false, true]),
            &["cell 2 (x2_m) is never seen"],
        ),
        (
            "gap",
            gap,
            &["cell 2 (x2_m)", "0.900 s to 1.500 s", "--max-gap", "--from"],
        ),
        ("late", late, &["cell 1 (x1_m)", "0.000 s to 0.500 s", "--from"]),
        ("hole", hole, &["no sample from 2.000 s to 3.100 s", "--max-gap"]),
        ("phase lost", phase, &["gait_phase", "0.500 s to 1.900 s", "--from"]),
        ("still", still, &["no cell moves"]),
        ("constant", scaled(0.0), &["no cell moves"]),
        ("in millimetres", scaled(1000.0), &["apart", "millimetres", "1000"]),
        ("a picture", "\u{89}PNG\r\n\0\0".to_owned(), &["neither text", "C3D"]),
    ];
    let folder = Folder::new();
    for (name, text, words) in table {
        let file = format!("{name}.csv");
        let error = folder
            .open(&file, text)
            .err()
            .unwrap_or_else(|| panic!("{name} was taken"));
        assert_says(&error, words, name);
        assert_says(&error, &[&file], name);
    }
    let error = open(
        &folder.write("there", "").with_file_name("not there"),
        &OpenOptions::default(),
    );
    assert_says(
        &error.expect_err("no such file"),
        &["not there", "existing"],
        "missing file",
    );
}

#[test]
fn what_is_harmless_is_tolerated_and_told() {
    let folder = Folder::new();
    let expected = folder
        .open("plain.csv", rows(HEADER, plain))
        .expect("a plain recording");
    assert_eq!(expected.warnings, [""; 0]);
    assert_eq!((expected.cells(), expected.samples()), (2, 40));
    let swapped = rows(" x2_m , time_s,note,x1_m", |sample, time_s, [x1_m, x2_m]| {
        format!("{x2_m}, {time_s} ,\"a, b {sample}\",{x1_m}")
    });
    let commented = rows("# first\n\n\"time_s\",x1_m,x2_m", plain).replace("\n1,", "\n# in between\n\n1,");
    let cut_off = format!("{}4.0,0.05", rows(HEADER, plain));
    let cut_in_number = format!("{}4.0,0.05,-", rows(HEADER, plain));
    let table: &[(&str, String, &[&str])] = &[
        ("swapped", swapped, &["column 3 (\"note\") is not known"]),
        ("commented", commented, &[]),
        (
            "mark and carriage returns",
            format!("\u{feff}{}", rows(HEADER, plain).replace('\n', "\r\n")),
            &[],
        ),
        ("cut off", cut_off, &["line 42", "cut off"]),
        ("cut off in a number", cut_in_number, &["line 42", "cut off"]),
        (
            "no last line end",
            rows(HEADER, plain).trim_end().to_owned(),
            &["line 41", "line end"],
        ),
    ];
    for (name, text, words) in table {
        let recording = folder
            .open("variant.csv", text)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(recording.time_s, expected.time_s, "{name}");
        assert_eq!(recording.position_m, expected.position_m, "{name}");
        assert_eq!(
            recording.warnings.len(),
            usize::from(!words.is_empty()),
            "{name}: {:?}",
            recording.warnings
        );
        assert_says(&recording.warnings.join(""), words, name);
    }
}

#[test]
fn errors_count_lines_as_an_editor_does() {
    let folder = Folder::new();
    for end in ["\n", "\r\n"] {
        let text = format!(
            "# one\n\n{}",
            with_row(3, "0.3,oops,0").replacen('\n', "\n# four\n\n", 1)
        )
        .replace('\n', end);
        let line = 1 + text
            .lines()
            .position(|line| line.contains("oops"))
            .expect("the wrong line");
        let error = folder.open("lines.csv", text).expect_err("a wrong line");
        assert_says(&error, &[&format!("line {line}, column 2")], end);
    }
}

#[test]
fn units_are_recognised_from_a_tenth_of_a_millimetre_to_a_metre() {
    let folder = Folder::new();
    for scale in [0.02, 1.0, 25.0] {
        let small = rows(HEADER, |sample, time_s, x_m| {
            plain(sample, time_s, x_m.map(|x_m| x_m * scale))
        });
        folder
            .open("small.csv", small)
            .unwrap_or_else(|error| panic!("{scale}: {error}"));
    }
}

#[test]
fn time_can_be_cut_and_a_long_gap_accepted() {
    let folder = Folder::new();
    let gap = rows(HEADER, |sample, time_s, x_m| match sample {
        10..15 => format!("{time_s},{},", x_m[0]),
        _ => plain(sample, time_s, x_m),
    });
    let path = folder.write("gap.csv", gap);
    let after = OpenOptions {
        from_s: Some(1.5),
        to_s: Some(3.0),
        ..OpenOptions::default()
    };
    let recording = open(&path, &after).expect("the gap is cut off");
    assert_eq!((recording.time_s[0], recording.samples()), (1.5, 16));
    assert_eq!(recording.position_m[1].len(), 16);
    let patient = OpenOptions {
        max_gap_s: 0.6,
        ..OpenOptions::default()
    };
    let recording = open(&path, &patient).expect("the gap is accepted");
    assert!(
        recording.position_m[1][10..15].iter().all(|x_m| x_m.is_nan()),
        "what was not seen stays so"
    );
    let filled = &recording.filled()[1];
    let (before_m, after_m) = (filled[9], filled[15]);
    assert!(
        (filled[12] - (before_m + after_m) / 2.0).abs() < 1e-12,
        "bridged by a straight line"
    );
    for (options, words) in [
        (
            OpenOptions {
                from_s: Some(3.0),
                to_s: Some(2.0),
                ..OpenOptions::default()
            },
            ["--from 3", "--to 2"],
        ),
        (
            OpenOptions {
                from_s: Some(90.0),
                ..OpenOptions::default()
            },
            ["0 samples", "--from"],
        ),
        (
            OpenOptions {
                max_gap_s: f64::NAN,
                ..OpenOptions::default()
            },
            ["--max-gap NaN", "seconds"],
        ),
    ] {
        assert_says(&open(&path, &options).expect_err("unusable"), &words, "options");
    }
}

#[test]
fn a_short_hole_in_the_phase_is_bridged() {
    let text = rows("time_s,x1_m,x2_m,gait_phase", |sample, time_s, x_m| {
        let phase = if sample == 7 {
            String::new()
        } else {
            (time_s / 2.0).to_string()
        };
        format!("{},{phase}", plain(sample, time_s, x_m))
    });
    let recording = Folder::new().open("phase.csv", text).expect("a short hole");
    let phase = recording.gait_phase.expect("a phase");
    assert!((phase[7] - 0.35).abs() < 1e-12 && phase.len() == 40);
    assert_says(&recording.warnings.join(""), &["gait_phase", "1 samples"], "warning");
}

#[test]
fn progress_runs_from_nothing_to_the_whole() {
    let long = simulated(&Simulation {
        cycles: 20.0,
        ..crawl()
    });
    let mut fractions = Vec::new();
    let path = Folder::new();
    let path = path.write("long.csv", as_csv(&long));
    open_with_progress(&path, &OpenOptions::default(), &mut |fraction| fractions.push(fraction)).expect("a recording");
    assert!(
        fractions.len() > 2 && fractions.is_sorted() && fractions.iter().all(|fraction| (0.0..=1.0).contains(fraction)),
        "{fractions:?}"
    );
}

//! Motion capture: the same worm seen from anywhere gives the same recording.

use super::seen::{Laboratory, PLAIN, Style, as_vicon};
use testkit::recording_files::{Folder, assert_says, crawl, difference, from_start, simulated};
use worm_analysis::experiment::Simulation;
use worm_analysis::recording::{Axis, AxisError, OpenOptions, Recording, open};

fn truth() -> Recording {
    simulated(&Simulation {
        positions_only: true,
        dropout_share: 0.02,
        ..crawl()
    })
}

#[test]
fn vicon_files_of_all_kinds_give_the_same_worm() {
    let truth = truth();
    let metres = Style {
        unit: "m",
        per_metre: 1.0,
        ..PLAIN
    };
    let table: &[(&str, Laboratory, Style)] = &[
        ("plain", Laboratory::along_x(), PLAIN),
        ("askew", Laboratory::askew(0.7, 0.35), PLAIN),
        ("towards minus y", Laboratory::askew(-1.57, 0.0), PLAIN),
        ("down the hall", Laboratory::askew(3.0, -0.2), metres),
        (
            "centimetres",
            Laboratory::along_x(),
            Style {
                unit: "cm",
                per_metre: 100.0,
                ..PLAIN
            },
        ),
        (
            "semicolons",
            Laboratory::askew(0.7, 0.35),
            Style {
                semicolons: true,
                ..PLAIN
            },
        ),
        (
            "sections",
            Laboratory::askew(0.7, 0.35),
            Style {
                other_sections: true,
                ..PLAIN
            },
        ),
    ];
    let folder = Folder::new();
    for &(name, laboratory, style) in table {
        let recording = folder
            .open("nexus.csv", as_vicon(&truth, laboratory, style))
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(
            recording.cell_names,
            ["Worm:c1", "Worm:c2", "Worm:c3", "Worm:c4"],
            "{name}"
        );
        assert!(difference(&recording.time_s, &truth.time_s) < 1e-9, "{name}");
        let seen = truth
            .position_m
            .iter()
            .position(|series| !series[0].is_nan())
            .expect("a cell seen at once");
        for (cell, (read_m, true_m)) in recording.position_m.iter().zip(&truth.position_m).enumerate() {
            // One origin for all cells: their distances must be right as well.
            let shift_m = truth.position_m[seen][0] - recording.position_m[seen][0];
            let shifted_m: Vec<f64> = read_m.iter().map(|read_m| read_m + shift_m).collect();
            let error_m = difference(&shifted_m, true_m);
            assert!(error_m < 3e-4, "{name}, cell {}: {error_m} m", cell + 1);
        }
        let warnings = recording.warnings.join("\n");
        assert_says(&warnings, &["Wall", "Lost is never seen", "1 Worm:c1, 2 Worm:c2"], name);
    }
}

#[test]
fn an_axis_that_is_given_is_exact() {
    let truth = truth();
    let folder = Folder::new();
    let laboratory = Laboratory::askew(0.7, 0.35);
    let path = folder.write("nexus.csv", as_vicon(&truth, laboratory, PLAIN));
    for (sign, names) in [(2.0, ["Worm:c1", "Worm:c4"]), (-1.0, ["Worm:c4", "Worm:c1"])] {
        let axis = Axis::new(laboratory.axis.map(|part| part * sign));
        let recording = open(
            &path,
            &OpenOptions {
                axis,
                ..OpenOptions::default()
            },
        )
        .expect("with an axis");
        assert_eq!(
            [&recording.cell_names[0], &recording.cell_names[3]],
            names,
            "up is where the axis points"
        );
        let cell = if sign > 0.0 { 1 } else { 2 };
        let (read_m, true_m) = (
            from_start(&recording.position_m[cell]),
            from_start(&truth.position_m[1]),
        );
        let read_m: Vec<f64> = read_m.iter().map(|read_m| read_m * sign.signum()).collect();
        assert!(difference(&read_m, &true_m) < 1e-9);
    }
    for (text, expected) in [
        ("-y", Some([0.0, -1.0, 0.0])),
        ("0, 3e300,0", Some([0.0, 1.0, 0.0])),
        ("w", None),
        ("0,0,0", None),
        ("1,2", None),
        ("1,nan,0", None),
    ] {
        let axis: Result<Axis, AxisError> = text.parse();
        assert_eq!(axis.ok(), expected.and_then(Axis::new), "{text}");
    }
}

#[test]
fn ambiguous_vicon_files_are_refused() {
    let good = as_vicon(&truth(), Laboratory::askew(0.7, 0.35), PLAIN);
    let lines: Vec<&str> = good.lines().collect();
    let with_line = |number: usize, line: &str| {
        let mut lines = lines.clone();
        lines[number - 1] = line;
        lines.join("\n") + "\n"
    };
    let without_line = |number: usize| {
        let mut lines = lines.clone();
        lines.remove(number - 1);
        lines.join("\n") + "\n"
    };
    let lost = {
        let blank = |line: &&str| {
            let mut fields: Vec<&str> = line.split(',').collect();
            fields[5..8].fill("");
            fields.join(",")
        };
        let text: Vec<String> = lines
            .iter()
            .enumerate()
            .map(|(index, line)| {
                if (100..130).contains(&index) {
                    blank(line)
                } else {
                    (*line).to_owned()
                }
            })
            .collect();
        text.join("\n") + "\n"
    };
    let nowhere = {
        // There and back again.
        let back: Vec<String> = lines[5..]
            .iter()
            .rev()
            .zip(lines.len()..)
            .map(|(line, number)| {
                let (_, rest) = line.split_once(',').expect("a frame number");
                format!("{},{rest}", number + 200)
            })
            .collect();
        format!("{good}{}\n", back.join("\n"))
    };
    let circle = {
        let mut text = "Trajectories\n60\n,,a,,,b,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n".to_owned();
        for frame in 1..200 {
            let (sine, cosine) = (f64::from(frame) / 10.0).sin_cos();
            text += &format!(
                "{frame},0,{},{},0,{},{},0\n",
                50.0 * sine,
                50.0 * cosine,
                40.0 + 50.0 * sine,
                50.0 * cosine
            );
        }
        text
    };
    let sections = "Devices\n1200\n,,Force\n".to_owned();
    let table: &[(&str, String, &[&str])] = &[
        ("no trajectories", sections, &["no section Trajectories", "export"]),
        (
            "nothing after the title",
            "Trajectories\n".to_owned(),
            &["line 2", "rate is missing"],
        ),
        ("no rate", without_line(2), &["line 2", "rate"]),
        ("rate 0", with_line(2, "0"), &["line 2", "\"0\" is not a rate"]),
        ("no names", with_line(3, ",,a,,,b"), &["line 3", "6 markers", "name"]),
        (
            "no axes",
            with_line(4, "Frame,Sub Frame,A,B,C"),
            &["line 4", "Frame, Sub Frame, X, Y, Z"],
        ),
        ("no units", without_line(5), &["line 5", "unit"]),
        (
            "inches",
            with_line(5, &lines[4].replace("mm", "in")),
            &["line 5", "mm, cm or m"],
        ),
        (
            "short row",
            with_line(20, "115,0,1,2"),
            &["line 20", "ends before Z of Worm:c3"],
        ),
        (
            "no number",
            with_line(20, &lines[19].replacen(",0,", ",0,left", 1)),
            &["line 20", "X of Worm:c3", "left"],
        ),
        (
            "no frame",
            with_line(20, &format!("x{}", lines[19])),
            &["line 20", "frame number"],
        ),
        (
            "frame back",
            with_line(20, lines[10]),
            &["line 20", "frame 106 comes after frame 114"],
        ),
        ("long gap", lost, &["Worm:c1", "is not seen", "--max-gap"]),
        ("there and back", nowhere, &["too little to determine", "--axis"]),
        ("circle", circle, &["one line", "--axis"]),
    ];
    let folder = Folder::new();
    for (name, text, words) in table {
        let error = folder
            .open("nexus.csv", text)
            .err()
            .unwrap_or_else(|| panic!("{name} was taken"));
        assert_says(&error, words, name);
        assert_says(&error, &["nexus.csv"], name);
    }
    let cut_off = &good[..good.len() - 40];
    let recording = folder.open("nexus.csv", cut_off).expect("the whole samples are used");
    assert_says(&recording.warnings.join(""), &["cut off"], "cut off");
    assert_eq!(recording.samples(), truth().samples() - 1);
}

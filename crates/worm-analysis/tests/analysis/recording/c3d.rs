//! C3D: a real file of `ezc3d`, a second reader's opinion on it, and damage of every kind.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::os::unix::fs::FileExt;
use std::path::Path;
use testkit::recording_files::{Folder, assert_says, difference, from_start};
use worm_analysis::recording::{OpenOptions, Recording, open};

/// Made by `tests/data/make_c3d.py` from `tests/data/worm.csv`.
const REAL: &[u8] = include_bytes!("../../data/worm.c3d");

fn data(name: &str) -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
    open(&path, &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_real_file_tells_what_the_table_tells_that_it_was_made_from() {
    let (capture, table) = (data("worm.c3d"), data("worm.csv"));
    assert_eq!(capture.cell_names, ["Worm:c1", "Worm:c2", "Worm:c3", "Worm:c4"]);
    assert!(difference(&capture.time_s, &table.time_s) < 1e-9);
    let mut expected_m = table.position_m;
    expected_m[1][5] = f64::NAN;
    for (read_m, expected_m) in capture.position_m.iter().zip(&expected_m) {
        // Single precision, millimetres, 0.4 m from the origin.
        assert!(difference(&from_start(read_m), &from_start(expected_m)) < 1e-6);
    }
    let spacing_m = capture.position_m[0][0] - capture.position_m[3][0];
    assert!((spacing_m - 0.12).abs() < 1e-6, "{spacing_m}");
    assert_says(
        &capture.warnings.join("\n"),
        &["Wall", "Lost is never seen"],
        "worm.c3d",
    );
}

#[test]
fn another_reader_sees_the_same_points() {
    let theirs = c3dio::C3d::from_bytes(REAL).expect("a whole file");
    let ours = data("worm.c3d");
    let column = |name: &str| {
        theirs
            .points
            .labels
            .iter()
            .position(|label| label == name)
            .expect("the marker")
    };
    let (front, rear) = (column("Worm:c1"), column("Worm:c4"));
    for (sample, (front_m, rear_m)) in ours.position_m[0].iter().zip(&ours.position_m[3]).enumerate() {
        let [front, rear] = [front, rear].map(|column| theirs.points.points[sample][column].point.map(f64::from));
        let distance_m = (0..3)
            .map(|axis| (front[axis] - rear[axis]) * 1e-3)
            .map(|part_m| part_m * part_m)
            .sum::<f64>()
            .sqrt();
        // The markers sit up to 4 mm aside, differently, which lengthens the distance between them a little.
        assert!((front_m - rear_m - distance_m).abs() < 2e-4, "sample {sample}");
    }
    assert_eq!(f64::from(theirs.points.frame_rate), 10.0);
}

#[test]
fn a_file_cut_off_anywhere_is_refused_or_whole() {
    let folder = Folder::new();
    let whole = folder.open("whole.c3d", REAL).expect("a whole file");
    let path = folder.write("cut.c3d", REAL);
    let file = std::fs::File::options()
        .write(true)
        .open(&path)
        .expect("the file is there");
    for length in (0..REAL.len()).rev() {
        file.set_len(length as u64).expect("a file can be cut");
        match open(&path, &OpenOptions::default()) {
            Ok(recording) => assert_eq!(
                recording.position_m[0], whole.position_m[0],
                "only padding may be missing, at {length}"
            ),
            Err(error) => assert_says(&error, &["cut.c3d"], "cut"),
        }
    }
}

#[test]
fn no_damage_makes_the_reader_panic_or_swell() {
    let folder = Folder::new();
    let path = folder.write("damaged.c3d", REAL);
    let file = std::fs::File::options()
        .write(true)
        .open(&path)
        .expect("the file is there");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    for _ in 0..3000 {
        let mut bytes = REAL.to_vec();
        // The header and the parameters are where a reader can be led astray.
        let until = if rng.random_bool(0.8) { 3000 } else { bytes.len() };
        for _ in 0..rng.random_range(1..=4) {
            let at = rng.random_range(0..until);
            bytes[at] = rng.random();
        }
        file.write_all_at(&bytes, 0).expect("a file can be overwritten");
        match open(&path, &OpenOptions::default()) {
            Ok(recording) => assert!(recording.samples() * recording.cells() * 8 <= REAL.len() * 4),
            Err(error) => assert_says(&error, &["damaged.c3d"], "damaged"),
        }
    }
}

#[test]
fn a_file_longer_than_its_counters_is_read_to_its_end() {
    const FRAMES: usize = 70_000;
    let counter = find(b"FRAMES") + 6 + 2;
    assert_eq!(REAL[counter..][..4], [2, 0, 76, 0], "POINT:FRAMES is 76");
    let data = 512 * (usize::from(REAL[16]) - 1);
    let frame = 6 * 16 + 2 * 4;
    let mut bytes = REAL[..data].to_vec();
    bytes[8..10].fill(0xff);
    bytes[counter + 2..counter + 4].fill(0xff);
    for sample in 0..FRAMES {
        bytes.extend(&REAL[data + frame * (sample % 76)..][..frame]);
    }
    bytes.resize(bytes.len().next_multiple_of(512), 0);
    let axis = "x".parse().ok();
    let path = Folder::new();
    let path = path.write("long.c3d", bytes);
    let recording = open(
        &path,
        &OpenOptions {
            axis,
            ..OpenOptions::default()
        },
    )
    .expect("a long file");
    assert_eq!(recording.samples(), FRAMES);
    assert_eq!(
        recording.position_m[2][FRAMES - 1],
        recording.position_m[2][(FRAMES - 1) % 76]
    );
}

fn find(what: &[u8]) -> usize {
    REAL.windows(what.len())
        .position(|window| window == what)
        .expect("it is in the file")
}

#[test]
fn what_the_header_leaves_open_is_refused() {
    let with = |at: usize, new: &[u8]| {
        let mut bytes = REAL.to_vec();
        bytes[at..at + new.len()].copy_from_slice(new);
        bytes
    };
    let rate = find(b"RATE");
    let rate_value = rate + 4 + 2 + 2;
    assert_eq!(
        REAL[rate_value - 2..][..6],
        [4, 0, 0, 0, 0x20, 0x41],
        "POINT:RATE is 10 Hz"
    );
    let unit = find(b"UNITS") + 5;
    let unit = unit
        + REAL[unit..]
            .windows(2)
            .position(|window| window == b"mm")
            .expect("the unit");
    let table: &[(&str, Vec<u8>, &[&str])] = &[
        ("foreign", b"something else altogether".to_vec(), &["not a C3D file"]),
        ("processor", with(512 + 3, &[99]), &["unknown processor, 99"]),
        ("rate", with(rate_value, &[0, 0, 0, 0]), &["0 Hz"]),
        ("unit", with(unit, b"in"), &["POINT:UNITS", "\"in\"", "millimetres"]),
        ("no unit", with(find(b"UNITS"), b"UNIXS"), &["POINT:UNITS", "not given"]),
        ("points", with(2, &[200, 0]), &["200 points", "POINT:USED"]),
        ("data", with(16, &[0, 0]), &["where the data are"]),
        ("frames", with(8, &[50, 0]), &["50 frames", "parameters say 76"]),
    ];
    let folder = Folder::new();
    for (name, bytes, words) in table {
        let error = folder
            .open("odd.c3d", bytes)
            .err()
            .unwrap_or_else(|| panic!("{name} was taken"));
        assert_says(&error, words, name);
    }
}

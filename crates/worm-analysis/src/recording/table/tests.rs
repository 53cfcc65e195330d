//! Numbers, columns and rows at the edges of what CSV allows.

use super::super::text::Text;
use super::{Column, cell_number, column_of, parse_field, quoted, read, unit_problem};
use crate::recording::Recording;
use std::io::Cursor;
use std::path::Path;

fn opened(text: &str) -> Result<Recording, String> {
    let mut ignored = |_| {};
    let text = Text::new(Cursor::new(text.as_bytes()), text.len() as u64, &mut ignored);
    read(Path::new("worm.csv"), text, None).map_err(|error| error.to_string())
}

#[test]
fn a_number_is_read_as_it_was_written() {
    for (text, expected) in [
        ("0", 0.0),
        (" 1.5 ", 1.5),
        ("\t-2e-3", -2e-3),
        ("+3", 3.0),
        (".5", 0.5),
        ("5.", 5.0),
        ("1e-300", 1e-300),
        ("5e-324", 5e-324),
        ("0.1", 0.1),
        ("123456789.123456789", 123_456_789.123_456_79),
        ("inf", f64::INFINITY),
        ("1e999", f64::INFINITY),
    ] {
        assert_eq!(parse_field(text.as_bytes()), Some(expected), "{text:?}");
    }
    assert!(parse_field(b"-0").is_some_and(|zero| zero == 0.0 && zero.is_sign_negative()));
}

#[test]
fn an_empty_field_was_not_seen_and_anything_else_is_no_number() {
    for text in ["", "  ", "nan", "NaN", "-nan"] {
        assert!(parse_field(text.as_bytes()).is_some_and(f64::is_nan), "{text:?}");
    }
    for text in [
        "1,5", "1 2", "0x10", "1_000", "1e", "e5", "--1", "12mm", "−1", "null", "#N/A",
    ] {
        assert_eq!(parse_field(text.as_bytes()), None, "{text:?}");
    }
    assert_eq!(parse_field(b"1\xff"), None, "not UTF-8");
}

#[test]
fn columns_go_by_their_exact_names() {
    for (name, expected) in [
        ("time_s", Column::Time),
        ("gait_phase", Column::Phase),
        ("x1_m", Column::Cell(0)),
        ("x16_m", Column::Cell(15)),
        ("motor_angle_rad", Column::Motor(0)),
        ("bus_voltage_v", Column::Motor(3)),
    ] {
        assert_eq!(column_of(name), expected, "{name}");
    }
    for name in [
        "Time_s",
        "time",
        "x0_m",
        "x01_m",
        "x_m",
        "x1_mm",
        "y1_m",
        "x-1_m",
        "x1_m ",
        "",
        "x99999999999999999999_m",
    ] {
        assert_eq!(column_of(name), Column::Unknown, "{name:?}");
    }
    assert_eq!(cell_number("x12_m"), Some((12, "_m")));
    assert_eq!(cell_number("x12"), Some((12, "")));
    assert_eq!(cell_number("12"), None);
}

#[test]
fn positions_in_other_units_are_recognised() {
    for (name, unit) in [
        ("x1_mm", "millimetres"),
        ("X2 [mm]", "millimetres"),
        ("x1_cm", "centimetres"),
        ("x3_um", "micrometres"),
        ("x1", "no unit"),
    ] {
        let problem = unit_problem(name).unwrap_or_else(|| panic!("{name} was taken"));
        assert!(problem.contains(unit), "{name}: {problem}");
    }
    for name in ["x1_m", "x0_mm", "note", "x1_km"] {
        assert_eq!(unit_problem(name), None, "{name}");
    }
}

#[test]
fn a_quotation_is_short_and_printable() {
    assert_eq!(quoted("abc"), "\"abc\"");
    assert_eq!(quoted(""), "\"\"");
    assert_eq!(quoted("a\u{1b}[31mb"), "\"a[31mb…\"");
    assert_eq!(quoted(&"ü".repeat(32)), format!("\"{}\"", "ü".repeat(32)));
    assert_eq!(quoted(&"ü".repeat(33)), format!("\"{}…\"", "ü".repeat(32)));
}

#[test]
fn columns_may_come_in_any_order_with_comments_between() {
    let text = "# by hand\nx2_m, note ,time_s,x1_m,gait_phase\n0.1,a,0,0.2,0\n# a pause\n,b,1.5,nan,0.25\n";
    let recording = opened(text).expect("a recording");
    assert_eq!(recording.time_s, [0.0, 1.5]);
    assert_eq!(recording.position_m[0][0], 0.2);
    assert_eq!(recording.position_m[1][0], 0.1);
    assert!(recording.position_m[0][1].is_nan() && recording.position_m[1][1].is_nan());
    assert_eq!(recording.gait_phase, Some(vec![0.0, 0.25]));
    assert_eq!(recording.motor, None);
    assert_eq!(recording.warnings, ["column 2 (\"note\") is not known and not used"]);
}

#[test]
fn motor_columns_that_are_missing_are_not_known() {
    let recording = opened("time_s,x1_m,x2_m,motor_current_a\n0,0,0,0.2\n1,0,0,\n").expect("a recording");
    let motor = recording.motor.expect("a motor");
    assert_eq!(motor.current_a[0], 0.2);
    assert!(motor.current_a[1].is_nan());
    for series in [&motor.angle_rad, &motor.velocity_rad_s, &motor.voltage_v] {
        assert!(
            series.len() == 2 && series.iter().all(|value| value.is_nan()),
            "{series:?}"
        );
    }
}

#[test]
fn errors_name_line_and_column() {
    let header = "time_s,x1_m,x2_m\n";
    let rows = |rows: &str| format!("{header}{rows}");
    let table = [
        (
            rows("0,0,0\n1,zero,0\n2,0,0\n"),
            "line 3, column 2 (x1_m): \"zero\" is not a number",
        ),
        (
            rows("# comment\n0,0,inf\n1,0,0\n"),
            "line 3, column 3 (x2_m): inf is not a measurement",
        ),
        (
            rows("0,0\n1,0,0\n"),
            "line 2, column 3 (x2_m): the row ends after 2 of 3 fields",
        ),
        (
            rows("0,1,5,0\n1,0,0\n"),
            "line 2, column 4: the row has more fields than the header, such as \"0\"",
        ),
        (
            rows("0,0,0\n0,0,0\n1,0,0\n"),
            "line 3, column 1 (time_s): time repeats: 0 s after 0 s",
        ),
        (
            rows("0,0,0\n-1,0,0\n1,0,0\n"),
            "line 3, column 1 (time_s): time goes back: -1 s after 0 s",
        ),
        (rows("nan,0,0\n1,0,0\n"), "line 2, column 1 (time_s): there is no time"),
        (
            "time_s;x1_m;x2_m\n".to_owned(),
            "line 1: the columns are separated by semicolons or tabs",
        ),
        ("0,1,2\n".to_owned(), "line 1: the header row is missing"),
        (
            "time_s,x1_m,x3_m\n".to_owned(),
            "line 1: x2_m is missing, but there is x3_m",
        ),
        ("time_s,x1_m\n".to_owned(), "line 1: there is only one cell"),
        (
            "time_s,x1_m,x2_m,x1_m\n".to_owned(),
            "line 1, column 4: x1_m appears twice, first as column 2",
        ),
        ("# nothing\n".to_owned(), "worm.csv: holds nothing but comments"),
    ];
    for (text, expected) in table {
        let error = opened(&text).expect_err(expected);
        assert!(error.contains(expected), "{error}\nshould say: {expected}");
    }
}

#[test]
fn a_truncated_last_line_is_left_out_and_one_in_the_middle_refused() {
    let cut = opened("time_s,x1_m,x2_m\n0,0,0\n1,0,0\n2,0.").expect("the whole samples");
    assert_eq!(cut.time_s, [0.0, 1.0]);
    assert!(
        cut.warnings[0].starts_with("line 4: the file is cut off"),
        "{:?}",
        cut.warnings
    );
    // Whole, but without a line end: 0.02 may have been 0.025.
    let open_end = opened("time_s,x1_m,x2_m\n0,0,0\n1,0,0.02").expect("a recording");
    assert_eq!(open_end.time_s, [0.0, 1.0]);
    assert!(
        open_end.warnings[0].contains("ends without a line end"),
        "{:?}",
        open_end.warnings
    );
    // A bad number in a last line that has its end is a mistake and not a truncation.
    assert!(opened("time_s,x1_m,x2_m\n0,0,0\n1,0,bad\n").is_err());
}

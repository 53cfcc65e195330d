//! The page of `wormd explain`: every verdict reads well, and missing or absurd values do no harm.

use super::answer;
use std::collections::HashSet;
use std::fs;
use testkit::html;
use worm_analysis::explain::Answer;
use worm_analysis::report::ReportError;
use worm_analysis::report::explain::{page, text, write};

fn page_of(answer: &Answer) -> String {
    page(answer, "hidden worm").expect("a page")
}

/// Answers with values that no search should give, and parts that do not fit together.
fn odd_answers() -> Vec<(&'static str, Answer)> {
    let mut absurd = answer::explained(4);
    absurd.threshold = f64::INFINITY;
    absurd.effects[0].parameters[0].value = f64::NAN;
    absurd.effects[0].closure = f64::NEG_INFINITY;
    absurd.effects[0].cell = Some(0);
    absurd.effects[0].name = "no-such-effect".to_owned();
    absurd.stages[1].held_out_rms_m = f64::NAN;
    absurd.stages[0].held_out_rms_m = 1e300;
    absurd.screening[0].improvement = Some(f64::NAN);
    absurd.screening[1].score = -3.0;
    absurd.calibration[0].nominal = f64::NAN;
    absurd.figures.maps_before[0].residual_m[1][3] = f64::INFINITY;
    absurd.figures.maps_before[0].significance.truncate(2);
    absurd.figures.maps_before[1].residual_m[2].truncate(5);
    absurd.figures.maps_before[2].stepping_cell[7] = usize::MAX;
    absurd.figures.maps_after.truncate(1);
    absurd.figures.cycles[0].measured_m[10] = f64::NAN;
    absurd.figures.cycles[1].scatter_m.clear();
    absurd.figures.cycles[2].named_m.truncate(3);
    let mut alike = answer::explained(4);
    alike.figures.maps_before.iter_mut().for_each(|map| {
        map.residual_m.iter_mut().for_each(|row| row.fill(0.0));
        map.phase.truncate(1);
    });
    vec![
        ("absurd values", absurd),
        ("a map of zeros with one bin", alike),
        ("two cells", answer::explained(2)),
        ("sixteen cells", answer::explained(16)),
    ]
}

fn verdicts() -> Vec<(&'static str, Answer)> {
    vec![
        ("explained", answer::explained(4)),
        ("pair", answer::pair()),
        ("ambiguous", answer::ambiguous()),
        ("outside", answer::outside()),
        ("agrees", answer::agrees()),
        ("empty", answer::empty()),
    ]
}

#[test]
fn every_page_is_well_formed_self_contained_and_free_of_nonsense() {
    for (name, answer) in verdicts().into_iter().chain(odd_answers()) {
        let page = page_of(&answer);
        html::assert_well_formed(&page, name);
        let pictures = html::assert_drawn_within(&page, name);
        let expected = if name == "empty" { 0 } else { 8 };
        assert_eq!(
            pictures, expected,
            "{name}: three maps, three cycles, screening and gap"
        );
        for nonsense in [
            "NaN", "null", "None", "Some(", "inf", "://", "src=", "href=", "url(", "<script",
        ] {
            assert!(!page.contains(nonsense), "{name}: the page says {nonsense}");
        }
        assert!(page.len() < 3_000_000, "{name}: {} bytes", page.len());
    }
}

#[test]
fn each_verdict_has_its_own_words() {
    let expected = [
        (
            answer::explained(4),
            [
                "Missing from the model: unequal-clamping of cell 2. One cell is clamped harder or softer",
                "<strong>0.624<small>×</small></strong><em>± 0.025</em>",
                "μᵢNᵢ = f · μN",
                "<b>No positions can tell it from</b> friction-coefficient of that cell",
                "<b>What would:</b> pull test of one cell.",
                "<ins>+friction_factor = 0.625</ins>",
                "What to measure: pull test of one cell.",
            ],
        ),
        (
            answer::pair(),
            [
                "pad-creep and slick-patch, which act together",
                "<strong>41.0<small>%</small></strong>",
                "<strong>620<small>ms</small></strong>",
                "<strong>34.0<small>mm</small></strong>",
                "together close 93 % of the gap",
                "the best of another kind, payload and slick-patch, leaves 0.102 mm",
                "No experiment is proposed",
            ],
        ),
        (
            answer::ambiguous(),
            [
                "cannot tell whether it is slope-error, constant-drag or actuator-compliance",
                "<strong>1.120<small>°</small></strong>",
                "<strong>0.1310<small>mm/N</small></strong>",
                "To name one would be a guess",
                "What to change: known extra mass 100 g.",
                "lie 4.6 standard deviations apart: that should settle it",
                "<td>3.112</td>",
            ],
        ),
        (
            answer::outside(),
            [
                "no known effect explains it",
                "No value is given, for no effect is named.",
                "What is left: all cells, while cells 2 and 3 step",
                "62 % of the gap stays open",
                "It comes back every 11.0 mm of the canal.",
                "There is no map below, for no effect is named.",
                "start shifted along the canal by 5 mm",
            ],
        ),
        (
            answer::agrees(),
            [
                "Nothing is missing from the model that these recordings show for sure.",
                "No effect is needed: the best of the library, unequal-clamping of cell 2, improves the fit by 10.4.",
                "one time in a hundred",
                "No place is listed where",
                "No effect is listed as a candidate",
                "nothing is open",
                "1 value at the limit",
            ],
        ),
        (
            answer::empty(),
            [
                "There is no map",
                "There is no figure of the library",
                "There is no mean cycle",
                "There are no stages",
                "lists no quantity that was recalibrated",
                "holds no change to the model",
                "lists no recordings",
            ],
        ),
    ];
    for (answer, parts) in expected {
        let page = page_of(&answer);
        for part in parts {
            assert!(
                page.contains(part),
                "{:?}: the page does not say {part}",
                answer.verdict
            );
        }
    }
    let mut misstated = answer::outside();
    misstated.doubt.misstated_probability = Some(0.6);
    assert!(page_of(&misstated).contains("under other conditions than stated"));
}

/// The words of a page: what is between its tags.
fn words_of(page: &str) -> HashSet<String> {
    let body = page.split_once("<main>").expect("a body").1;
    let texts = body.split('<').filter_map(|tag| Some(tag.split_once('>')?.1));
    let text = texts.collect::<Vec<_>>().join(" ");
    let text = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"");
    text.replace("&amp;", "&")
        .split_whitespace()
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_terminal_says_what_the_page_says_in_the_same_words() {
    for (name, answer) in verdicts().into_iter().chain(odd_answers()) {
        let words = words_of(&page_of(&answer));
        let text = text(&answer);
        for line in text.lines().filter(|line| !line.starts_with('─')) {
            assert_eq!(line, line.trim_end(), "{name}");
            for word in line.split_whitespace() {
                // Only the terminal sets marks after a name, and cuts long tables.
                let plain = word.trim_end_matches([',', '.']);
                let is_known = words.contains(word) || words.contains(plain) || line.trim_start().starts_with('…');
                assert!(is_known, "{name}: the page does not say {word:?} of {line:?}");
            }
        }
        assert!(text.contains(&answer.sentence), "{name}: no sentence in\n{text}");
    }
}

#[test]
fn everything_that_was_found_is_in_the_text() {
    let answer = Answer {
        runs: Vec::new(),
        calibration: answer::calibration()[..2].to_vec(),
        written_back: answer::calibration()[..2].to_vec(),
        threshold: 9.0,
        remainder: answer::outside().remainder,
        ..answer::ambiguous()
    };
    let expected = include_str!("ambiguous.txt");
    assert_eq!(text(&answer), expected.trim_end());
}

#[test]
fn the_map_marks_what_is_significant() {
    let count = |sigma: f64, mark: &str| {
        let mut answer = answer::agrees();
        answer.figures.maps_before.truncate(1);
        let map = &mut answer.figures.maps_before[0];
        map.significance.iter_mut().for_each(|row| row.fill(0.0));
        map.significance[1][4] = sigma;
        let page = page_of(&answer);
        let figure = page.split_once("<figure id=\"map\"").expect("a map").1;
        let figure = figure.split_once("</figure>").expect("an end").0;
        figure.matches(mark).count()
    };
    let marks = |sigma| [count(sigma, "<circle"), count(sigma, "<polygon")];
    assert_eq!([2.9, -3.0, 4.9].map(marks), [[0, 0], [1, 0], [1, 0]]);
    assert_eq!(marks(-5.0), [0, 2], "a diamond with its edge");
}

#[test]
fn what_comes_from_outside_stays_text() {
    let hostile = "</title><script>alert(\"1\")</script>&'\u{0}";
    let mut answer = answer::explained(4);
    answer.sentence = hostile.to_owned();
    answer.runs[0].recording = hostile.to_owned();
    answer.warnings = vec![hostile.to_owned()];
    answer.effects[0].name = hostile.to_owned();
    answer.effects[0].twins = vec![hostile.to_owned()];
    answer.effects[0].separated_by = hostile.to_owned();
    answer.effects[0].parameters[0].name = hostile.to_owned();
    answer.effects[0].parameters[0].unit = hostile.to_owned();
    answer.screening[0].name = hostile.to_owned();
    answer.stages[2].effect = Some(hostile.to_owned());
    answer.figures.model_diff.push(format!("+{hostile}"));
    let page = page(&answer, hostile).expect("a page");
    html::assert_well_formed(&page, "hostile");
    assert!(!page.contains("<script") && !page.contains('\u{0}'));
}

#[test]
fn the_page_replaces_an_older_one_and_nothing_else() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let place = dir.path().join("new/deep");
    write(&answer::agrees(), "first", &place).expect("a page");
    fs::write(place.join("report.json"), "{}").expect("a file");
    let written = write(&answer::ambiguous(), "second", &place).expect("a page again");
    assert_eq!(written, place.join("report.html"));
    let page = fs::read_to_string(&written).expect("a page");
    assert!(page.contains("<h1>second</h1>") && !page.contains("<h1>first"));
    assert_eq!(super::listed(&place), ["report.html", "report.json"]);

    let blocked = write(&answer::agrees(), "", &written).expect_err("a file is no directory");
    assert!(matches!(blocked, ReportError::File { .. }) && blocked.to_string().contains("name a directory"));
}

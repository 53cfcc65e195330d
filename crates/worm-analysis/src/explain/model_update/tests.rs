use super::*;
use crate::explain::answer::{Doubt, Figures, FoundOnset, FoundParameter, NamedEffect, Verdict};

fn calibrated(name: &str, nominal: f64, found: f64, sigma: f64) -> Calibrated {
    Calibrated {
        name: name.to_owned(),
        nominal,
        found,
        sigma,
        unit: "",
        at_limit: false,
    }
}

fn named(name: &str, cell: Option<usize>, parameters: &[(&str, f64, f64, &str)]) -> NamedEffect {
    NamedEffect {
        name: name.to_owned(),
        twins: Vec::new(),
        parameters: parameters
            .iter()
            .map(|&(name, value, sigma, unit)| FoundParameter {
                name: name.to_owned(),
                value,
                sigma,
                unit: unit.to_owned(),
                cell: None,
            })
            .collect(),
        cell,
        together_with: Vec::new(),
        closure: 0.95,
        closure_interval: [0.9, 1.0],
        onset: None,
        margin: 0.2,
        probability: 0.99,
        improvement: 120.0,
        separated_by: "cut the tether".to_owned(),
    }
}

fn answer(verdict: Verdict, calibration: &[Calibrated], effects: &[NamedEffect], rivals: &[NamedEffect]) -> Answer {
    Answer {
        verdict,
        sentence: String::new(),
        effects: effects.to_vec(),
        rivals: rivals.to_vec(),
        r#where: Vec::new(),
        stages: Vec::new(),
        remainder: None,
        law: None,
        next_experiment: None,
        calibration: calibration.to_vec(),
        written_back: calibration.to_vec(),
        screening: Vec::new(),
        threshold: 9.0,
        doubt: Doubt::default(),
        runs: Vec::new(),
        warnings: Vec::new(),
        repairs: Vec::new(),
        figures: Figures::default(),
    }
}

/// Writes into `text`; gives the new file and the configuration that it holds.
fn written(text: &str, answer: &Answer) -> (ModelText, Config) {
    let config = Config::from_toml(text, Path::new("worm.toml")).expect("a configuration");
    let model = model(text, &config, answer).expect("a model");
    let config = Config::from_toml(&model.text, Path::new(FILE)).expect("is accepted");
    (model, config)
}

#[test]
fn recalibrated_values_go_where_the_believed_ones_stood() {
    let friction = calibrated("friction", 1.0, 1.04, 0.002);
    let stiffness = calibrated("stiffness", 1.0, 0.98, 0.003);
    let cell = calibrated("friction of cell 2", 1.0, 0.97, 0.004);
    let of_runs = [
        calibrated("slope of run 1", 0.0, 0.3, 0.1),
        calibrated("clock", 0.0, 1e-3, 1e-4),
    ];
    let table: [(&str, &[Calibrated], &str); 9] = [
        ("[worm]\n", &[], "[worm]\n"),
        ("[worm]\n", &of_runs, "[worm]\n"),
        (
            "",
            std::slice::from_ref(&friction),
            "[worm]\nmax_deformation_m = 0.00182\n",
        ),
        (
            "[worm]\nmax_deformation_m = 0.00175 # as measured\n",
            &[friction.clone(), stiffness],
            "[worm]\nmax_deformation_m = 0.00185714 # as measured\nstiffness_n_per_m = 960.4\n",
        ),
        (
            "[worm]\nmax_deformation_m = 0.00175     # as measured\n# the end\n",
            &[friction.clone(), cell],
            "[worm]\nmax_deformation_m = [0.00182, 0.0017654, 0.00182, 0.00182] # as measured\n# the end\n",
        ),
        (
            "worm = { max_deformation_m = [0.002, 0.0011,  0.00175, 0.00215] }\n",
            std::slice::from_ref(&friction),
            "worm = { max_deformation_m = [0.00208, 0.001144,  0.00182, 0.002236] }\n",
        ),
        (
            "worm.stroke_m = 0.0115  # nominal\n",
            &[calibrated("stroke", 0.0115, 0.011_432_1, 4e-6)],
            "worm.stroke_m = 0.0114321 # nominal\n",
        ),
        (
            "[worm]\nstroke_m = 0.0115\n",
            &[calibrated("stroke", 0.0115, 0.011_500_001, 4e-6)],
            "[worm]\nstroke_m = 0.0115\n",
        ),
        (
            "[worm]\nstiffness_n_per_m = 980.0\nmax_deformation_m = 0.002\n",
            &[calibrated("stiffness of cell 4", 1.0, 1.25, 0.01)],
            "[worm]\nstiffness_n_per_m = [980.0, 980.0, 980.0, 1225.0]\nmax_deformation_m = [0.002, 0.002, 0.002, 0.0016]\n",
        ),
    ];
    for (nominal, calibration, expected) in table {
        let (model, _) = written(nominal, &answer(Verdict::Agrees, calibration, &[], &[]));
        assert_eq!(model.text, expected, "from {nominal:?}");
        assert_eq!(model.diff.is_empty(), nominal == expected);
    }
}

#[test]
fn named_effects_are_added_with_their_twins_and_the_file_stays_as_it_was() {
    let mut drag = named("constant-drag", None, &[("force_n", 0.203_448, 0.012_3, "N")]);
    drag.twins = vec!["directional-friction".to_owned()];
    let clamp = named("unequal-clamping", Some(2), &[("friction_factor", 0.71, f64::NAN, "")]);
    let (model, config) = written(
        Config::COMMENTED,
        &answer(
            Verdict::Explained,
            &[],
            &[drag.clone(), clamp.clone()],
            std::slice::from_ref(&drag),
        ),
    );
    let added = model
        .text
        .strip_prefix(Config::COMMENTED)
        .expect("nothing else is changed");
    assert_eq!(
        added,
        "\n# Found by `wormd explain`; these act together.\n\
         # A constant force holds the worm back, or pushes it. F = const\n\
         # No cell positions can tell it from: directional-friction.\n\
         # What would tell it from its neighbours: cut the tether.\n\
         [[effect]]\nname = \"constant-drag\"\nforce_n = 0.2034 # ± 0.012 N\n\
         \n# One cell is clamped harder or softer than the others, so its friction differs. μᵢNᵢ = f · μN\n\
         # What would tell it from its neighbours: cut the tether.\n\
         [[effect]]\nname = \"unequal-clamping\"\ncell = 2\nfriction_factor = 0.71\n"
    );
    let found: Vec<_> = config
        .effect
        .iter()
        .map(|effect| (effect.name.as_str(), effect.cell))
        .collect();
    assert_eq!(found, [("constant-drag", None), ("unequal-clamping", Some(2))]);

    // Ambiguous: the likeliest stands, the others are there to be taken in.
    let (model, config) = written("[worm]\n", &answer(Verdict::Ambiguous, &[], &[clamp], &[drag]));
    assert_eq!(config.effect.len(), 1);
    let (_, rivals) = model
        .text
        .split_once("decide against these")
        .expect("a sentence on rivals");
    assert!(
        rivals.contains("\n# [[effect]]\n# name = \"constant-drag\"\n# force_n = 0.2034 # ± 0.012 N\n"),
        "{rivals}"
    );
    let taken_in = model
        .text
        .replace("# [[", "[[")
        .replace("# name", "name")
        .replace("# force_n", "force_n");
    assert_eq!(
        Config::from_toml(&taken_in, Path::new(FILE))
            .expect("valid")
            .effect
            .len(),
        2
    );

    // Nothing is named where nothing is believed.
    for verdict in [Verdict::Agrees, Verdict::OutsideLibrary] {
        let effects = [named("constant-drag", None, &[("force_n", 0.2, 0.01, "N")])];
        assert_eq!(
            written("[worm]\n", &answer(verdict, &[], &effects, &[])).0.text,
            "[worm]\n"
        );
    }
}

#[test]
fn what_is_over_is_not_switched_on() {
    let onset = |until_cycle: Option<f64>| FoundOnset {
        cycle: 3.0,
        time_s: 7.5,
        run: Some("run2.csv".to_owned()),
        ends: false,
        until_cycle,
        until_s: until_cycle.map(|cycle| 2.5 * cycle),
    };
    for (until_cycle, comment) in [
        (
            None,
            "# It acts from 3.0 cycles (7.5 s) after the start of run2.csv on.\n",
        ),
        (
            Some(8.0),
            "# It acted from 3.0 to 8.0 cycles (7.5 to 20.0 s) after the start of run2.csv, and is over. To have it act, take the comment \
             signs away.\n",
        ),
    ] {
        let mut drag = named("constant-drag", None, &[("force_n", 0.2, 0.01, "N")]);
        drag.onset = Some(onset(until_cycle));
        let (model, config) = written("", &answer(Verdict::Explained, &[], &[drag], &[]));
        assert!(model.text.contains(comment), "{}", model.text);
        assert_eq!(config.effect.is_empty(), until_cycle.is_some(), "{}", model.text);
        assert_eq!(
            model.text.contains("# [[effect]]\n# name = \"constant-drag\"\n"),
            until_cycle.is_some()
        );
    }
}

#[test]
fn effects_that_are_there_already_stay() {
    let drag = [named("constant-drag", None, &[("force_n", 0.2, 0.01, "N")])];
    let answer = answer(Verdict::Explained, &[], &drag, &[]);
    for (nominal, count) in [
        ("effect = []", 1),
        (
            "effect = [{ name = \"payload\", mass_kg = 0.02 }]\n[worm]\nmass_kg = 0.4",
            2,
        ),
        (
            "[[effect]]\nname = \"payload\"\nmass_kg = 0.02\n[worm]\nmass_kg = 0.4\n# end",
            2,
        ),
    ] {
        let (model, config) = written(nominal, &answer);
        assert_eq!(config.effect.len(), count, "{}", model.text);
        assert_eq!(config.effect[count - 1].name, "constant-drag");
    }
}

#[test]
fn values_keep_the_digits_that_mean_something_and_stay_in_their_range() {
    for (value, sigma, digits) in [
        (0.001_823_456, 1.2e-6, "0.00182346"),
        (0.001_823_456, 1e-3, "0.00182"),
        (1.234_567e-5, 2e-7, "0.000012346"),
        (980.0, f64::NAN, "980.0"),
        (1_234.567_89, 50.0, "1234.6"),
        (0.0, 0.01, "0.0"),
        (-2.0, 0.0, "-2.0"),
    ] {
        assert_eq!(Figure { value, sigma }.digits(), digits);
    }
    let max = worm_physics::effect::named("step-overlap")
        .expect("is there")
        .parameters[0]
        .max;
    let effect = named("step-overlap", None, &[("overlap", max - 1e-9, 0.3, "")]);
    let (_, config) = written("", &answer(Verdict::Explained, &[], &[effect], &[]));
    assert_eq!(config.effect[0].parameters["overlap"], max);
}

#[test]
fn the_difference_shows_the_change_and_its_surroundings() {
    let drag = [named("constant-drag", None, &[("force_n", 0.2, 0.01, "N")])];
    let friction = [calibrated("friction", 1.0, 1.04, 0.002)];
    let (model, _) = written(Config::COMMENTED, &answer(Verdict::Explained, &friction, &drag, &[]));
    assert!(
        model.diff.iter().all(|line| line.starts_with([' ', '-', '+'])),
        "{:?}",
        model.diff
    );
    let count = |mark| model.diff.iter().filter(|line| line.starts_with(mark)).count();
    assert_eq!(
        (count('-'), model.diff.iter().filter(|line| *line == " …").count()),
        (1, 1)
    );
    assert!(
        model
            .diff
            .iter()
            .any(|line| line.starts_with("+max_deformation_m = 0.00182 "))
    );
    assert!(
        model.unified.starts_with("--- believed\n+++ model.toml\n@@ "),
        "{}",
        model.unified
    );
}

#[test]
fn what_cannot_be_written_is_refused() {
    let table = [
        (
            answer(
                Verdict::Agrees,
                &[calibrated("friction of cell 7", 1.0, 1.1, 0.1)],
                &[],
                &[],
            ),
            "`friction of cell 7` was recalibrated, but the worm has cells 1 to 4",
        ),
        (
            answer(Verdict::Agrees, &[calibrated("friction", 0.0, 1.1, 0.1)], &[], &[]),
            "worm.max_deformation_m[1] = inf: must be from",
        ),
        (
            answer(
                Verdict::Explained,
                &[],
                &[named("gremlins", None, &[("force_n", 0.2, 0.1, "N")])],
                &[],
            ),
            "there is no effect `gremlins`",
        ),
    ];
    for (answer, expected) in table {
        let error = model("[worm]\n", &Config::default(), &answer)
            .expect_err(expected)
            .to_string();
        assert!(error.contains(expected), "{error}");
    }
    let agrees = answer(Verdict::Agrees, &[], &[], &[]);
    let error = model("[worm\n", &Config::default(), &agrees)
        .expect_err("no TOML")
        .to_string();
    assert!(error.contains("TOML"), "{error}");
}

#[test]
fn a_law_is_written_as_a_table_and_read_back() {
    use crate::explain::answer::{FoundLaw, LawAxes, LawOver};
    let over = LawOver {
        acts_on: "friction-factor",
        axis: LawAxes::One("place"),
        cell: Some(2),
        period: Some(0.041),
        memory_s: None,
    };
    let one = FoundLaw {
        rivals: Vec::new(),
        sentence: "The friction of cell 2 depends on the place in the canal, repeats every 41.0 mm.".to_owned(),
        grid: LawAxes::One(vec![-0.02, 0.0, 0.0123456]),
        value: vec![1.0, 0.8123456, 1.2],
        band: vec![[0.9, 1.1]; 3],
        formula: Some("1 + 0.2 · sin(2π place / 0.041 m)".to_owned()),
        closure: 0.8,
        closure_interval: [0.7, 0.9],
        improvement: 200.0,
        seen: Vec::new(),
        over,
    };
    let two = FoundLaw {
        over: LawOver {
            acts_on: "contact-force",
            axis: LawAxes::Two(["phase", "slope"]),
            cell: None,
            period: Some(1.0),
            memory_s: None,
        },
        grid: LawAxes::Two([vec![0.0, 0.5], vec![0.0, 20.0, 40.0]]),
        value: vec![0.0, 0.1, 0.2, -0.3, 0.0, 0.5],
        ..one.clone()
    };
    let remembered = FoundLaw {
        over: LawOver {
            axis: LawAxes::One("recent-slide"),
            cell: None,
            period: None,
            memory_s: Some(0.2),
            ..one.over.clone()
        },
        grid: LawAxes::One(vec![0.0, 1e-3, 5e-3]),
        ..one.clone()
    };
    for law in [one, two, remembered] {
        let answer = Answer {
            law: Some(law.clone()),
            ..answer(Verdict::OutsideLibrary, &[], &[], &[])
        };
        let (model, config) = written("[worm]\ncells = 4\n", &answer);
        assert!(model.text.contains(&law.sentence), "{}", model.text);
        let settings = config.effect_settings().expect("it was checked");
        let table = settings[0].table().expect("a table");
        assert_eq!(settings[0].cell().map(|cell| cell + 1), law.over.cell);
        assert_eq!((table.period(), table.memory_s()), (law.over.period, law.over.memory_s));
        let axes: Vec<&str> = table.axes().map(worm_physics::Axis::name).collect();
        assert_eq!(axes, law.over.axis.all().into_iter().copied().collect::<Vec<_>>());
        let values = table.value().iter().zip(&law.value);
        assert!(values.clone().all(|(written, found)| (written - found).abs() < 1e-6));
        assert_eq!(table.grid(0).len(), law.grid.first().len());
    }
}

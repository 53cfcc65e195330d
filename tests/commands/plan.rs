//! `wormd plan`: JSON, page and refusals.

use super::workspace::{Workspace, said, wormd};
use serde_json::Value;

const ROUTE: &str = "length_m,slope_deg\n2,0\n0.5,30\n";

#[test]
fn a_plan_has_the_contracted_fields_and_a_page() {
    let workspace = Workspace::new();
    let (route, out) = (workspace.write("pipe.csv", ROUTE), workspace.path("plan"));
    let arguments = ["--cells", "3,4,5", "--steps", "8", "--json", "--charge", "0.9"];
    let mut command = vec!["plan".into(), "--route".into(), route.into_os_string(), "--out".into()];
    command.push(out.clone().into_os_string());
    command.extend(arguments.map(Into::into));
    let output = wormd(&command);
    assert!(output.status.success(), "{}", said(&output));
    let plan: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let number = |pointer: &str| {
        let value = plan.pointer(pointer).and_then(Value::as_f64);
        value.unwrap_or_else(|| panic!("{pointer} in {plan}"))
    };
    assert_eq!(number("/length_m"), 2.5);
    assert_eq!(number("/search/designs"), 3.0 * 8.0 * 8.0);
    for name in ["configured", "best"] {
        for field in ["energy_j", "time_s", "charge_left_share", "range_m"] {
            let of = |bound: &str| number(&format!("/{name}/{field}/{bound}"));
            assert!(of("low") < of("mean") && of("mean") < of("high"), "{name} {field}");
        }
        assert_eq!(plan[name]["feasible"], true);
        assert_eq!(plan[name]["legs"].as_array().map(Vec::len), Some(2));
    }
    assert!(number("/best/energy_j/mean") < number("/configured/energy_j/mean"));
    let front = plan["search"]["front"].as_array().expect("a list");
    assert!(
        front
            .iter()
            .all(|design| design["step_order"].is_array() && design["energy_j"].is_number())
    );
    assert_eq!(plan["inertia_check"].as_array().map(Vec::len), Some(2));
    let page = std::fs::read_to_string(out.join("plan.html")).expect("a page");
    assert!(page.contains("<svg") && page.contains("Energy against time") && !page.contains("NaN"));
    let file = std::fs::read_to_string(out.join("plan.json")).expect("a file");
    assert_eq!(serde_json::from_str::<Value>(&file).expect("JSON"), plan);
}

#[test]
fn the_text_says_which_leg_fails_and_why() {
    let workspace = Workspace::new();
    let route = workspace.write("steep.csv", "length_m,slope_deg\n1,0\n1,80\n1,0\n");
    let route = route.to_string_lossy();
    let output = wormd(&[
        "plan",
        "--route",
        &*route,
        "--cells",
        "4",
        "--steps",
        "4",
        "--stiffness-factor",
        "1",
    ]);
    assert!(output.status.success(), "{}", said(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    for expected in [
        "fails on leg 2: slides back by",
        "not reached",
        "None of 4 designs makes the trip",
    ] {
        assert!(text.contains(expected), "{expected:?} in {text}");
    }
}

#[test]
fn what_cannot_be_used_is_refused_with_status_2() {
    let workspace = Workspace::new();
    let good = workspace.write("route.csv", ROUTE);
    let bad = workspace.write("bad.csv", "length_m,slope_deg\n1,0\n1,steep\n");
    let (good, bad) = (good.to_string_lossy(), bad.to_string_lossy());
    for (arguments, expected) in [
        (&["--route", "/no/such.csv"][..], "/no/such.csv: "),
        (&["--route", &bad], "bad.csv:3: slope_deg = 'steep': give a number"),
        (
            &["--route", &good, "--charge", "2"],
            "--charge 2: give a share from 0 to 1",
        ),
        (&["--route", &good, "--cells", "40"], "40 cells: a worm has 2 to 16"),
        (&["--route", &good, "--cycle-s", "5:1"], "gait cycles from 5 to 1 s"),
        (&["--route", &good, "--cycle-s", "fast"], "give LOW:HIGH"),
        (&["--route", &good, "--steps", "0"], "0 values of a range"),
    ] {
        let output = wormd(&[&["plan"], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(said(&output).contains(expected), "{expected:?} in {}", said(&output));
    }
}

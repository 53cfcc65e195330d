use super::super::fault_kinds::BLOCKED;
use super::*;
use worm_physics::MAX_CELLS;

fn parse(text: &str) -> Fault {
    text.parse()
        .unwrap_or_else(|error: FaultError| panic!("{text}: {error}"))
}

fn conditions_of(text: &str) -> Conditions {
    let mut conditions = Conditions::default();
    parse(text).apply(&mut conditions);
    conditions
}

#[test]
fn every_kind_changes_what_it_says() {
    assert_eq!(conditions_of("stall").plant.inner_friction_scale, BLOCKED);
    assert_eq!(conditions_of("jam:cell=2").plant.stroke_scale[..3], [1.0, 0.0, 1.0]);
    assert_eq!(
        conditions_of("jam:share=0.5,cell=1").plant.stroke_scale[..2],
        [0.5, 1.0]
    );
    assert_eq!(
        conditions_of("slip:friction=0.4").plant.friction_scale,
        [0.4; MAX_CELLS]
    );
    assert_eq!(
        conditions_of("slip:friction=0.4,cell=2").plant.friction_scale[..3],
        [1.0, 0.4, 1.0]
    );
    assert_eq!(conditions_of("slide:speed=0.01").plant.drag_speed_m_per_s, 0.01);
    assert_eq!(conditions_of("slope:deg=-30").plant.slope_deg, Some(-30.0));
    assert_eq!(conditions_of("drag:force=0.7").plant.drag_n, 0.7);
    assert_eq!(conditions_of("friction-inside:scale=4").plant.inner_friction_scale, 4.0);
    assert_eq!(conditions_of("battery:charge=0.2").plant.battery_charge, Some(0.2));
    let sag = conditions_of("sag:volts=1,ohm=2").plant;
    assert_eq!((sag.supply_drop_v, sag.supply_extra_ohm), (1.0, 2.0));
    assert!(conditions_of("silence:device=servo").wire.servo_silent);
    assert!(conditions_of("silence:device=tracker").wire.tracker_silent);
    assert_eq!(conditions_of("drop:share=0.5").wire.drop_fraction, 0.5);
    assert_eq!(conditions_of("corrupt").wire.corrupt_fraction, 0.05);
    assert_eq!(conditions_of("delay:ms=5").wire.delay_s, 0.005);
    assert!(conditions_of("reboot").servo.unpowered);
    assert_eq!(conditions_of("overheat:ambient=80").plant.heated_to_c, Some(80.0));
    assert_eq!(conditions_of("hardware-error:bits=0x24").servo.hardware_errors, 0x24);
    assert_eq!(conditions_of("blind:cell=3").camera.hidden, 0b100);
    assert_eq!(conditions_of("dropout:share=0.1").camera.dropout_share, Some(0.1));
    assert_eq!(conditions_of("noise:m=0.0005").camera.noise_m, Some(0.0005));
    assert_eq!(conditions_of("wrong-model:number=1190").servo.model_number, Some(1190));
}

/// No row of the table is dead, and the usage it prints can be typed.
#[test]
fn every_usage_in_the_help_is_accepted_and_changes_something() {
    for kind in KINDS {
        let usage = kind.usage().replace("servo|tracker", "servo");
        assert_ne!(conditions_of(&usage), Conditions::default(), "{usage}");
        assert!(Fault::help().contains(&kind.usage()), "{usage}");
    }
}

#[test]
fn refusals_name_what_is_wrong_and_list_what_is_possible() {
    let table = [
        ("", "there is no fault \"\": use one of stall, jam, slip"),
        ("jams", "there is no fault \"jams\": use one of stall, jam, slip"),
        (
            "jam",
            "the fault jam needs cell=…: it has cell: a cell from 1 to 16, or \"all\"; share: from 0 to 1",
        ),
        (
            "jam:cell=0",
            "cell=0 of the fault jam: must be a cell from 1 to 16, or \"all\"",
        ),
        (
            "jam:cell=2,legs=3",
            "\"legs=3\" is no parameter of the fault jam: it has cell",
        ),
        ("jam:2", "\"2\" is no parameter of the fault jam: it has cell"),
        (
            "stall:hard=1",
            "\"hard=1\" is no parameter of the fault stall: it has none",
        ),
        ("drop:share=2", "share=2 of the fault drop: must be from 0 to 1"),
        ("drop:share=nan", "share=nan of the fault drop: must be from 0 to 1"),
        (
            "slope:deg=x",
            "deg=x of the fault slope: must be from -90 to 90 degrees",
        ),
        (
            "silence:device=motor",
            "device=motor of the fault silence: must be one of servo, tracker",
        ),
        (
            "hardware-error:bits=0x100",
            "bits=0x100 of the fault hardware-error: must be a number of 8 bits",
        ),
        ("stall@", "\"@\" is no window: write @START"),
        ("stall@5..3", "\"@5..3\" is no window"),
        ("stall@-1", "\"@-1\" is no window"),
        ("stall@soon", "\"@soon\" is no window"),
    ];
    for (text, expected) in table {
        let error = text.parse::<Fault>().expect_err(text).to_string();
        assert!(
            error.starts_with(expected),
            "for {text:?}\n  expected {expected} …\n  got      {error}"
        );
    }
}

#[test]
fn windows() {
    let holds = |text: &str, process_s: f64, crawl_s: Option<f64>| parse(text).holds(process_s, crawl_s);
    assert!(holds("stall", 0.0, None) && holds("stall", 9.0, Some(4.0)));
    assert!(!holds("stall@2", 9.0, None) && !holds("stall@2", 9.0, Some(1.9)) && holds("stall@2", 9.0, Some(2.0)));
    assert!(holds("stall@2..3", 9.0, Some(2.9)) && !holds("stall@2..3", 9.0, Some(3.0)));
    assert!(holds("stall@..3", 9.0, None) && holds("stall@..3", 9.0, Some(2.9)));
    assert!(!holds("stall@..3", 9.0, Some(3.0)));
    assert!(holds("reboot:off=0.5@2", 9.0, Some(2.4)) && !holds("reboot:off=0.5@2", 9.0, Some(2.5)));
}

#[test]
fn a_fault_that_is_switched_on_counts_from_then_and_is_written_as_it_was_read() {
    let holds = |text: &str, process_s: f64| parse(text).switched_on(100.0).holds(process_s, Some(50.0));
    assert!(holds("stall", 100.0) && holds("stall", 200.0));
    assert!(!holds("stall@2..5", 101.9) && holds("stall@2..5", 102.0) && !holds("stall@2..5", 105.0));
    assert!(holds("reboot:off=0.5", 100.4) && !holds("reboot:off=0.5", 100.5));
    let is_over = |text: &str, process_s: f64| parse(text).switched_on(100.0).is_over(process_s, None);
    assert!(!is_over("stall", 1e6) && !is_over("stall@2..5", 101.0) && is_over("stall@2..5", 105.0));
    for text in [
        "stall",
        "jam:cell=2,share=0.5@3",
        "slip:friction=0.3,cell=all@..4",
        "silence:device=servo@1.5..2",
        "hardware-error:bits=32",
    ] {
        assert_eq!(parse(text).to_string(), text);
    }
}

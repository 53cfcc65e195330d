//! Start-up: what it refuses, corrects and reports.

use dynamixel_bus::packet::DeviceId;
use wormd::link::servo::register;
use wormd::link::{
    FaultInjector, Faults, Finding, LinkSettings, OperationError, Prepared, ReadMode, ReadPlan, StartupError,
    TrackerSettings, WormBus, prepare, tracker,
};

use super::worm::{SERVO, TRACKER, Worm, id};

pub fn settings() -> LinkSettings {
    LinkSettings {
        baud: 1_000_000,
        servo_id: id(SERVO),
        servo_model: 1200,
        tracker: Some(TrackerSettings {
            id: id(TRACKER),
            model: tracker::MODEL,
            cells: 5,
            emergency_stop_mask: None,
            pitch: false,
            may_be_silent: false,
        }),
        read: ReadMode::Auto,
        watchdog_ms: 100,
        current_limit_a: 1.0,
        winding_resistance_ohm: 3.4,
        velocity_limit_rad_s: 10.0,
        temperature_limit_c: 70.0,
        accept_unsafe_watchdog: false,
    }
}

fn prepare_worm(worm: &mut Worm, settings: &LinkSettings) -> (Result<Prepared, StartupError>, Vec<Finding>) {
    let mut findings = Vec::new();
    let prepared = prepare(&mut WormBus::new(worm), settings, &mut findings);
    (prepared, findings)
}

fn said(findings: &[Finding]) -> Vec<String> {
    findings.iter().map(ToString::to_string).collect()
}

#[test]
fn servo_from_the_factory_is_set_up() {
    let mut worm = Worm::new(5);
    let (prepared, findings) = prepare_worm(&mut worm, &settings());
    let prepared = prepared.expect("prepared");
    assert_eq!(
        (
            prepared.plan.read,
            prepared.tracker.map(|tracker| tracker.cells),
            prepared.servo.firmware
        ),
        (ReadPlan::FastBulk, Some(5), 52)
    );
    assert!((prepared.servo_reading.position_rad - std::f64::consts::TAU).abs() < 1e-9);
    assert_eq!(
        said(&findings),
        [
            "the servo waited 500 µs before each answer (corrected: set to 0)",
            "operating mode (register 11) of the servo was 3 (corrected: set to 1)",
            "current limit (register 38) of the servo was 1750 (corrected: set to 1000)",
            "velocity limit (register 44) of the servo was 445 (corrected: set to 417)",
        ]
    );
    let registers = [
        register::STATUS_RETURN_LEVEL,
        register::BUS_WATCHDOG,
        register::TORQUE_ENABLE,
        register::RETURN_DELAY,
        register::GOAL_PWM,
    ];
    // 1 A through 3.4 ohm at 5 V is a duty of 0.680; the winding is warmer than 25 degrees C, but will not stay so.
    assert_eq!(registers.map(|register| worm.servo(register)), [1, 5, 0, 0, 601]);
    assert!((prepared.duty_limit - 601.0 * 0.113e-2).abs() < 1e-9);
    // The second time there is nothing to correct.
    let (prepared, findings) = prepare_worm(&mut worm, &settings());
    assert!(prepared.is_ok());
    assert_eq!(findings, []);
}

#[test]
fn a_tracker_is_looked_for_only_where_there_is_one_and_missed_only_where_it_must_be() {
    let mut worm = Worm::new(5);
    worm.quirks.tracker_silent = true;
    let tracker = settings().tracker;
    let of = |tracker| LinkSettings { tracker, ..settings() };
    let (refused, _) = prepare_worm(&mut worm, &of(tracker));
    let refusal = refused.expect_err("the tracker is needed").to_string();
    assert!(refusal.contains("tracker.present = false"), "{refusal}");

    let (prepared, findings) = prepare_worm(&mut worm, &of(None));
    let prepared = prepared.expect("there is none");
    assert_eq!((prepared.tracker, prepared.plan.tracker), (None, None));
    assert!(findings.iter().all(|finding| finding.corrected), "{findings:?}");

    let may_be_silent = tracker.map(|tracker| TrackerSettings {
        may_be_silent: true,
        ..tracker
    });
    let (prepared, findings) = prepare_worm(&mut worm, &of(may_be_silent));
    let prepared = prepared.expect("it may be silent");
    assert!(prepared.tracker.is_none() && prepared.plan.tracker.is_some());
    let open: Vec<_> = findings.iter().filter(|finding| !finding.corrected).collect();
    assert!(
        matches!(open[..], [finding] if finding.what.contains("does not answer")),
        "{open:?}"
    );
}

#[test]
fn servo_left_alone_by_a_crash_is_brought_to_rest() {
    let mut worm = Worm::new(5);
    worm.set_servo(register::TORQUE_ENABLE, 1);
    worm.set_servo(register::BUS_WATCHDOG, 0xFF);
    worm.set_servo(register::GOAL_VELOCITY, 105);
    worm.set_servo(register::STATUS_RETURN_LEVEL, 0);
    let (prepared, findings) = prepare_worm(&mut worm, &settings());
    assert!(prepared.is_ok_and(|prepared| !prepared.servo_reading.watchdog_latched()));
    assert_eq!(
        said(&findings)[..2],
        [
            "torque was on: an earlier controller ended without an orderly stop (corrected: torque off)",
            "the bus watchdog had stopped the motor: the computer fell silent while torque was on (corrected: cleared)",
        ]
    );
    assert_eq!(worm.servo(register::GOAL_VELOCITY), 0);
}

#[test]
fn settings_of_an_earlier_use_are_put_right() {
    let mut worm = Worm::new(5);
    let spoilt = [
        (register::DRIVE_MODE, 13),
        (register::HOMING_OFFSET, -300i32 as u32),
        (register::PWM_LIMIT, 400),
        (register::STARTUP_CONFIGURATION, 3),
        (register::SHUTDOWN, 1),
        (register::PROFILE_ACCELERATION, 50),
        (register::PROFILE_VELOCITY, 20),
        (register::VELOCITY_I_GAIN, 0),
        (register::VELOCITY_P_GAIN, 9000),
    ];
    for (register, value) in spoilt {
        worm.set_servo(register, value);
    }
    let (prepared, findings) = prepare_worm(&mut worm, &settings());
    assert!(prepared.is_ok());
    let said = said(&findings);
    for expected in [
        "drive mode (register 10) of the servo was 13: it turned in reverse (corrected: set to 0)",
        "homing offset (register 20) of the servo was -300: its positions read -300 counts too high, so look at \
         servo.home_position (corrected: set to 0)",
        "PWM limit (register 36) of the servo was 400 (corrected: set to 885)",
        "startup configuration (register 60) of the servo was 3: torque would have come on with the power (corrected: set to 0)",
        "shutdown (register 63) of the servo was 1: it would have gone on in spite of overheating, shock or overload \
         (corrected: set to 53)",
        "profile acceleration (register 108) of the servo was 50 (corrected: set to 0)",
        "profile velocity (register 112) of the servo was 20 (corrected: set to 0)",
        "velocity I gain (register 76) of the servo was 0: the motor may oscillate or hardly turn with it (corrected: set to 1600)",
        "velocity P gain (register 78) of the servo was 9000: the motor may oscillate or hardly turn with it (corrected: set to 180)",
    ] {
        assert!(said.iter().any(|said| said == expected), "{expected}\n{said:#?}");
    }
    assert_eq!(
        spoilt.map(|(register, _)| worm.servo(register)),
        [0, 0, 885, 0, 53, 0, 0, 1600, 180]
    );
}

#[test]
fn duty_is_limited_by_supply_and_temperature() {
    // (supply in 0.1 V, °C, current limit in A, goal PWM)
    for (voltage, temperature, current_limit_a, goal_pwm) in [
        (50, 25, 1.0, 601),
        (60, 25, 1.0, 501),
        (50, 65, 1.0, 601), // a warm winding cools
        (50, 5, 1.0, 554),
        (50, 25, 0.5, 300),
        (37, 25, 1.75, 885),
        (30, 25, 0.5, 501),
    ] {
        let mut worm = Worm::new(5);
        worm.set_servo(register::PRESENT_INPUT_VOLTAGE, voltage);
        worm.set_servo(register::PRESENT_TEMPERATURE, temperature);
        let settings = LinkSettings {
            current_limit_a,
            ..settings()
        };
        assert!(prepare_worm(&mut worm, &settings).0.is_ok());
        assert_eq!(worm.servo(register::GOAL_PWM), goal_pwm, "{voltage} {temperature}");
    }
}

#[test]
fn read_mode_is_the_fastest_that_both_know() {
    for (no_fast, no_bulk, read) in [
        (false, false, ReadPlan::FastBulk),
        (true, false, ReadPlan::Bulk),
        (true, true, ReadPlan::Separate),
    ] {
        let mut worm = Worm::new(5);
        (worm.quirks.knows_no_fast_bulk, worm.quirks.knows_no_bulk) = (no_fast, no_bulk);
        let (prepared, findings) = prepare_worm(&mut worm, &settings());
        assert_eq!(prepared.map(|prepared| prepared.plan.read), Ok(read));
        let remarked = findings
            .iter()
            .any(|finding| finding.remedy == format!("read mode {read:?}"));
        assert_eq!(remarked, read != ReadPlan::FastBulk);
    }
    let mut worm = Worm::new(5);
    worm.quirks.knows_no_bulk = true;
    let always_bulk = LinkSettings {
        read: ReadMode::Always(ReadPlan::Bulk),
        ..settings()
    };
    assert_eq!(
        prepare_worm(&mut worm, &always_bulk)
            .0
            .expect_err("not readable")
            .to_string(),
        "reading both devices at once brings nothing whole: servo no answer by the deadline, tracker no answer by the \
         deadline; try read mode `separate`"
    );
}

/// As behind a computer that pauses: a device that the broadcast ping finds is asked again, not reported as missing and as there at once.
#[test]
fn a_servo_that_was_late_is_asked_again() {
    let mut worm = Worm::new(5);
    worm.quirks.unheard_pings = 3;
    let (prepared, _) = prepare_worm(&mut worm, &settings());
    assert!(prepared.is_ok(), "{prepared:?}");
    assert_eq!(worm.quirks.unheard_pings, 0);
}

#[test]
fn refusals_say_what_is_wrong_and_what_to_do() {
    type Spoil = fn(&mut Worm, &mut LinkSettings);
    let table: [(Spoil, &str); 9] = [
        (
            |worm, _| worm.set_servo(register::MODEL_NUMBER, 1020),
            "servo (ID 1) is of model 1020, the config says 1200: correct servo.id or servo.model_number",
        ),
        (
            |worm, _| worm.put_tracker(tracker::register::MODEL_NUMBER, 7),
            "tracker (ID 100) is of model 7, the config says 22349: correct tracker.id or tracker.model_number",
        ),
        (
            |worm, _| worm.baud = 57_600,
            "servo answers at 57600 baud, the config says 1000000: set port.baud to 57600, or register 8 of the servo",
        ),
        (
            |_, settings| settings.servo_id = DeviceId::new(2).expect("a valid ID"),
            "servo (ID 2) does not answer at 1000000 baud: check power, cable and the ID in the config; these IDs do: \
             1 (model 1200), 100 (model 22349)",
        ),
        (
            |worm, _| worm.baud = 9,
            "servo (ID 1) does not answer at 1000000 baud: check power, cable and the ID in the config; nobody does",
        ),
        (
            |worm, _| worm.set_servo(register::HARDWARE_ERROR_STATUS, 0b10_0100),
            "the servo reports a hardware error: overheating, overload; remove the cause, then reboot the servo (a reset \
             does so)",
        ),
        (
            |_, settings| {
                settings.tracker = settings.tracker.map(|tracker| TrackerSettings { cells: 6, ..tracker });
            },
            "the tracker tracks 5 cells, the config says 6: correct worm.cells, or set up the tracker",
        ),
        (
            |worm, _| worm.set_servo(register::PRESENT_INPUT_VOLTAGE, 29),
            "the servo reads a supply of 2.9 V, less than 3 V: look at the supply and its cable, and try again",
        ),
        (
            |_, settings| settings.current_limit_a = 70.0,
            "70 is no current limit (register 38) that the servo can hold: correct it in the config",
        ),
    ];
    for (spoil, message) in table {
        let (mut worm, mut settings) = (Worm::new(5), settings());
        spoil(&mut worm, &mut settings);
        let (prepared, _) = prepare_worm(&mut worm, &settings);
        assert_eq!(prepared.expect_err(message).to_string(), message);
    }
}

#[test]
fn setting_that_is_not_kept_is_refused() {
    let mut worm = Worm::new(5);
    worm.quirks.keeps_operating_mode = true;
    let (prepared, _) = prepare_worm(&mut worm, &settings());
    let register = register::OPERATING_MODE;
    let not_kept = OperationError::NotKept {
        id: id(SERVO),
        register,
        wanted: 1,
        found: 3,
    };
    assert_eq!(prepared, Err(StartupError::Operation(not_kept)));
}

#[test]
fn status_level_is_set_though_its_first_answers_get_lost() {
    let lost = Faults {
        silence: 1..10, // after the ping: what brings the motor to rest, and three attempts of a write and a read
        ..Faults::NONE
    };
    let mut bus = WormBus::new(FaultInjector::new(Worm::new(5), lost, 1));
    let prepared = prepare(&mut bus, &settings(), &mut Vec::new());
    assert!(prepared.is_ok(), "{prepared:?}");
}

#[test]
fn firmware_whose_watchdog_does_not_stop_the_motor_is_refused_unless_it_is_accepted() {
    let mut worm = Worm::new(5);
    worm.set_servo(register::FIRMWARE_VERSION, 51);
    worm.set_servo(register::TORQUE_ENABLE, 1);
    let (refused, _) = prepare_worm(&mut worm, &settings());
    assert_eq!(refused, Err(StartupError::UnsafeWatchdog { firmware: 51 }));
    assert_eq!(worm.servo(register::TORQUE_ENABLE), 0, "the motor comes to rest first");
    let accepted = LinkSettings {
        accept_unsafe_watchdog: true,
        ..settings()
    };
    let (prepared, findings) = prepare_worm(&mut worm, &accepted);
    assert!(prepared.is_ok());
    assert!(
        !findings[0].corrected && findings[0].what.contains("firmware 51"),
        "{:?}",
        findings[0]
    );
}

#[test]
fn torque_goes_off_whatever_else_is_refused_or_not_answered() {
    let spinning = || {
        let mut worm = Worm::new(5);
        worm.set_servo(register::TORQUE_ENABLE, 1);
        worm.set_servo(register::GOAL_VELOCITY, 105);
        worm
    };
    // Another servo of the series, and one that answers the ping and nothing else.
    let mut worm = spinning();
    worm.set_servo(register::MODEL_NUMBER, 1020);
    let (refused, _) = prepare_worm(&mut worm, &settings());
    assert!(
        matches!(refused, Err(StartupError::WrongModel { found: 1020, .. })),
        "{refused:?}"
    );
    assert_eq!(worm.servo(register::TORQUE_ENABLE), 0);

    let mut worm = spinning();
    worm.quirks.answers_pings_only = true;
    let (refused, _) = prepare_worm(&mut worm, &settings());
    assert!(matches!(refused, Err(StartupError::Operation(_))), "{refused:?}");
    assert_eq!(worm.servo(register::TORQUE_ENABLE), 0);

    // What is not a servo is not written to.
    let mut worm = spinning();
    worm.set_servo(register::MODEL_NUMBER, tracker::MODEL.into());
    let (refused, _) = prepare_worm(&mut worm, &settings());
    assert!(matches!(refused, Err(StartupError::WrongModel { .. })), "{refused:?}");
    assert_eq!(worm.servo(register::TORQUE_ENABLE), 1);
}

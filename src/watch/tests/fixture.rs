//! A worm as the watcher hears of it, and its picture in a terminal in memory.

use super::super::app::{App, Seat};
use super::super::*;
use crate::relay::connection::read_line;
use crate::relay::source::{Seen, Worm as RelayedWorm};
use crate::relay::wire::{Answer, Driver, Line, Network, Subject, to_bytes};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use worm_estimator::message::{
    Alarm, AlarmKind, Cycle, Estimate, FieldAccess, Inferred, InferredStanding, Mode, Severity, State, Timing,
};
use worm_physics::MAX_CELLS;
use worm_physics::{Motion, Outcome, Worm, steady_cycle};

/// Telemetry of the paper's worm after `phase` gait cycles, by the model.
pub(super) fn received(phase: f64) -> Telemetry {
    let worm = Worm::paper();
    let mut motion = Motion::at_rest(&worm, &[0.12, 0.08, 0.04, 0.0]);
    let mut telemetry = Telemetry::default();
    let Outcome::Steady(steady) = steady_cycle(&worm) else {
        panic!("the paper's worm holds on the level")
    };
    for tick in 0..=100u64 {
        motion.advance_to(&worm, phase * tick as f64 / 100.0).expect("holds");
        telemetry.take_timing(&Timing {
            sequence: tick,
            deadline_ns: 0,
            wake_lateness_ns: 20_000 + 1000 * tick,
            bus_ns: 90_000,
            compute_ns: 400,
            publish_ns: 12_000,
            notify_ns: 0,
            waited_ns: 0,
            stolen_ns: 0,
            overruns: 0,
            period_ns: 1_000_000,
            host_paused_ns: 0,
            host_pauses: 0,
            overrun: 0,
            culprit: 0,
            minor_faults: 0,
            major_faults: 0,
        });
    }
    telemetry.take_state(&State {
        sequence: 100,
        time_ns: (phase * 2.5e9) as u64,
        phase,
        motor_velocity_rad_s: 2.513,
        motor_current_a: 0.155,
        bus_voltage_v: 4.9,
        motor_temperature_c: 31.0,
        mode: Mode::Crawling.code(),
        ..State::unknown(4)
    });
    let of_cells =
        |value: &dyn Fn(usize) -> f64| std::array::from_fn(|cell| if cell < 4 { value(cell) } else { f64::NAN });
    let ledger = motion.ledger();
    telemetry.take_estimate(&Estimate {
        state_sequence: 100,
        time_ns: 0,
        sample: 50,
        states_lost: 0,
        phase,
        position_m: of_cells(&|cell| motion.positions_m()[cell]),
        contact_m: of_cells(&|cell| motion.tip_m(cell)),
        deformation_m: of_cells(&|cell| motion.deformation_m(cell)),
        force_n: of_cells(&|cell| 980.0 * motion.deformation_m(cell)),
        forward_slide_m: ledger.forward_slide_m,
        backward_slide_m: ledger.backward_slide_m,
        power_electrical_w: 0.2,
        energy_electrical_j: 1.0,
        energy_loss_j: ledger.loss_j(),
        max_deformation_m: [0.00175; MAX_CELLS],
        battery_fraction: f64::NAN,
        cell_count: 4,
        sliding_mask: 0b0010,
        armed_mask: 0b1_1100_0001,
        raised_mask: 1 << AlarmKind::JammedCell.code(),
    });
    for index in 0..phase as u64 {
        telemetry.take_cycle(&Cycle {
            index,
            end_ns: 2_500_000_000 * (index + 1),
            duration_s: 2.5,
            host_paused_s: 0.0,
            advance_m: steady.advance_m,
            advance_sigma_m: 2e-5,
            forward_slide_m: [0.0; MAX_CELLS],
            backward_slide_m: [0.0; MAX_CELLS],
            energy_loss_j: steady.energy_loss_j,
            energy_loss_sigma_j: 2e-4,
            energy_actuator_net_j: steady.energy_actuator_net_j,
            energy_actuator_positive_j: steady.energy_actuator_positive_j,
            energy_actuator_sigma_j: 2e-4,
            energy_electrical_j: 0.62,
            energy_copper_j: 0.2,
            energy_friction_inside_j: 0.37,
            energy_electrical_sigma_j: 1e-3,
            cot: 2.46,
            predicted_advance_m: steady.advance_m,
            predicted_energy_loss_j: steady.energy_loss_j,
            predicted_energy_positive_j: steady.energy_actuator_positive_j,
            predicted_forward_slide_m: [0.0; MAX_CELLS],
            predicted_backward_slide_m: [0.0; MAX_CELLS],
            samples: 300,
            cell_count: 4,
            settled: u32::from(index > 0),
            direction: 1,
        });
    }
    telemetry.take_alarm(&alarm(0, 1_000_000_000, 1));
    telemetry.take_alarm(&alarm(1, 3_000_000_000, 0));
    telemetry.take_alarm(&alarm(2, 5_000_000_000, 1));
    telemetry
}

pub(super) fn alarm(sequence: u64, time_ns: u64, raised: u32) -> Alarm {
    Alarm {
        sequence,
        time_ns,
        since_ns: time_ns - 100_000_000,
        value: 0.62,
        threshold: 0.4,
        phase: 1.0,
        kind: AlarmKind::JammedCell.code(),
        severity: Severity::Critical.code(),
        raised,
        cell: 1,
    }
}

pub(super) const NOW_NS: u64 = 20_000_000_000;

/// The screen of a watcher to whom the relay has sent this telemetry.
pub(super) fn screen(seat: Seat, telemetry: &Telemetry, driver: Option<Driver>) -> App {
    screen_over(None, seat, telemetry, driver)
}

/// The same over a network, if there is one.
pub(super) fn screen_over(network: Option<Network>, seat: Seat, telemetry: &Telemetry, driver: Option<Driver>) -> App {
    let subject = Subject {
        name: "worm1".to_owned(),
        cells: 4,
        port: None,
        slope_deg: 0.0,
        backward: false,
        rate_hz: 1000.0,
        step_order: vec![1, 2, 3, 4],
        full_scale_m: 0.00175,
        mass_kg: 0.333,
        cell_spacing_m: 0.04,
    };
    let mut worm = RelayedWorm::new(subject.clone());
    let mut app = App::new(seat, subject);
    let mut send = |line: Line| {
        let bytes = to_bytes(&line).expect("can be written");
        app.take(read_line(&bytes).expect("can be read"), NOW_NS);
    };
    send(Line::Answer(Answer::own(7, None, "hello", "accepted", None)));
    send(Line::Hello(Box::new(worm.hello(NOW_NS))));
    worm.telemetry = telemetry.clone();
    let time_ns = telemetry.state.map_or(NOW_NS, |state| state.time_ns);
    worm.update(time_ns);
    let mut frame = worm.frame(1, time_ns, Seen::default(), 1, driver);
    frame.network = network;
    send(Line::Frame(Box::new(frame)));
    app.note("[control] a line of the log".to_owned());
    app
}

pub(super) fn drawn(width: u16, height: u16, app: &App, now_ns: u64) -> Terminal<TestBackend> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a terminal in memory");
    terminal.draw(|frame| app.draw(frame, now_ns)).expect("paints");
    terminal
}

pub(super) fn painted(width: u16, height: u16, telemetry: &Telemetry) -> String {
    let app = screen(Seat::Up, telemetry, None);
    drawn(width, height, &app, NOW_NS).backend().to_string()
}

/// What the motor's current says of the worm of [`received`].
pub(super) fn inferred() -> Inferred {
    Inferred {
        end_ns: 1,
        friction_n: [1.71; MAX_CELLS],
        friction_sigma_n: [0.06; MAX_CELLS],
        stiffness_n_per_m: [972.0; MAX_CELLS],
        stiffness_sigma_n_per_m: [31.0; MAX_CELLS],
        forward_slide_m: [6.5e-3; MAX_CELLS],
        pull_n: 0.1,
        pull_sigma_n: 0.2,
        advance_m: 6.7e-3,
        advance_sigma_m: 2e-4,
        energy_loss_j: 0.047,
        energy_loss_sigma_j: 0.002,
        phase: 3.0,
        position_m: 0.061,
        position_sigma_m: 0.004,
        cell_count: 4,
        standing: InferredStanding::Fitted.code(),
        ..Inferred::empty()
    }
}

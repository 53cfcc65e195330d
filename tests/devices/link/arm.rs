//! Arming on a line that fails at the wrong moment.

use std::time::Instant;

use wormd::link::servo::{HardwareErrors, register};
use wormd::link::{ArmError, Port, PortError, WormBus, arm, disarm};

use super::startup::settings;
use super::worm::{SERVO, Worm, id};

/// What goes wrong once torque is on.
#[derive(Clone, Copy, PartialEq)]
enum Failure {
    /// Nothing.
    None,
    /// Answers get lost for as long as torque is on.
    AnswersLost,
    /// Nothing passes any more, in either direction.
    LineCut,
}

struct FailingPort {
    worm: Worm,
    failure: Failure,
    is_cut: bool,
}

impl FailingPort {
    fn torque_is_on(&self) -> bool {
        self.worm.servo(register::TORQUE_ENABLE) == 1
    }
}

impl Port for FailingPort {
    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), PortError> {
        if !self.is_cut {
            self.worm.send(bytes, deadline)?;
        }
        self.is_cut |= self.failure == Failure::LineCut && self.torque_is_on();
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], deadline: Instant) -> Result<usize, PortError> {
        if self.is_cut || (self.failure == Failure::AnswersLost && self.torque_is_on()) {
            self.worm.discard_input()?;
            return Ok(0);
        }
        self.worm.receive(into, deadline)
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        self.worm.discard_input()
    }

    fn set_baud_rate(&mut self, baud: u32) -> Result<(), PortError> {
        self.worm.set_baud_rate(baud)
    }
}

#[test]
fn torque_never_stays_on_unreported() {
    for failure in [Failure::None, Failure::AnswersLost, Failure::LineCut] {
        let worm = Worm::new(5);
        let mut bus = WormBus::new(FailingPort {
            worm,
            failure,
            is_cut: false,
        });
        let armed = arm(&mut bus, &settings(), &mut Vec::new());
        let torque_is_on = bus.port().torque_is_on();
        match failure {
            Failure::None => assert!(armed.is_ok() && torque_is_on),
            Failure::AnswersLost => {
                assert!(matches!(armed, Err(ArmError::NotArmed(_))), "{armed:?}");
                assert!(!torque_is_on, "it was switched off again");
            }
            Failure::LineCut => {
                assert!(matches!(armed, Err(ArmError::TorqueUnknown { .. })), "{armed:?}");
                assert!(torque_is_on, "and the error says so");
            }
        }
    }
}

#[test]
fn torque_that_is_off_is_off_though_the_hardware_errors_cannot_be_read() {
    let mut bus = WormBus::new(Worm::new(5));
    arm(&mut bus, &settings(), &mut Vec::new()).expect("torque comes on");
    assert_eq!(disarm(&mut bus, id(SERVO)), Ok(Some(HardwareErrors(0))));
    arm(&mut bus, &settings(), &mut Vec::new()).expect("torque comes on");
    bus.port_mut().quirks.hardware_errors_get_lost = true;
    assert_eq!(disarm(&mut bus, id(SERVO)), Ok(None));
    assert_eq!(bus.port().servo(register::TORQUE_ENABLE), 0);
}

//! What the tests of the devices share: a controller in virtual time.

use super::{Devices, Options};
use crate::link::Register;
use crate::link::servo::register;
use dynamixel_bus::packet::{Decoder, DeviceId, Instruction, InstructionPacket, MAX_PACKET_LEN, Packet, Recipient};
use worm_estimator::config::Config;

/// A controller in virtual time.
pub(super) struct DeviceHarness {
    pub(super) devices: Devices,
    pub(super) now_s: f64,
}

/// The answer of one device: its error byte and its data.
pub(super) type Answer = (u8, Vec<u8>);

pub(super) const SERVO: u8 = 1;
pub(super) const TRACKER: u8 = 100;

pub(super) fn id(id: u8) -> DeviceId {
    DeviceId::new(id).expect("a valid ID")
}

pub(super) fn harness_with(config: &Config, faults: &[&str]) -> DeviceHarness {
    let faults = faults.iter().map(|text| text.parse().expect("a fault")).collect();
    let options = Options {
        faults,
        ..Options::default()
    };
    DeviceHarness {
        devices: Devices::new(config, &options).expect("devices"),
        now_s: 0.0,
    }
}

pub(super) fn harness(faults: &[&str]) -> DeviceHarness {
    harness_with(&Config::default(), faults)
}

impl DeviceHarness {
    /// Sends bytes, and returns what comes back at once.
    pub(super) fn send(&mut self, bytes: &[u8]) -> Vec<u8> {
        self.devices.receive(bytes, self.now_s).expect("a worm");
        let mut answer = Vec::new();
        self.devices.take_due(self.now_s, &mut answer);
        answer
    }

    /// What comes back within 2 ms, in bytes.
    pub(super) fn exchange(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut answer = self.send(bytes);
        for _ in 0..20 {
            self.now_s += 1e-4;
            self.devices.advance_to(self.now_s).expect("a worm");
            self.devices.take_due(self.now_s, &mut answer);
        }
        answer
    }

    pub(super) fn ask(&mut self, recipient: u8, instruction: Instruction<'_>) -> Vec<(u8, Answer)> {
        let packet = InstructionPacket {
            recipient: Recipient::from_wire(recipient).expect("a recipient"),
            instruction,
        };
        let mut out = [0; MAX_PACKET_LEN];
        let len = packet.encode(&mut out).expect("it fits");
        let bytes = self.exchange(&out[..len]);
        statuses(&bytes)
    }

    /// Asks one device, which must give exactly one answer.
    pub(super) fn ask_one(&mut self, recipient: u8, instruction: Instruction<'_>) -> Answer {
        let mut answers = self.ask(recipient, instruction);
        assert_eq!(answers.len(), 1, "{instruction:?}: {answers:?}");
        let (from, answer) = answers.remove(0);
        assert_eq!(from, recipient);
        answer
    }

    pub(super) fn write(&mut self, register: Register, value: i64) -> u8 {
        let bytes = value.to_le_bytes();
        let data = &bytes[..usize::from(register.size)];
        let address = register.address;
        self.ask_one(SERVO, Instruction::Write { address, data }).0
    }

    pub(super) fn read(&mut self, register: Register) -> i64 {
        let (_, data) = self.ask_one(
            SERVO,
            Instruction::Read {
                address: register.address,
                length: register.size,
            },
        );
        let mut bytes = [0; 8];
        bytes[..data.len()].copy_from_slice(&data);
        let unused_bits = 64 - 8 * data.len() as u32;
        i64::from_le_bytes(bytes) << unused_bits >> unused_bits
    }

    /// Velocity mode, torque on, this goal.
    pub(super) fn crawl(&mut self, goal: i64) {
        assert_eq!(self.write(register::OPERATING_MODE, 1), 0);
        assert_eq!(self.write(register::TORQUE_ENABLE, 1), 0);
        assert_eq!(self.write(register::GOAL_VELOCITY, goal), 0);
    }

    pub(super) fn wait(&mut self, seconds: f64) {
        self.now_s += seconds;
        self.devices.advance_to(self.now_s).expect("a worm");
    }
}

pub(super) fn statuses(bytes: &[u8]) -> Vec<(u8, Answer)> {
    let mut decoder = Decoder::new();
    assert_eq!(decoder.push(bytes), bytes.len());
    let mut found = Vec::new();
    while let Some(packet) = decoder.next_packet() {
        if let Ok(Packet::Status(status)) = packet {
            found.push((status.id.get(), (status.flags.to_wire(), status.data.to_vec())));
        }
    }
    found
}

//! A worm in memory: servo and tracker that answer at once, built on the device side of the codec.

use std::collections::VecDeque;
use std::time::Instant;

use dynamixel_bus::packet::{
    Decoder, DeviceId, FastReplyWriter, FastSegment, Instruction, MAX_PACKET_LEN, Packet, ReadSpan, Recipient,
    StatusError, StatusFlags, StatusPacket,
};
use wormd::link::servo::register as servo_register;
use wormd::link::{Port, PortError, Register, TrackerReading, tracker};

pub const SERVO: u8 = 1;
pub const TRACKER: u8 = 100;
const TABLE_LEN: usize = 256;

pub fn id(id: u8) -> DeviceId {
    DeviceId::new(id).expect("a valid ID")
}

/// What this worm does otherwise than a good one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Quirks {
    pub knows_no_fast_bulk: bool,
    pub knows_no_bulk: bool,
    pub tracker_silent: bool,
    pub servo_silent: bool,
    /// So many pings to a single device that follow are not heard.
    pub unheard_pings: u32,
    /// The servo obeys, but only its answers to pings arrive.
    pub answers_pings_only: bool,
    /// The answers in which the servo names its hardware errors do not arrive.
    pub hardware_errors_get_lost: bool,
    /// Answers come only with the request after the one that they are for.
    pub one_late: bool,
    pub unplugged: bool,
    pub keeps_operating_mode: bool,
}

pub struct Worm {
    servo: [u8; TABLE_LEN],
    tracker: [u8; TABLE_LEN],
    pub baud: u32,
    line_baud: u32,
    pub quirks: Quirks,
    decoder: Decoder,
    line: VecDeque<u8>,
    held_back: Vec<u8>,
    pub alert: bool,
}

impl Worm {
    pub fn new(cells: usize) -> Self {
        let mut worm = Self {
            servo: [0; TABLE_LEN],
            tracker: [0; TABLE_LEN],
            baud: 1_000_000,
            line_baud: 1_000_000,
            quirks: Quirks::default(),
            decoder: Decoder::new(),
            line: VecDeque::with_capacity(4096),
            held_back: Vec::with_capacity(4096),
            alert: false,
        };
        worm.set_servo(servo_register::MODEL_NUMBER, 1200);
        worm.set_servo(servo_register::FIRMWARE_VERSION, 52);
        worm.set_servo(servo_register::ID, SERVO.into());
        worm.set_servo(servo_register::RETURN_DELAY, 250);
        worm.set_servo(servo_register::OPERATING_MODE, 3);
        worm.set_servo(servo_register::TEMPERATURE_LIMIT, 70);
        worm.set_servo(servo_register::CURRENT_LIMIT, 1750);
        worm.set_servo(servo_register::VELOCITY_LIMIT, 445);
        worm.set_servo(servo_register::PWM_LIMIT, 885);
        worm.set_servo(servo_register::SHUTDOWN, 53);
        worm.set_servo(servo_register::VELOCITY_I_GAIN, 1600);
        worm.set_servo(servo_register::VELOCITY_P_GAIN, 180);
        worm.set_servo(servo_register::STATUS_RETURN_LEVEL, 2);
        worm.set_servo(servo_register::PRESENT_INPUT_VOLTAGE, 50);
        worm.set_servo(servo_register::PRESENT_TEMPERATURE, 31);
        worm.set_servo(servo_register::PRESENT_POSITION, 4096);
        worm.put_tracker(tracker::register::MODEL_NUMBER, tracker::MODEL.into());
        worm.put_tracker(tracker::register::FIRMWARE_VERSION, 1);
        let mut positions_m = [0.0; worm_physics::MAX_CELLS];
        for (cell, position_m) in positions_m.iter_mut().enumerate().take(cells) {
            *position_m = 0.1 * cell as f64;
        }
        let valid = ((1u32 << cells) - 1) as u16;
        let reading = TrackerReading {
            sample: 0,
            capture_time_us: 0,
            cell_count: cells as u8,
            valid,
            positions_m,
            pitch_rad: None,
        };
        let from = usize::from(tracker::BLOCK_ADDRESS);
        worm.tracker[from..from + tracker::MAX_BLOCK_LEN].copy_from_slice(&reading.to_block());
        worm
    }

    pub fn set_servo(&mut self, register: Register, value: u32) {
        put(&mut self.servo, register, value);
    }

    pub fn put_tracker(&mut self, register: Register, value: u32) {
        put(&mut self.tracker, register, value);
    }

    pub fn servo(&self, register: Register) -> u32 {
        let mut value = [0; 4];
        let from = usize::from(register.address);
        value[..usize::from(register.size)].copy_from_slice(&self.servo[from..from + usize::from(register.size)]);
        u32::from_le_bytes(value)
    }

    /// Puts bytes on the line, there to be received.
    pub fn say_now(&mut self, bytes: &[u8]) {
        self.line.extend(bytes);
    }

    /// Puts bytes on the line in front of the next answer.
    pub fn say_with_next_answer(&mut self, bytes: &[u8]) {
        self.held_back.extend(bytes);
    }

    fn table(&self, of: DeviceId) -> Option<&[u8; TABLE_LEN]> {
        match of.get() {
            SERVO if !self.quirks.servo_silent => Some(&self.servo),
            TRACKER if !self.quirks.tracker_silent => Some(&self.tracker),
            _ => None,
        }
    }

    fn say(&mut self, id: DeviceId, error: Option<StatusError>, data: &[u8]) {
        let flags = StatusFlags {
            alert: self.alert && id.get() == SERVO,
            error,
        };
        let mut out = [0; MAX_PACKET_LEN];
        let len = StatusPacket { id, flags, data }.encode(&mut out).expect("it fits");
        self.line.extend(&out[..len]);
    }

    fn answers(&self, id: DeviceId, level: u32) -> bool {
        let is_heard = !self.quirks.answers_pings_only && self.servo(servo_register::STATUS_RETURN_LEVEL) >= level;
        id.get() == TRACKER || is_heard
    }

    fn ping(&mut self, id: DeviceId) {
        if let Some(table) = self.table(id) {
            let identity = [table[0], table[1], table[6]];
            self.say(id, None, &identity);
        }
    }

    fn read(&mut self, id: DeviceId, address: u16, length: u16) {
        let Some(&table) = self.table(id) else { return };
        let is_lost = self.quirks.hardware_errors_get_lost
            && id.get() == SERVO
            && address == servo_register::HARDWARE_ERROR_STATUS.address;
        if self.answers(id, 1) && !is_lost {
            let from = usize::from(address);
            match table.get(from..from + usize::from(length)) {
                Some(data) => self.say(id, None, data),
                None => self.say(id, Some(StatusError::Access), &[]),
            }
        }
    }

    fn write(&mut self, id: DeviceId, address: u16, data: &[u8]) {
        if self.table(id).is_none() || id.get() != SERVO {
            return;
        }
        let answered = self.answers(id, 2);
        let is = |register: Register| address == register.address;
        let torque_is_on = self.servo(servo_register::TORQUE_ENABLE) == 1;
        let latched = self.servo(servo_register::BUS_WATCHDOG) == 0xFF;
        let error = if address < servo_register::TORQUE_ENABLE.address && torque_is_on {
            Some(StatusError::Access)
        } else if is(servo_register::GOAL_VELOCITY) && latched {
            Some(StatusError::DataRange)
        } else {
            None
        };
        let ignored = is(servo_register::OPERATING_MODE) && self.quirks.keeps_operating_mode;
        if error.is_none() && !ignored {
            self.servo[usize::from(address)..][..data.len()].copy_from_slice(data);
        }
        if answered {
            self.say(id, error, &[]);
        }
    }

    fn fast_bulk(&mut self, spans: &[ReadSpan]) {
        let mut out = [0; MAX_PACKET_LEN];
        let mut writer = FastReplyWriter::new(&mut out, spans.iter().map(|span| span.length)).expect("it fits");
        let mut len = 0;
        for span in spans {
            let Some(table) = self.table(span.id) else {
                break;
            };
            let flags = StatusFlags {
                alert: self.alert && span.id.get() == SERVO,
                error: None,
            };
            let data = &table[usize::from(span.address)..][..usize::from(span.length)];
            writer
                .push(FastSegment {
                    id: span.id,
                    flags,
                    data,
                })
                .expect("as asked");
            len = writer.len();
        }
        self.line.extend(&out[..len]);
    }

    fn obey(&mut self, recipient: Recipient, instruction: Instruction<'_>) {
        match (recipient, instruction) {
            (Recipient::One(_), Instruction::Ping) if self.quirks.unheard_pings > 0 => self.quirks.unheard_pings -= 1,
            (Recipient::One(id), Instruction::Ping) => self.ping(id),
            (Recipient::All, Instruction::Ping) => [SERVO, TRACKER].map(id).into_iter().for_each(|id| self.ping(id)),
            (Recipient::One(id), Instruction::Read { address, length }) => self.read(id, address, length),
            (Recipient::One(id), Instruction::Write { address, data }) => self.write(id, address, data),
            (Recipient::One(_), Instruction::Reboot) => {
                self.set_servo(servo_register::TORQUE_ENABLE, 0);
                self.set_servo(servo_register::STATUS_RETURN_LEVEL, 2);
                self.set_servo(servo_register::HARDWARE_ERROR_STATUS, 0);
                self.alert = false;
            }
            (_, Instruction::SyncRead { address, length, ids }) => {
                ids.iter().for_each(|&of| self.read(id(of), address, length));
            }
            (_, Instruction::BulkRead(spans)) if !self.quirks.knows_no_bulk => {
                spans
                    .iter()
                    .for_each(|span| self.read(span.id, span.address, span.length));
            }
            (_, Instruction::FastBulkRead(spans)) if !self.quirks.knows_no_fast_bulk => {
                let mut list = [ReadSpan {
                    id: id(0),
                    address: 0,
                    length: 0,
                }; 8];
                let mut len = 0;
                for (room, span) in list.iter_mut().zip(spans.iter()) {
                    *room = span;
                    len += 1;
                }
                self.fast_bulk(&list[..len]);
            }
            _ => {}
        }
    }
}

fn put(table: &mut [u8; TABLE_LEN], register: Register, value: u32) {
    let from = usize::from(register.address);
    let size = usize::from(register.size);
    table[from..from + size].copy_from_slice(&value.to_le_bytes()[..size]);
}

impl Port for Worm {
    fn send(&mut self, bytes: &[u8], _: Instant) -> Result<(), PortError> {
        if self.quirks.unplugged {
            return Err(PortError::Disconnected);
        }
        self.line.extend(self.held_back.drain(..));
        let answers_from = self.line.len();
        if self.baud == self.line_baud {
            let mut decoder = std::mem::take(&mut self.decoder);
            decoder.push(bytes);
            while let Some(packet) = decoder.next_packet() {
                if let Ok(Packet::Instruction(packet)) = packet {
                    self.obey(packet.recipient, packet.instruction);
                }
            }
            self.decoder = decoder;
        }
        // The servo reports its goal as its velocity, and the tracker takes its next sample.
        self.set_servo(
            servo_register::PRESENT_VELOCITY,
            self.servo(servo_register::GOAL_VELOCITY),
        );
        let tick = (self.servo(servo_register::REALTIME_TICK) + 4) % 32_768;
        self.set_servo(servo_register::REALTIME_TICK, tick);
        let sample = &mut self.tracker[usize::from(tracker::BLOCK_ADDRESS)];
        *sample = sample.wrapping_add(1);
        if self.quirks.one_late {
            self.held_back.extend(self.line.drain(answers_from..));
        }
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _: Instant) -> Result<usize, PortError> {
        if self.quirks.unplugged {
            return Err(PortError::Disconnected);
        }
        let count = into.len().min(self.line.len());
        for room in &mut into[..count] {
            *room = self.line.pop_front().unwrap_or_default();
        }
        Ok(count)
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        if self.quirks.unplugged {
            return Err(PortError::Disconnected);
        }
        let count = self.line.len();
        self.line.clear();
        Ok(count)
    }

    fn set_baud_rate(&mut self, baud: u32) -> Result<(), PortError> {
        if baud > 3_000_000 {
            return Err(PortError::Os {
                doing: "change its baud rate",
                kind: std::io::ErrorKind::InvalidInput,
            });
        }
        self.line_baud = baud;
        Ok(())
    }
}

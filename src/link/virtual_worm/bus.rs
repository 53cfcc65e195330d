//! What the devices do with what comes along their line: dispatch, order and form of the answers.

use super::body::BodyError;
use super::conditions::Conditions;
use super::fault::Fault;
use super::line::{Line, derived_seed};
use super::options::Options;
use super::plant::{DEFAULT_STEP_S, Plant};
use super::servo::Servo;
use super::tracker::Tracker;
use dynamixel_bus::packet::{
    DecodeError, DeviceId, FastReplyWriter, FastSegment, Instruction, InstructionPacket, MAX_PACKET_LEN,
    MalformedInstruction, Packet, ReadSpan, Recipient, ResetScope, StatusError, StatusFlags, StatusPacket,
};
use worm_estimator::config::Config;
use worm_physics::WormError;

/// Interval at which faults and the servo's supervision are evaluated, s.
const SLICE_S: f64 = 1e-3;

/// Both devices, the machine between them, and the line back to the controller.
#[derive(Debug, Clone)]
pub(super) struct Bus {
    now_s: f64,
    crawl_began_s: Option<f64>,
    faults: Vec<Fault>,
    holding: Vec<bool>,   // one for each fault
    faults_changed: bool, // faults were removed since the last look
    conditions: Conditions,
    plant: Plant,
    servo: Servo,
    has_tracker: bool, // or a device with an inertial sensor alone; else it is not on the bus: it hears and says nothing
    tracker: Tracker,
    line: Line,
}

/// Who on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Device {
    Servo,
    Tracker,
}

impl Bus {
    pub(super) fn new(config: &Config, options: &Options) -> Result<Self, BodyError> {
        let seed = options.seed.unwrap_or(config.virtual_worm.seed);
        let mut bus = Self {
            now_s: 0.0,
            crawl_began_s: None,
            faults: options.faults.clone(),
            holding: vec![false; options.faults.len()],
            faults_changed: false,
            conditions: Conditions::default(),
            plant: Plant::with_step(config, options.seed, options.step_s.unwrap_or(DEFAULT_STEP_S))?,
            servo: Servo::new(config, options.baud, seed),
            has_tracker: config.tracker.present || config.inertial_sensor.is_some(),
            tracker: Tracker::new(config, seed),
            line: Line::new(derived_seed(seed)),
        };
        if let Some(arm) = options.arm {
            bus.plant.carry(arm);
            bus.servo.carry_arm();
        }
        bus.look_at_faults()?;
        Ok(bus)
    }

    pub(super) fn line(&mut self) -> &mut Line {
        &mut self.line
    }

    pub(super) fn next_due_s(&self) -> Option<f64> {
        self.line.next_due_s()
    }

    pub(super) fn baud(&self) -> u32 {
        self.servo.baud()
    }

    pub(super) fn plant(&self) -> &Plant {
        &self.plant
    }

    pub(super) fn crawl_began_s(&self) -> Option<f64> {
        self.crawl_began_s
    }

    /// Adds a fault that counts from now.
    pub(super) fn switch_on(&mut self, fault: Fault) {
        // One whose time is over would be looked at for ever.
        let (now_s, crawl_began_s) = (self.now_s, self.crawl_began_s);
        let is_over = |fault: &Fault| fault.is_over(now_s, crawl_began_s.map(|began_s| now_s - began_s));
        let kept: Vec<bool> = self.faults.iter().map(|fault| !is_over(fault)).collect();
        self.keep(&kept);
        self.faults.push(fault.switched_on(now_s));
        self.holding.push(false);
    }

    /// Ends all faults, or those of a kind.
    pub(super) fn clear_faults(&mut self, kind: Option<&str>) -> usize {
        let kept: Vec<bool> = self
            .faults
            .iter()
            .map(|fault| kind.is_some_and(|kind| kind != fault.name()))
            .collect();
        self.keep(&kept);
        kept.iter().filter(|kept| !**kept).count()
    }

    /// Removes faults; what remains of their effect goes with the next slice.
    fn keep(&mut self, kept: &[bool]) {
        let mut flags = kept.iter();
        self.faults.retain(|_| flags.next().copied().unwrap_or(true));
        let mut flags = kept.iter();
        self.holding.retain(|_| flags.next().copied().unwrap_or(true));
        self.faults_changed = true;
    }

    pub(super) fn faults(&self) -> impl Iterator<Item = (&Fault, bool)> {
        self.faults.iter().zip(self.holding.iter().copied())
    }

    pub(super) fn advance_to(&mut self, now_s: f64) -> Result<(), WormError> {
        while self.now_s < now_s {
            self.now_s = (self.now_s + SLICE_S).min(now_s);
            self.plant.advance_to(self.now_s)?;
            self.look_at_faults()?;
            self.servo.supervise(&mut self.plant, self.now_s);
        }
        Ok(())
    }

    fn look_at_faults(&mut self) -> Result<(), WormError> {
        if self.crawl_began_s.is_none() && self.servo.has_moved() {
            self.crawl_began_s = Some(self.now_s);
        }
        let crawl_s = self.crawl_began_s.map(|began_s| self.now_s - began_s);
        let mut changed = std::mem::take(&mut self.faults_changed);
        for (fault, holding) in self.faults.iter().zip(&mut self.holding) {
            let holds = fault.holds(self.now_s, crawl_s);
            changed |= holds != *holding;
            *holding = holds;
        }
        if !changed {
            return Ok(());
        }
        let mut conditions = Conditions::default();
        for (fault, _) in self.faults.iter().zip(&self.holding).filter(|(_, holding)| **holding) {
            fault.apply(&mut conditions);
        }
        self.plant.set_conditions(&conditions.plant, conditions.camera)?;
        if conditions.servo != self.conditions.servo {
            self.servo.set_conditions(conditions.servo, &mut self.plant, self.now_s);
        }
        self.tracker.set_switches(conditions.switches);
        self.line.set_conditions(conditions.wire);
        self.conditions = conditions;
        Ok(())
    }

    /// Takes whatever came along the line.
    pub(super) fn take(&mut self, packet: Result<Packet<'_>, DecodeError>) {
        match packet {
            Ok(Packet::Instruction(packet)) => {
                self.note_instruction();
                self.obey(&packet);
            }
            Ok(Packet::Status(_) | Packet::FastReply(_)) => {} // an echo
            Err(DecodeError::Crc { id, .. }) => {
                if let Some(device) = DeviceId::new(id).and_then(|id| self.device(id)) {
                    self.answer_error(device, StatusError::Crc);
                }
            }
            Err(DecodeError::Instruction { recipient, error }) => {
                self.note_instruction();
                let error = match error {
                    MalformedInstruction::UnknownCode { .. } => StatusError::Instruction,
                    MalformedInstruction::Parameters { .. } => StatusError::DataLength,
                };
                if let Recipient::One(id) = recipient
                    && let Some(device) = self.device(id)
                {
                    self.answer_error(device, error);
                }
            }
            Err(DecodeError::ReservedId { .. } | DecodeError::EmptyStatus { .. }) => {}
        }
    }

    /// Feeds the servo's bus watchdog, unless nothing reaches the servo.
    fn note_instruction(&mut self) {
        if !self.conditions.wire.servo_silent {
            self.servo.note_instruction(self.now_s);
        }
    }

    /// The device with this ID, if it can receive.
    fn device(&self, id: DeviceId) -> Option<Device> {
        let servo_hears = !self.conditions.wire.servo_silent && self.servo.is_awake(self.now_s);
        let tracker_hears = self.has_tracker && !self.conditions.wire.tracker_silent;
        if servo_hears && self.servo.id() == id {
            Some(Device::Servo)
        } else if tracker_hears && self.tracker.id() == id {
            Some(Device::Tracker)
        } else if servo_hears && self.servo.has_secondary_id(id) {
            Some(Device::Servo)
        } else {
            None
        }
    }

    /// Every device that can receive, by ID.
    fn devices(&self) -> Vec<(DeviceId, Device)> {
        let mut ids = vec![self.servo.id(), self.tracker.id()];
        ids.sort_unstable();
        ids.dedup();
        ids.iter().filter_map(|&id| Some((id, self.device(id)?))).collect()
    }

    fn obey(&mut self, packet: &InstructionPacket<'_>) {
        match (packet.instruction, packet.recipient) {
            (Instruction::SyncRead { address, length, ids }, _) => {
                let spans = spans(ids, address, length);
                self.chain_of_reads(spans);
            }
            (Instruction::BulkRead(spans), _) => self.chain_of_reads(spans.iter()),
            (Instruction::FastSyncRead { address, length, ids }, _) => {
                let spans = spans(ids, address, length);
                self.fast_read(spans);
            }
            (Instruction::FastBulkRead(spans), _) => self.fast_read(spans.iter()),
            (Instruction::SyncWrite { address, writes }, _) => {
                for (id, data) in writes.iter() {
                    self.write_silently(id, address, data);
                }
            }
            (Instruction::BulkWrite(writes), _) => {
                for write in writes.iter() {
                    self.write_silently(write.id, write.address, write.data);
                }
            }
            (instruction, Recipient::One(id)) => {
                if let Some(device) = self.device(id) {
                    self.obey_one(device, instruction);
                }
            }
            (Instruction::Ping, Recipient::All) => {
                let mut at_s = self.now_s;
                for (_, device) in self.devices() {
                    at_s = self.answer_ping(device, at_s);
                }
            }
            (Instruction::FactoryReset(ResetScope::All), Recipient::All) => {}
            (instruction, Recipient::All) => {
                for (_, device) in self.devices() {
                    // A broadcast is not answered, so an error is not reported.
                    let _unanswered = self.change(device, instruction);
                }
            }
        }
    }

    fn write_silently(&mut self, id: DeviceId, address: u16, data: &[u8]) {
        if let Some(device) = self.device(id) {
            // Sync and bulk writes are not answered, so an error is not reported.
            let _unanswered = self.change(device, Instruction::Write { address, data });
        }
    }

    fn obey_one(&mut self, device: Device, instruction: Instruction<'_>) {
        match instruction {
            Instruction::Ping => {
                self.answer_ping(device, self.now_s);
            }
            Instruction::Read { address, length } => {
                if self.status_return_level(device) >= 1 {
                    self.answer_read(device, self.id(device), address, length, self.now_s);
                }
            }
            change => {
                // The servo answers before it restarts: with the level and the alert of before.
                let level = self.status_return_level(device);
                let (id, alert) = (self.id(device), self.alert(device));
                let at_s = self.now_s + self.return_delay_s(device);
                let error = self.change(device, change).err();
                let raised = matches!(change, Instruction::Write { .. }) && self.status_return_level(device) >= 2;
                if level >= 2 || raised {
                    self.put_status(id, StatusFlags { alert, error }, &[], at_s);
                }
            }
        }
    }

    /// Every instruction that changes something and is answered without data.
    fn change(&mut self, device: Device, instruction: Instruction<'_>) -> Result<(), StatusError> {
        let (plant, now_s) = (&mut self.plant, self.now_s);
        match (device, instruction) {
            (Device::Servo, Instruction::Write { address, data }) => self.servo.write(address, data, plant),
            (Device::Servo, Instruction::RegWrite { address, data }) => self.servo.register_write(address, data),
            (Device::Servo, Instruction::Action) => self.servo.action(plant),
            (Device::Servo, Instruction::Reboot) => self.servo.reboot(plant, now_s),
            (Device::Servo, Instruction::FactoryReset(scope)) => self.servo.factory_reset(scope, plant, now_s),
            (Device::Servo, Instruction::ClearMultiTurn) => self.servo.clear_multi_turn(plant),
            (Device::Servo, Instruction::ControlTableBackup(action)) => self.servo.backup(action, plant, now_s),
            (Device::Tracker, Instruction::Write { address, data }) => self.tracker.write(address, data),
            (Device::Tracker, Instruction::RegWrite { address, data }) => self.tracker.register_write(address, data),
            (Device::Tracker, Instruction::Action) => self.tracker.action(),
            (Device::Tracker, Instruction::Reboot) => Ok(()),
            (Device::Tracker, Instruction::FactoryReset(scope)) => self.tracker.factory_reset(scope),
            (_, _) => Err(StatusError::Instruction),
        }
    }

    /// Plain sync and bulk reads: an answer each, until one stays silent.
    fn chain_of_reads(&mut self, spans: impl Iterator<Item = ReadSpan>) {
        let mut at_s = self.now_s;
        for span in spans {
            let answers = self
                .device(span.id)
                .filter(|&device| self.status_return_level(device) >= 1);
            let Some(device) = answers else { return };
            at_s = self.answer_read(device, span.id, span.address, span.length, at_s);
        }
    }

    /// Fast sync and bulk reads: one answer, which ends before the first device that stays silent.
    fn fast_read(&mut self, spans: impl Iterator<Item = ReadSpan> + Clone) {
        let mut out = [0; MAX_PACKET_LEN];
        // No device answers a request whose reply would exceed a packet.
        let Ok(mut writer) = FastReplyWriter::new(&mut out, spans.clone().map(|span| span.length)) else {
            return;
        };
        let mut at_s = self.now_s;
        let mut answered = false;
        for span in spans {
            let answers = self
                .device(span.id)
                .filter(|&device| self.status_return_level(device) >= 1);
            let Some(device) = answers else { break };
            let (flags, mut data) = self.read(device, span.address, span.length);
            data.resize(usize::from(span.length), 0); // the place is kept when there is an error
            let segment = FastSegment {
                id: span.id,
                flags,
                data: &data,
            };
            if writer.push(segment).is_err() {
                break;
            }
            answered = true;
            at_s += self.return_delay_s(device);
        }
        let len = writer.len();
        if answered {
            self.line.put(out[..len].to_vec(), at_s);
        }
    }

    fn read(&mut self, device: Device, address: u16, length: u16) -> (StatusFlags, Vec<u8>) {
        let alert = self.alert(device);
        let read = match device {
            Device::Servo => self.servo.read(address, length, &self.plant, self.now_s),
            Device::Tracker => self.tracker.read(address, length, &self.plant),
        };
        match read {
            Ok(data) => (StatusFlags { alert, error: None }, data.to_vec()),
            Err(error) => {
                let error = Some(error);
                (StatusFlags { alert, error }, Vec::new())
            }
        }
    }

    /// Answers a read. Returns when the answer leaves.
    fn answer_read(&mut self, device: Device, id: DeviceId, address: u16, length: u16, after_s: f64) -> f64 {
        let (flags, data) = self.read(device, address, length);
        let at_s = after_s + self.return_delay_s(device);
        self.put_status(id, flags, &data, at_s);
        at_s
    }

    fn answer_ping(&mut self, device: Device, after_s: f64) -> f64 {
        let identity = match device {
            Device::Servo => self.servo.identity(),
            Device::Tracker => self.tracker.identity(),
        };
        let at_s = after_s + self.return_delay_s(device);
        let alert = self.alert(device);
        self.put_status(self.id(device), StatusFlags { alert, error: None }, &identity, at_s);
        at_s
    }

    /// Says why an instruction cannot even be tried.
    fn answer_error(&mut self, device: Device, error: StatusError) {
        if self.status_return_level(device) >= 2 {
            let (alert, error) = (self.alert(device), Some(error));
            let at_s = self.now_s + self.return_delay_s(device);
            self.put_status(self.id(device), StatusFlags { alert, error }, &[], at_s);
        }
    }

    fn put_status(&mut self, id: DeviceId, flags: StatusFlags, data: &[u8], at_s: f64) {
        let status = StatusPacket { id, flags, data };
        let mut out = [0; MAX_PACKET_LEN];
        // No control table is longer than a packet, so this fits.
        if let Ok(len) = status.encode(&mut out) {
            self.line.put(out[..len].to_vec(), at_s);
        }
    }

    fn id(&self, device: Device) -> DeviceId {
        match device {
            Device::Servo => self.servo.id(),
            Device::Tracker => self.tracker.id(),
        }
    }

    fn alert(&self, device: Device) -> bool {
        device == Device::Servo && self.servo.alert()
    }

    fn status_return_level(&self, device: Device) -> u32 {
        match device {
            Device::Servo => self.servo.status_return_level(),
            Device::Tracker => 2,
        }
    }

    fn return_delay_s(&self, device: Device) -> f64 {
        match device {
            Device::Servo => self.servo.return_delay_s(),
            Device::Tracker => 0.0,
        }
    }
}

/// A sync read as spans; IDs that no device can have are passed over.
fn spans(ids: &[u8], address: u16, length: u16) -> impl Iterator<Item = ReadSpan> + Clone + '_ {
    ids.iter().filter_map(move |&id| {
        let id = DeviceId::new(id)?;
        Some(ReadSpan { id, address, length })
    })
}

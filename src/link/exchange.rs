//! The exchange of a tick: the goal goes out, the readings of both devices come in.
//!
//! One write to the port holds two packets: the goal velocity for the servo, and the request for both devices' blocks. So the
//! USB frame that carries the goal carries the question too. It needs a servo that does not answer writes (status return
//! level 1): its receipt would collide with the question on a half-duplex line. The receipt is the goal that is read back
//! with the block.
//!
//! An answer that comes only after the wait is over is no answer to the next question, but it is a reading, a tick old and with the
//! servo's own time in it. It stands in for the next tick's where that fails, so that a slow line is not taken for a silent device.
//!
//! | [`ReadPlan`] | question | answers | bytes on the wire with 5 cells |
//! |---|---|---|---|
//! | `FastBulk` | one | one, of both devices | 16 + 20 + 96 |
//! | `Bulk` | one | one of each device | 16 + 20 + 60 + 42 |
//! | `Separate` | one to each device | one to each | 16 + 14 + 60 + 14 + 42 |
//!
//! A worm without a tracker asks the servo alone, by a plain read, and waits for nothing else; one with an inertial sensor asks that as it
//! would a tracker of no cells.

mod answers;

use answers::Answers;
use std::time::Instant;

use super::{Port, PortError, ServoReading, TrackerReading, TransactionError, WaitEnd, WormBus, servo, tracker};
use dynamixel_bus::packet::{
    DeviceId, Instruction, InstructionPacket, Packet, ReadSpan, ReadSpans, Recipient, StatusError,
};

/// How the two blocks are read in each tick, as it is configured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReadMode {
    /// The fastest that both devices know, found out at start-up.
    #[default]
    Auto,
    /// As said.
    Always(ReadPlan),
}

/// How the two blocks are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReadPlan {
    /// Fast bulk read.
    FastBulk,
    /// Bulk read, for firmware that does not know the fast one.
    Bulk,
    /// A read of each device, for trackers on the Arduino library, which knows no bulk read.
    Separate,
}

/// Whom an exchange talks to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExchangePlan {
    /// The servo.
    pub servo: DeviceId,
    /// What is asked of the tracker; none on a worm without one.
    pub tracker: Option<TrackerQuery>,
    /// How both are read. Without a tracker it does not matter.
    pub read: ReadPlan,
}

/// What an exchange asks of the tracker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TrackerQuery {
    /// The tracker.
    pub id: DeviceId,
    /// Cells to read, at most [`MAX_CELLS`](worm_physics::MAX_CELLS).
    pub cells: usize,
    /// Bits of the tracker's switches of which each means that the emergency stop is pressed; without it they are not read.
    pub emergency_stop_mask: Option<u8>,
    /// Whether its inertial sensor's pitch is read.
    pub pitch: bool,
}

impl TrackerQuery {
    const fn span(&self) -> ReadSpan {
        use tracker::register::{PITCH, SWITCHES};
        match (self.pitch, self.emergency_stop_mask) {
            (false, None) => tracker::block_span(self.id, self.cells),
            (false, Some(_)) => tracker::block_span_from(SWITCHES, self.id, self.cells),
            (true, _) => tracker::block_span_from(PITCH, self.id, self.cells),
        }
    }

    /// The reading of an answer; nothing where it has another length than was asked for.
    fn reading(&self, data: &[u8]) -> Option<TrackerReading> {
        let mut reading = TrackerReading::from_block(data.get(self.extra_len()..)?).ok()?;
        // The pitch comes first.
        if let Some(counts) = data.first_chunk().filter(|_| self.pitch) {
            reading.pitch_rad = tracker::pitch_rad(i16::from_le_bytes(*counts));
        }
        Some(reading)
    }

    /// The switches of an answer, where they were asked for: right in front of the block.
    fn switches(&self, data: &[u8]) -> Option<u8> {
        self.emergency_stop_mask?;
        data.get(self.extra_len() - 1).copied()
    }

    /// Bytes in front of the block.
    const fn extra_len(&self) -> usize {
        (tracker::BLOCK_ADDRESS - self.span().address) as usize
    }
}

impl ExchangePlan {
    /// How the devices are read, and what is read of the tracker where there is one.
    fn with_tracker(&self) -> Option<(ReadPlan, TrackerQuery)> {
        self.tracker.map(|tracker| (self.read, tracker))
    }

    /// Bytes of an answer of the servo; of the whole reply where both devices answer in one.
    fn answer_len(&self) -> u64 {
        const STATUS_OVERHEAD: u64 = 11; // header, ID, length, instruction, error, CRC
        const FAST_HEADER: u64 = 8;
        const SEGMENT_OVERHEAD: u64 = 4; // error, ID, CRC
        let servo = u64::from(servo::block_span(self.servo).length);
        match self.with_tracker() {
            Some((ReadPlan::FastBulk, tracker)) => {
                FAST_HEADER + servo + u64::from(tracker.span().length) + 2 * SEGMENT_OVERHEAD
            }
            Some((ReadPlan::Bulk | ReadPlan::Separate, _)) | None => STATUS_OVERHEAD + servo,
        }
    }
}

/// What an exchange brought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExchangeOutcome {
    /// The servo's block, or why there is none.
    pub servo: Result<ServoReading, ReadFailure>,
    /// The tracker's block, or why there is none.
    pub tracker: Result<TrackerReading, ReadFailure>,
    /// The servo reports the goal that was sent. If not, though it was read: the goal got lost, is beyond the velocity limit,
    /// or is locked by a latched watchdog; or the answer is a late one to an earlier question.
    pub goal_taken: bool,
    /// Whether the emergency stop that the tracker reads is pressed; nothing where none is planned, or it was not read this time.
    pub emergency_stop: Option<bool>,
    /// A reading is the late answer to an earlier exchange.
    pub late: bool,
    /// Earlier exchanges of which the servo's answer counts as lost now: some time after the fact, as it might have been late.
    pub lost: u32,
    /// Bytes sent.
    pub sent_bytes: u32,
    /// Bytes received.
    pub received_bytes: u32,
    /// Consecutive exchanges without any byte, up to this one. Many of them mean that the worm is gone although the port is
    /// present: it is switched off, or the cable is unplugged.
    pub silent_in_a_row: u32,
}

impl ExchangeOutcome {
    /// Whether the data of every device that was asked arrived.
    #[must_use]
    pub const fn is_complete(&self) -> bool {
        self.servo.is_ok() && matches!(self.tracker, Ok(_) | Err(ReadFailure::NotAsked))
    }

    /// Whether the port is gone and has to be opened again.
    #[must_use]
    pub const fn is_disconnected(&self) -> bool {
        matches!(self.servo, Err(ReadFailure::Port(PortError::Disconnected)))
            || matches!(self.tracker, Err(ReadFailure::Port(PortError::Disconnected)))
    }
}

/// Why a device's data did not come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ReadFailure {
    /// It was not asked: the worm has no such device.
    #[error("not asked: there is none")]
    NotAsked,
    /// No answer by the deadline.
    #[error("no answer by the deadline")]
    Silent,
    /// The answer came damaged.
    #[error("the answer came damaged")]
    Damaged,
    /// The device refused.
    #[error("refused: {0}")]
    Refused(StatusError),
    /// Another device answered in its place, or with another length.
    #[error("an answer that is none to the question")]
    Malformed,
    /// The port failed.
    #[error(transparent)]
    Port(PortError),
}

impl ReadFailure {
    const fn or_damaged(self) -> Self {
        if matches!(self, Self::Silent) {
            Self::Damaged
        } else {
            self
        }
    }
}

/// Maximum number of bytes of late answers that are decoded: those of a tenth of a second at 1 kHz. The rest is discarded.
const LATE_LIMIT: usize = 16 * 1024;

impl<P: Port> WormBus<P> {
    /// Sends the goal velocity and reads both devices' blocks, until both have come or `deadline` has passed.
    ///
    /// Allocates nothing, and waits nowhere but on the port. What one device says is used though the other is silent. With
    /// [`ReadPlan::Separate`] the servo has half of the time, so that its silence does not cost the tracker's answer. Time between
    /// exchanges is that between their deadlines, so a caller in virtual time gives deadlines in virtual time.
    pub fn exchange(&mut self, plan: &ExchangePlan, goal_velocity_rad_s: f64, deadline: Instant) -> ExchangeOutcome {
        let before = self.bus.counters();
        self.exchange_counters.exchanges += 1;
        let mut late = Answers::none(plan);
        if self.owed.is_any() {
            // A port that fails here fails in the exchange, too.
            let _ = self.bus.take_late_packets(LATE_LIMIT, |packet, counters| match packet {
                Packet::Status(status) => late.take_status(plan, &status, counters),
                Packet::FastReply(reply) => late.take_fast_reply(plan, reply, counters),
                Packet::Instruction(_) => {}
            });
        }
        let mut harvest = Answers::none(plan);
        let end = match plan.with_tracker() {
            Some((ReadPlan::FastBulk | ReadPlan::Bulk, tracker)) => {
                self.exchange_bulk(plan, tracker, goal_velocity_rad_s, deadline, &mut harvest)
            }
            Some((ReadPlan::Separate, tracker)) => {
                self.exchange_separately(plan, tracker, goal_velocity_rad_s, deadline, &mut harvest)
            }
            None => self.exchange_with_servo(plan, goal_velocity_rad_s, deadline, &mut harvest),
        };
        if let Err(TransactionError::Port(error)) = end {
            harvest.fail_all(plan, ReadFailure::Port(error));
        }
        // An answer may come between the look for late ones and the request, which throws away what is on the line.
        let stale_bytes = self.bus.counters().stale_bytes - before.stale_bytes;
        let late_answers = late.servo_answers.max((stale_bytes / plan.answer_len()) as u32);
        // With separate reads, the request to the tracker throws away what the servo answers after its half of the time.
        let discarded = self.owed.take_late(late_answers);
        let reported_rad_s = harvest.servo.map(|servo| servo.goal_velocity_rad_s);
        let goal_taken = reported_rad_s.is_ok_and(|found| goal_counts(found) == goal_counts(goal_velocity_rad_s));
        let goal = servo::scale::velocity_counts(goal_velocity_rad_s);
        let answers = harvest.servo_answers + discarded;
        let lost = self.owed.ask(deadline, goal, answers, goal_taken);
        let counters = self.bus.counters_mut();
        for failure in [harvest.servo.err(), harvest.tracker.err()] {
            counters.timeouts += u64::from(failure == Some(ReadFailure::Silent));
        }
        let is_partial = plan.tracker.is_some() && harvest.servo.is_ok() != harvest.tracker.is_ok();
        self.exchange_counters.partial_answers += u64::from(is_partial);
        let received_bytes = (counters.received_bytes - before.received_bytes) as u32;
        self.silent_in_a_row = if received_bytes == 0 {
            self.silent_in_a_row.saturating_add(1)
        } else {
            0
        };
        self.exchange_counters.goals_not_taken += u64::from(harvest.servo.is_ok() && !goal_taken);
        let servo_is_late = harvest.servo.is_err() && late.servo.is_ok();
        let tracker_is_late = harvest.tracker.is_err() && late.tracker.is_ok();
        self.exchange_counters.late_answers += u64::from(servo_is_late || tracker_is_late);
        let switches = harvest.switches.or(late.switches);
        ExchangeOutcome {
            goal_taken,
            emergency_stop: plan
                .tracker
                .and_then(|query| query.emergency_stop_mask)
                .zip(switches)
                .map(|(mask, switches)| switches & mask != 0),
            late: servo_is_late || tracker_is_late,
            lost,
            servo: if servo_is_late { late.servo } else { harvest.servo },
            tracker: if tracker_is_late { late.tracker } else { harvest.tracker },
            sent_bytes: (counters.sent_bytes - before.sent_bytes) as u32,
            received_bytes,
            silent_in_a_row: self.silent_in_a_row,
        }
    }

    fn exchange_bulk(
        &mut self,
        plan: &ExchangePlan,
        tracker: TrackerQuery,
        goal_velocity_rad_s: f64,
        deadline: Instant,
        harvest: &mut Answers,
    ) -> Result<(), TransactionError> {
        let wire = [servo::block_span(plan.servo), tracker.span()].map(ReadSpan::to_wire);
        let spans = ReadSpans::from_valid(&wire);
        let fast = plan.read == ReadPlan::FastBulk;
        let instruction = if fast {
            Instruction::FastBulkRead(spans)
        } else {
            Instruction::BulkRead(spans)
        };
        let goal = goal_counts(goal_velocity_rad_s);
        let request = [
            goal_write(plan.servo, &goal),
            InstructionPacket {
                recipient: Recipient::All,
                instruction,
            },
        ];
        self.bus.send_packets(&request, deadline)?;
        let end = self.bus.receive_until(deadline, |packet, counters| {
            match packet {
                Packet::Status(status) => harvest.take_status(plan, &status, counters),
                Packet::FastReply(reply) => {
                    harvest.take_fast_reply(plan, reply, counters);
                    return true; // there is one, good or not
                }
                Packet::Instruction(_) => {} // an echo of the request
            }
            harvest.is_answered()
        })?;
        if let WaitEnd::DeadlinePassed { damaged } = end {
            if fast {
                self.bus
                    .take_unfinished_fast_reply(|reply, counters| harvest.take_fast_reply(plan, reply, counters));
            }
            harvest.blame_damage(damaged);
        }
        Ok(())
    }

    fn exchange_separately(
        &mut self,
        plan: &ExchangePlan,
        tracker: TrackerQuery,
        goal_velocity_rad_s: f64,
        deadline: Instant,
        harvest: &mut Answers,
    ) -> Result<(), TransactionError> {
        let now = Instant::now();
        let servo_deadline = now + deadline.saturating_duration_since(now) / 2;
        self.exchange_with_servo(plan, goal_velocity_rad_s, servo_deadline, harvest)?;
        self.bus.send_packets(&[read_of(tracker.span())], deadline)?;
        self.receive_answer(plan, tracker.id, deadline, harvest)
    }

    /// The goal and a read of the servo's block in one write, and the answer.
    fn exchange_with_servo(
        &mut self,
        plan: &ExchangePlan,
        goal_velocity_rad_s: f64,
        deadline: Instant,
        harvest: &mut Answers,
    ) -> Result<(), TransactionError> {
        let goal = goal_counts(goal_velocity_rad_s);
        let read = read_of(servo::block_span(plan.servo));
        self.bus
            .send_packets(&[goal_write(plan.servo, &goal), read], deadline)?;
        self.receive_answer(plan, plan.servo, deadline, harvest)
    }

    /// Waits for the answer of one device to a read of its own.
    fn receive_answer(
        &mut self,
        plan: &ExchangePlan,
        device: DeviceId,
        deadline: Instant,
        harvest: &mut Answers,
    ) -> Result<(), TransactionError> {
        let end = self.bus.receive_until(deadline, |packet, counters| {
            if let Packet::Status(status) = packet {
                harvest.take_status(plan, &status, counters);
            }
            !harvest.is_silent(plan, device)
        })?;
        if let WaitEnd::DeadlinePassed { damaged: true } = end {
            harvest.fail(plan, device, ReadFailure::Damaged);
        }
        Ok(())
    }
}

fn goal_counts(goal_velocity_rad_s: f64) -> [u8; 4] {
    servo::scale::velocity_counts(goal_velocity_rad_s).to_le_bytes()
}

fn goal_write(servo: DeviceId, counts: &[u8; 4]) -> InstructionPacket<'_> {
    let instruction = Instruction::Write {
        address: servo::register::GOAL_VELOCITY.address,
        data: counts,
    };
    InstructionPacket {
        recipient: Recipient::One(servo),
        instruction,
    }
}

const fn read_of(span: ReadSpan) -> InstructionPacket<'static> {
    let instruction = Instruction::Read {
        address: span.address,
        length: span.length,
    };
    InstructionPacket {
        recipient: Recipient::One(span.id),
        instruction,
    }
}

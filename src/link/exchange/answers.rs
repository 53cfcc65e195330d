//! What an exchange has brought so far, from whichever device.

use super::{ExchangePlan, ReadFailure};
use crate::link::{BusCounters, ServoReading, TrackerReading, servo};
use dynamixel_bus::packet::{DeviceId, FastReply, SegmentError, StatusFlags, StatusPacket};

/// The answers received so far.
pub(super) struct Answers {
    pub(super) servo: Result<ServoReading, ReadFailure>,
    pub(super) tracker: Result<TrackerReading, ReadFailure>,
    /// The tracker's switches, where they are read.
    pub(super) switches: Option<u8>,
    /// Whole answers of the servo.
    pub(super) servo_answers: u32,
}

impl Answers {
    /// Before anybody has answered.
    pub(super) const fn none(plan: &ExchangePlan) -> Self {
        Self {
            servo: Err(ReadFailure::Silent),
            tracker: Err(match plan.tracker {
                Some(_) => ReadFailure::Silent,
                None => ReadFailure::NotAsked,
            }),
            switches: None,
            servo_answers: 0,
        }
    }

    /// Takes a block of either device, or counts why it is none.
    pub(super) fn take(
        &mut self,
        plan: &ExchangePlan,
        id: DeviceId,
        flags: StatusFlags,
        data: &[u8],
        counters: &mut BusCounters,
    ) {
        let failure = flags.error.map_or(ReadFailure::Malformed, ReadFailure::Refused);
        if flags.error.is_none() && data.is_empty() {
            return; // the receipt of the goal, from a servo that answers writes
        }
        let malformed = if id == plan.servo {
            let block = data.try_into().ok().filter(|_| flags.error.is_none());
            self.servo = block
                .map(|block| ServoReading::from_block(block, flags.alert))
                .ok_or(failure);
            self.servo_answers += u32::from(self.servo.is_ok());
            self.servo == Err(ReadFailure::Malformed)
        } else if let Some(query) = plan.tracker.filter(|query| query.id == id) {
            let of_length = flags.error.is_none() && data.len() == usize::from(query.span().length);
            let reading = if of_length {
                self.switches = query.switches(data);
                query.reading(data)
            } else {
                None
            };
            self.tracker = reading.ok_or(failure);
            self.tracker == Err(ReadFailure::Malformed)
        } else {
            counters.wrong_ids += 1;
            false
        };
        counters.malformed += u64::from(malformed);
    }

    pub(super) fn take_status(&mut self, plan: &ExchangePlan, status: &StatusPacket<'_>, counters: &mut BusCounters) {
        self.take(plan, status.id, status.flags, status.data, counters);
    }

    pub(super) fn take_fast_reply(&mut self, plan: &ExchangePlan, reply: FastReply<'_>, counters: &mut BusCounters) {
        // A worm without a tracker asks for no such reply.
        let Some(query) = plan.tracker else { return };
        for segment in reply.segments([servo::block_span(plan.servo), query.span()]) {
            match segment {
                Ok(segment) => {
                    counters.count_flags(segment.flags);
                    self.take(plan, segment.id, segment.flags, segment.data, counters);
                }
                Err(SegmentError::Crc(id)) => {
                    counters.crc_errors += 1;
                    self.fail(plan, id, ReadFailure::Damaged);
                }
                Err(SegmentError::WrongId { expected, .. }) => {
                    counters.wrong_ids += 1;
                    self.fail(plan, expected, ReadFailure::Malformed);
                }
                Err(SegmentError::Missing(_)) => {}
            }
        }
    }

    pub(super) fn fail(&mut self, plan: &ExchangePlan, id: DeviceId, failure: ReadFailure) {
        if id == plan.servo && self.servo.is_err() {
            self.servo = Err(failure);
        } else if plan.tracker.is_some_and(|query| query.id == id) && self.tracker.is_err() {
            self.tracker = Err(failure);
        }
    }

    /// The exchange as a whole failed.
    pub(super) fn fail_all(&mut self, plan: &ExchangePlan, failure: ReadFailure) {
        self.fail(plan, plan.servo, failure);
        if let Some(query) = plan.tracker {
            self.fail(plan, query.id, failure);
        }
    }

    /// Where a damaged packet came and good ones did not, damage is the reason, rather than silence.
    pub(super) fn blame_damage(&mut self, damaged: bool) {
        if damaged {
            self.servo = self.servo.map_err(ReadFailure::or_damaged);
            self.tracker = self.tracker.map_err(ReadFailure::or_damaged);
        }
    }

    /// This device has said nothing yet.
    pub(super) fn is_silent(&self, plan: &ExchangePlan, id: DeviceId) -> bool {
        if id == plan.servo {
            self.servo == Err(ReadFailure::Silent)
        } else {
            self.tracker == Err(ReadFailure::Silent)
        }
    }

    /// Whether each device has answered, with data or a refusal.
    pub(super) fn is_answered(&self) -> bool {
        self.servo != Err(ReadFailure::Silent) && self.tracker != Err(ReadFailure::Silent)
    }
}

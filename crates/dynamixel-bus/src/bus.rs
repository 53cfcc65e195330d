//! Transactions on a port: one request and its answer, within a deadline.
//!
//! Before a request is sent, all earlier input is discarded, so that a late answer to the last request is not taken for the answer to this
//! one. Statuses of other devices are counted and ignored.

use std::time::Instant;

use super::packet::{
    DecodeError, Decoder, DeviceId, EncodeError, FastReply, Instruction, InstructionPacket, MAX_PACKET_LEN, Packet,
    ReadSpan, ReadSpans, Recipient, StatusError, StatusFlags, StatusPacket,
};
use super::{BusCounters, Port, PortError, Register};

/// Devices on a bus, behind a port.
#[derive(Debug)]
pub struct Bus<P> {
    port: P,
    decoder: Decoder,
    counters: BusCounters,
    /// Garbage bytes of the decoder that have been counted already.
    garbage_counted: u64,
    writes_are_answered: bool,
}

/// The answer to a ping.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Model number.
    pub model: u16,
    /// Version of the firmware.
    pub firmware: u8,
    /// The device has a hardware error.
    pub alert: bool,
}

/// Why a transaction failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TransactionError {
    /// No answer in time.
    #[error("device {0} does not answer: check its power, cable, ID and baud rate")]
    Silent(DeviceId),
    /// The answer came damaged.
    #[error("the answer of device {0} came damaged: check cable, length and termination")]
    Damaged(DeviceId),
    /// The device refused.
    #[error("device {id} refused: {error}")]
    Refused {
        /// The device.
        id: DeviceId,
        /// Its error.
        error: StatusError,
    },
    /// The answer has another length than requested.
    #[error("device {id} answered with {found} bytes instead of {expected}: is it of the model configured?")]
    Length {
        /// The device.
        id: DeviceId,
        /// Bytes requested.
        expected: usize,
        /// Bytes received.
        found: usize,
    },
    /// The request does not fit into a packet.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The port failed.
    #[error(transparent)]
    Port(#[from] PortError),
}

/// How [`Bus::receive_until`] ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaitEnd {
    /// Everything expected has come.
    Done,
    /// The deadline passed first.
    DeadlinePassed {
        /// A packet came whose CRC was wrong.
        damaged: bool,
    },
}

impl<P: Port> Bus<P> {
    /// A bus on this port. Writes are answered, as with the factory settings of a device.
    pub const fn new(port: P) -> Self {
        Self {
            port,
            decoder: Decoder::new(),
            counters: BusCounters::NONE,
            garbage_counted: 0,
            writes_are_answered: true,
        }
    }

    /// The counts so far.
    pub const fn counters(&self) -> BusCounters {
        self.counters
    }

    /// The counts so far, for transactions that are built from the parts of this bus.
    pub const fn counters_mut(&mut self) -> &mut BusCounters {
        &mut self.counters
    }

    /// The port.
    pub const fn port(&self) -> &P {
        &self.port
    }

    /// The port, for anything that is not a transaction.
    pub const fn port_mut(&mut self) -> &mut P {
        &mut self.port
    }

    /// Tells the bus whether devices answer writes: at status return level 2 they do, at 0 and 1 they do not.
    pub const fn set_writes_are_answered(&mut self, answered: bool) {
        self.writes_are_answered = answered;
    }

    /// Asks a device for its identity. It answers at any status return level.
    ///
    /// # Errors
    /// [`TransactionError`]
    pub fn ping(&mut self, id: DeviceId, deadline: Instant) -> Result<Identity, TransactionError> {
        self.ask(id, Instruction::Ping, deadline)?;
        let mut identity = [0; 3];
        let flags = self.answer_of(id, &mut identity, deadline)?;
        let [model_low, model_high, firmware] = identity;
        Ok(Identity {
            model: u16::from_le_bytes([model_low, model_high]),
            firmware,
            alert: flags.alert,
        })
    }

    /// Asks all devices for their identity, and listens until `deadline`. They answer in the order of their IDs; the official SDK allows
    /// 3 ms for each possible ID. Returns the number of answers.
    ///
    /// # Errors
    /// [`PortError`]
    pub fn broadcast_ping(
        &mut self,
        deadline: Instant,
        mut found: impl FnMut(DeviceId, Identity),
    ) -> Result<usize, TransactionError> {
        let packet = InstructionPacket {
            recipient: Recipient::All,
            instruction: Instruction::Ping,
        };
        self.send_packets(&[packet], deadline)?;
        let mut answers = 0;
        self.receive_until(deadline, |packet, _| {
            if let Packet::Status(StatusPacket {
                id,
                flags,
                data: &[model_low, model_high, firmware],
            }) = packet
            {
                answers += 1;
                found(
                    id,
                    Identity {
                        model: u16::from_le_bytes([model_low, model_high]),
                        firmware,
                        alert: flags.alert,
                    },
                );
            }
            false
        })?;
        Ok(answers)
    }

    /// Reads bytes from `address` on, as many as `into` holds.
    ///
    /// # Errors
    /// [`TransactionError`]
    pub fn read(
        &mut self,
        id: DeviceId,
        address: u16,
        into: &mut [u8],
        deadline: Instant,
    ) -> Result<StatusFlags, TransactionError> {
        let length = u16::try_from(into.len()).map_err(|_| EncodeError::TooLong)?;
        self.ask(id, Instruction::Read { address, length }, deadline)?;
        self.answer_of(id, into, deadline)
    }

    /// Reads a register as an unsigned number.
    ///
    /// # Errors
    /// [`TransactionError`]
    pub fn read_register(
        &mut self,
        id: DeviceId,
        register: Register,
        deadline: Instant,
    ) -> Result<u32, TransactionError> {
        let mut value = [0; 4];
        self.read(id, register.address, &mut value[..usize::from(register.size)], deadline)?;
        Ok(u32::from_le_bytes(value))
    }

    /// Writes bytes from `address` on, and waits for the answer if writes are answered.
    ///
    /// # Errors
    /// [`TransactionError`]; if writes are not answered, only those of sending.
    pub fn write(
        &mut self,
        id: DeviceId,
        address: u16,
        data: &[u8],
        deadline: Instant,
    ) -> Result<(), TransactionError> {
        self.ask(id, Instruction::Write { address, data }, deadline)?;
        if self.writes_are_answered {
            self.answer_of(id, &mut [], deadline)?;
        }
        Ok(())
    }

    /// Writes the low bytes of `value` to a register.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn write_register(
        &mut self,
        id: DeviceId,
        register: Register,
        value: u32,
        deadline: Instant,
    ) -> Result<(), TransactionError> {
        self.write(
            id,
            register.address,
            &value.to_le_bytes()[..usize::from(register.size)],
            deadline,
        )
    }

    /// Restarts a device, which clears a hardware error. It is back within about a second, with the RAM area as at power-up: torque off,
    /// writes answered.
    ///
    /// # Errors
    /// [`TransactionError`]; if writes are not answered, only those of sending.
    pub fn reboot(&mut self, id: DeviceId, deadline: Instant) -> Result<(), TransactionError> {
        self.ask(id, Instruction::Reboot, deadline)?;
        if self.writes_are_answered {
            self.answer_of(id, &mut [], deadline)?;
        }
        Ok(())
    }

    /// Reads the same addresses of several devices, and calls `each` with every answer. Returns the number of answers.
    ///
    /// # Errors
    /// [`TransactionError`] of sending and of the port. A silent device is not an error, only an answer less.
    pub fn sync_read(
        &mut self,
        address: u16,
        length: u16,
        ids: &[DeviceId],
        deadline: Instant,
        each: impl FnMut(StatusPacket<'_>),
    ) -> Result<usize, TransactionError> {
        let mut wire = [0; DeviceId::MAX.get() as usize + 1];
        let wire = wire.get_mut(..ids.len()).ok_or(EncodeError::TooLong)?;
        for (wire, id) in wire.iter_mut().zip(ids) {
            *wire = id.get();
        }
        self.read_of_several(
            Instruction::SyncRead {
                address,
                length,
                ids: wire,
            },
            ids.len(),
            deadline,
            each,
        )
    }

    /// Reads a span of each of several devices, and calls `each` with every answer. Returns the number of answers.
    ///
    /// # Errors
    /// [`TransactionError`] of sending and of the port. A silent device is not an error, only an answer less.
    pub fn bulk_read<const DEVICES: usize>(
        &mut self,
        spans: [ReadSpan; DEVICES],
        deadline: Instant,
        each: impl FnMut(StatusPacket<'_>),
    ) -> Result<usize, TransactionError> {
        let wire = spans.map(ReadSpan::to_wire);
        let spans = ReadSpans::from_valid(&wire);
        self.read_of_several(Instruction::BulkRead(spans), DEVICES, deadline, each)
    }

    fn read_of_several(
        &mut self,
        instruction: Instruction<'_>,
        devices: usize,
        deadline: Instant,
        mut each: impl FnMut(StatusPacket<'_>),
    ) -> Result<usize, TransactionError> {
        self.send_packets(
            &[InstructionPacket {
                recipient: Recipient::All,
                instruction,
            }],
            deadline,
        )?;
        let mut answers = 0;
        self.receive_until(deadline, |packet, _| {
            if let Packet::Status(status) = packet {
                answers += 1;
                each(status);
            }
            answers == devices
        })?;
        Ok(answers)
    }

    /// Listens until `deadline` and discards what comes, so that the line is quiet afterwards.
    ///
    /// # Errors
    /// [`PortError`]
    pub fn settle(&mut self, deadline: Instant) -> Result<(), PortError> {
        self.receive_until(deadline, |_, _| false)?;
        self.counters.stale_bytes += self.decoder.clear() as u64;
        Ok(())
    }

    fn ask(&mut self, id: DeviceId, instruction: Instruction<'_>, deadline: Instant) -> Result<(), TransactionError> {
        self.send_packets(
            &[InstructionPacket {
                recipient: Recipient::One(id),
                instruction,
            }],
            deadline,
        )
    }

    /// Waits for the status of `id` whose data fills `into`.
    fn answer_of(&mut self, id: DeviceId, into: &mut [u8], deadline: Instant) -> Result<StatusFlags, TransactionError> {
        let mut answer = None;
        let end = self.receive_until(deadline, |packet, counters| {
            let Packet::Status(status) = packet else {
                return false;
            };
            if status.id != id {
                counters.wrong_ids += 1;
                return false;
            }
            if let Some(error) = status.flags.error {
                answer = Some(Err(TransactionError::Refused { id, error }));
            } else if status.data.len() == into.len() {
                into.copy_from_slice(status.data);
                answer = Some(Ok(status.flags));
            } else if !status.data.is_empty() {
                counters.malformed += 1;
                let (expected, found) = (into.len(), status.data.len());
                answer = Some(Err(TransactionError::Length { id, expected, found }));
            }
            // An empty answer to a read belongs to an earlier write.
            answer.is_some()
        })?;
        if let Some(answer) = answer {
            return answer;
        }
        Err(match end {
            WaitEnd::DeadlinePassed { damaged: true } => TransactionError::Damaged(id),
            _ => {
                self.counters.timeouts += 1;
                TransactionError::Silent(id)
            }
        })
    }

    /// Discards late input, then sends the packets in one write.
    ///
    /// # Errors
    /// [`TransactionError`] of encoding and of the port.
    pub fn send_packets(
        &mut self,
        packets: &[InstructionPacket<'_>],
        deadline: Instant,
    ) -> Result<(), TransactionError> {
        let mut request = [0; MAX_PACKET_LEN];
        let mut len = 0;
        for packet in packets {
            len += packet.encode(&mut request[len..])?;
        }
        let stale = self
            .port
            .discard_input()
            .map_err(|error| self.count_port_error(error))?;
        self.counters.stale_bytes += (stale + self.decoder.clear()) as u64;
        self.port
            .send(&request[..len], deadline)
            .map_err(|error| self.count_port_error(error))?;
        self.counters.sent_bytes += len as u64;
        Ok(())
    }

    /// Receives packets and passes them to `take` until it returns true or `deadline` has passed. Packets that have arrived by then are
    /// passed, too, so that of two answers the newer one counts.
    ///
    /// # Errors
    /// [`PortError`]
    pub fn receive_until(
        &mut self,
        deadline: Instant,
        mut take: impl FnMut(Packet<'_>, &mut BusCounters) -> bool,
    ) -> Result<WaitEnd, PortError> {
        let (mut done, mut damaged, mut too_late) = (false, false, false);
        loop {
            while let Some(packet) = self.decoder.next_packet() {
                match packet {
                    Ok(packet) => {
                        if let Packet::Status(status) = packet {
                            self.counters.count_flags(status.flags);
                        }
                        done |= take(packet, &mut self.counters);
                    }
                    Err(DecodeError::Crc { .. }) => {
                        self.counters.crc_errors += 1;
                        damaged = true;
                    }
                    Err(_) => self.counters.malformed += 1,
                }
            }
            self.counters.garbage_bytes += self.decoder.garbage_bytes() - self.garbage_counted;
            self.garbage_counted = self.decoder.garbage_bytes();
            if done {
                return Ok(WaitEnd::Done);
            }
            if too_late {
                return Ok(WaitEnd::DeadlinePassed { damaged });
            }
            let received = self
                .port
                .receive(self.decoder.free_space(), deadline)
                .map_err(|error| self.count_port_error(error))?;
            self.decoder.commit(received);
            self.counters.received_bytes += received as u64;
            // A device that never stops sending must not hold the loop beyond its deadline.
            too_late = received == 0 || Instant::now() >= deadline;
        }
    }

    /// Passes the packets that have come since the last wait to `take`, without waiting for more, up to about `byte_limit` bytes. They
    /// are late answers: their bytes count as stale, and incomplete packets are discarded.
    ///
    /// # Errors
    /// [`PortError`]
    pub fn take_late_packets(
        &mut self,
        byte_limit: usize,
        mut take: impl FnMut(Packet<'_>, &mut BusCounters),
    ) -> Result<(), PortError> {
        let mut stale_bytes = 0;
        while stale_bytes < byte_limit {
            let received = self.port.receive(self.decoder.free_space(), Instant::now())?;
            if received == 0 {
                break;
            }
            stale_bytes += received;
            self.decoder.commit(received);
            while let Some(packet) = self.decoder.next_packet() {
                if let Ok(packet) = packet {
                    take(packet, &mut self.counters);
                }
            }
        }
        self.counters.stale_bytes += stale_bytes as u64;
        // All bytes have been counted as stale: they must not count again as garbage.
        self.decoder.clear();
        self.garbage_counted = self.decoder.garbage_bytes();
        Ok(())
    }

    /// Passes an incomplete fast reply to `take`, if there is one: its first segments may be good.
    pub fn take_unfinished_fast_reply(&mut self, take: impl FnOnce(FastReply<'_>, &mut BusCounters)) {
        if let Some(reply) = self.decoder.unfinished_fast_reply() {
            take(reply, &mut self.counters);
        }
    }

    const fn count_port_error(&mut self, error: PortError) -> PortError {
        if matches!(error, PortError::Disconnected) {
            self.counters.disconnections += 1;
        }
        error
    }
}

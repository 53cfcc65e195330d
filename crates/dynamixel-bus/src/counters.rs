//! What has passed along a bus so far, and what has gone wrong, by kind.

use super::packet::{StatusError, StatusFlags};

/// Counts since the bus was made. Copy it, and subtract an earlier copy for an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BusCounters {
    /// Bytes sent.
    pub sent_bytes: u64,
    /// Bytes received, good or not.
    pub received_bytes: u64,
    /// Devices that did not answer by the deadline.
    pub timeouts: u64,
    /// Packets, and segments of fast replies, whose CRC was wrong.
    pub crc_errors: u64,
    /// Bytes that belonged to no packet.
    pub garbage_bytes: u64,
    /// Bytes of late answers, which came before the next request.
    pub stale_bytes: u64,
    /// Answers from devices that were not asked.
    pub wrong_ids: u64,
    /// Answers of the wrong length, or with invalid content.
    pub malformed: u64,
    /// Answers with the alert bit: the device has a hardware error.
    pub alerts: u64,
    /// Transactions that found the port gone.
    pub disconnections: u64,
    /// Answers with an error code.
    pub refusals: RefusalCounters,
}

/// Answers with an error code, by code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RefusalCounters {
    /// Code 1.
    pub result_fail: u64,
    /// Code 2.
    pub instruction: u64,
    /// Code 3.
    pub crc: u64,
    /// Code 4.
    pub data_range: u64,
    /// Code 5.
    pub data_length: u64,
    /// Code 6.
    pub data_limit: u64,
    /// Code 7.
    pub access: u64,
    /// Any other code.
    pub unknown: u64,
}

impl RefusalCounters {
    const NONE: Self = Self {
        result_fail: 0,
        instruction: 0,
        crc: 0,
        data_range: 0,
        data_length: 0,
        data_limit: 0,
        access: 0,
        unknown: 0,
    };

    /// All of them.
    #[must_use]
    pub const fn total(&self) -> u64 {
        self.result_fail
            + self.instruction
            + self.crc
            + self.data_range
            + self.data_length
            + self.data_limit
            + self.access
            + self.unknown
    }
}

impl BusCounters {
    /// Nothing so far.
    pub const NONE: Self = Self {
        sent_bytes: 0,
        received_bytes: 0,
        timeouts: 0,
        crc_errors: 0,
        garbage_bytes: 0,
        stale_bytes: 0,
        wrong_ids: 0,
        malformed: 0,
        alerts: 0,
        disconnections: 0,
        refusals: RefusalCounters::NONE,
    };

    /// Counts the alert and the error in the flags of a status.
    pub const fn count_flags(&mut self, flags: StatusFlags) {
        if flags.alert {
            self.alerts += 1;
        }
        let refusals = &mut self.refusals;
        let counter = match flags.error {
            None => return,
            Some(StatusError::ResultFail) => &mut refusals.result_fail,
            Some(StatusError::Instruction) => &mut refusals.instruction,
            Some(StatusError::Crc) => &mut refusals.crc,
            Some(StatusError::DataRange) => &mut refusals.data_range,
            Some(StatusError::DataLength) => &mut refusals.data_length,
            Some(StatusError::DataLimit) => &mut refusals.data_limit,
            Some(StatusError::Access) => &mut refusals.access,
            Some(StatusError::Unknown(_)) => &mut refusals.unknown,
        };
        *counter += 1;
    }
}

impl Default for BusCounters {
    fn default() -> Self {
        Self::NONE
    }
}

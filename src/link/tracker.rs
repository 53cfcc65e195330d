//! The tracker: a second device on the servo's bus that says where each cell is along the canal.
//!
//! Its control table, little-endian, read-only but for the ID:
//!
//! | address | bytes | what |
//! |---|---|---|
//! | 0 | 2 | model number, [`MODEL`] |
//! | 6 | 1 | firmware version |
//! | 7 | 1 | ID, 100 by default |
//! | 125 | 2 | pitch of the body in 0.01°, signed, growing up the canal, [`NO_PITCH`] while it is not known; only with an inertial sensor |
//! | 127 | 1 | emergency stop and other switches, one bit each; only where one is configured |
//! | 128 | 4 | sample counter, one more with each capture |
//! | 132 | 4 | time of the capture in µs of the tracker's clock, wraps after 71.6 minutes |
//! | 136 | 1 | number of cells it tracks, 1 to 16 |
//! | 137 | 2 | valid mask: bit *i* says that cell *i* was seen in this capture |
//! | 139 + 4 *i* | 4 | position of cell *i* along the canal in µm, signed; the last one known when it was not seen |
//!
//! A device that has an inertial sensor and tracks no cells (a cell count of 0) serves a worm without a tracker. The pitch is read in every
//! tick; it should be the mean of what the sensor measures in some hundredths of a second.
//!
//! A capture is taken over whole: a read never mixes two. The table fits a device built on the maker's Arduino library
//! (`DYNAMIXEL::Slave`), whose registers 0, 6 and 7 are the same.

use super::packet::{DeviceId, ReadSpan};
use dynamixel_bus::Block;
use worm_physics::MAX_CELLS;

/// Registers of the control table.
pub mod register {
    use crate::link::Register;

    /// See [`MODEL`](super::MODEL).
    pub const MODEL_NUMBER: Register = Register::new(0, 2, "model number");
    /// Version of the firmware.
    pub const FIRMWARE_VERSION: Register = Register::new(6, 1, "firmware version");
    /// The device's ID, 0 to 252.
    pub const ID: Register = Register::new(7, 1, "ID");
    /// Pitch in 0.01°. It need not be there.
    pub const PITCH: Register = Register::new(125, 2, "pitch");
    /// Emergency stop and other switches, one bit each. It need not be there.
    pub const SWITCHES: Register = Register::new(127, 1, "switches");
    /// One more with each capture, wrapping.
    pub const SAMPLE: Register = Register::new(128, 4, "sample counter");
    /// In µs of the tracker's clock, wrapping.
    pub const CAPTURE_TIME: Register = Register::new(132, 4, "capture time");
    /// Number of cells tracked.
    pub const CELL_COUNT: Register = Register::new(136, 1, "cell count");
    /// One bit for each cell.
    pub const VALID_MASK: Register = Register::new(137, 2, "valid mask");
    /// Position of the first cell in µm; the others follow.
    pub const FIRST_POSITION: Register = Register::new(139, 4, "cell position");
}

/// Model number of the tracker: "WM" for worm, high byte first. No DYNAMIXEL has it.
pub const MODEL: u16 = 0x574D;

/// ID of the tracker unless configured otherwise.
pub const DEFAULT_ID: u8 = 100;

/// First address of the block that a tick reads.
pub const BLOCK_ADDRESS: u16 = register::SAMPLE.address;

/// Metres of a position count.
pub const POSITION_M: f64 = 1e-6;

/// Radians of a count of the pitch.
pub const PITCH_RAD: f64 = 0.01 * std::f64::consts::PI / 180.0;

/// Pitch of a sensor that does not know it.
pub const NO_PITCH: i16 = i16::MIN;

/// Bytes in front of the positions.
const HEAD_LEN: usize = (register::FIRST_POSITION.address - BLOCK_ADDRESS) as usize;

/// Most bytes that a tick reads of a tracker.
pub const MAX_BLOCK_LEN: usize = block_len(MAX_CELLS);

/// Bytes that a tick reads of a tracker of so many cells.
#[must_use]
pub const fn block_len(cells: usize) -> usize {
    HEAD_LEN + cells * register::FIRST_POSITION.size as usize
}

/// What a tick reads of the tracker with this ID; no more than [`MAX_CELLS`] cells.
#[must_use]
pub const fn block_span(id: DeviceId, cells: usize) -> ReadSpan {
    let cells = if cells < MAX_CELLS { cells } else { MAX_CELLS };
    ReadSpan {
        id,
        address: BLOCK_ADDRESS,
        length: block_len(cells) as u16,
    }
}

/// What a tick reads of a tracker with more in front of the block than that: as [`block_span`], from this register on.
#[must_use]
pub const fn block_span_from(first: super::Register, id: DeviceId, cells: usize) -> ReadSpan {
    let ReadSpan { length, .. } = block_span(id, cells);
    ReadSpan {
        id,
        address: first.address,
        length: length + BLOCK_ADDRESS - first.address,
    }
}

/// The pitch that a device reports, rad; none where it does not know it.
#[must_use]
pub fn pitch_rad(counts: i16) -> Option<f64> {
    (counts != NO_PITCH).then(|| f64::from(counts) * PITCH_RAD)
}

/// How a device reports a pitch, rad.
#[must_use]
pub fn pitch_counts(pitch_rad: f64) -> i16 {
    // The cast saturates, and no pitch is NO_PITCH.
    ((pitch_rad / PITCH_RAD).round() as i16).max(-i16::MAX)
}

/// What one tick learns from the tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackerReading {
    /// Counter of the capture, wrapping: the same as in the last tick means that there is nothing new.
    pub sample: u32,
    /// Time of the capture in µs of the tracker's clock, wrapping.
    pub capture_time_us: u32,
    /// Number of cells that the tracker tracks; it may be more than were read.
    pub cell_count: u8,
    /// Bit *i* says that cell *i* was seen. Cells that were not read have no bit.
    pub valid: u16,
    /// Positions along the canal in m; zero for cells that were not read.
    pub positions_m: [f64; MAX_CELLS],
    /// Pitch of the body, rad, where it was read and is known.
    pub pitch_rad: Option<f64>,
}

/// A block that no tracker sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{len} bytes are no tracker block: {HEAD_LEN} and 4 for each cell, of which at most {MAX_CELLS}")]
pub struct NoTrackerBlock {
    /// Bytes that came.
    pub len: usize,
}

impl TrackerReading {
    /// From the block of [`block_span`]. Its length says how many cells were read.
    ///
    /// # Errors
    /// [`NoTrackerBlock`] when no number of cells has this length.
    pub fn from_block(bytes: &[u8]) -> Result<Self, NoTrackerBlock> {
        let (head, rest) = bytes
            .split_first_chunk::<HEAD_LEN>()
            .ok_or(NoTrackerBlock { len: bytes.len() })?;
        let (positions, odd) = rest.as_chunks();
        if !odd.is_empty() || positions.len() > MAX_CELLS {
            return Err(NoTrackerBlock { len: bytes.len() });
        }
        let head = Block {
            first_address: BLOCK_ADDRESS,
            bytes: head,
        };
        let cell_count = head.u8(register::CELL_COUNT);
        let mut positions_m = [0.0; MAX_CELLS];
        for (position_m, counts) in positions_m.iter_mut().zip(positions) {
            *position_m = f64::from(i32::from_le_bytes(*counts)) * POSITION_M;
        }
        let usable_cells = positions.len().min(usize::from(cell_count)); // at most MAX_CELLS, the bits of the mask
        let read_mask = ((1u32 << usable_cells) - 1) as u16;
        Ok(Self {
            sample: head.u32(register::SAMPLE),
            capture_time_us: head.u32(register::CAPTURE_TIME),
            cell_count,
            valid: head.u16(register::VALID_MASK) & read_mask,
            positions_m,
            pitch_rad: None,
        })
    }

    /// The block that says this: the tracker's side of [`from_block`](Self::from_block). Positions are rounded to µm.
    #[must_use]
    pub fn to_block(&self) -> [u8; MAX_BLOCK_LEN] {
        let mut block = [0; MAX_BLOCK_LEN];
        let mut put = |register: super::Register, value: &[u8]| {
            let from = usize::from(register.address - BLOCK_ADDRESS);
            block[from..from + value.len()].copy_from_slice(value);
        };
        put(register::SAMPLE, &self.sample.to_le_bytes());
        put(register::CAPTURE_TIME, &self.capture_time_us.to_le_bytes());
        put(register::CELL_COUNT, &[self.cell_count]);
        put(register::VALID_MASK, &self.valid.to_le_bytes());
        for (wire, position_m) in block[HEAD_LEN..].as_chunks_mut().0.iter_mut().zip(self.positions_m) {
            *wire = ((position_m / POSITION_M).round() as i32).to_le_bytes();
        }
        block
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(cells: usize) -> TrackerReading {
        let mut positions_m = [0.0; MAX_CELLS];
        for (cell, position_m) in positions_m[..cells].iter_mut().enumerate() {
            *position_m = cell as f64 * 0.051_234 - 0.02;
        }
        let valid = ((1u32 << cells) - 1) as u16;
        TrackerReading {
            sample: 7,
            capture_time_us: u32::MAX,
            cell_count: cells as u8,
            valid,
            positions_m,
            pitch_rad: None,
        }
    }

    #[test]
    fn block_lengths() {
        assert_eq!([0, 4, 16].map(block_len), [11, 27, 75]);
        assert_eq!(MODEL.to_be_bytes(), *b"WM");
    }

    #[test]
    fn any_number_of_cells_comes_back() {
        for cells in 0..=MAX_CELLS {
            let expected = reading(cells);
            let block = expected.to_block();
            let found = TrackerReading::from_block(&block[..block_len(cells)]).expect("a block");
            for (found, expected) in found.positions_m.iter().zip(expected.positions_m) {
                assert!((found - expected).abs() < 1e-12);
            }
            assert_eq!(
                TrackerReading {
                    positions_m: expected.positions_m,
                    ..found
                },
                expected
            );
        }
    }

    #[test]
    fn pitches_come_back_to_a_hundredth_of_a_degree() {
        for pitch_deg in [-90.0, -0.01, 0.0, 12.34, 89.99] {
            let found = pitch_rad(pitch_counts(f64::to_radians(pitch_deg))).expect("it is known");
            assert!((found.to_degrees() - pitch_deg).abs() < 1e-9, "{pitch_deg}");
        }
        assert_eq!(pitch_rad(NO_PITCH), None);
        assert!(pitch_counts(f64::NEG_INFINITY) > NO_PITCH, "no pitch is none");
    }

    #[test]
    fn cells_not_read_or_not_tracked_are_not_valid() {
        let block = TrackerReading {
            valid: u16::MAX,
            ..reading(5)
        }
        .to_block();
        assert_eq!(
            TrackerReading::from_block(&block[..block_len(3)]).map(|read| read.valid),
            Ok(0b111)
        );
        assert_eq!(TrackerReading::from_block(&block).map(|read| read.valid), Ok(0b1_1111));
    }

    #[test]
    fn other_lengths_are_refused() {
        for len in [0, 10, 12, 14, 79] {
            assert_eq!(TrackerReading::from_block(&vec![0; len]), Err(NoTrackerBlock { len }));
        }
    }
}

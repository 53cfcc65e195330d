//! What the tracker measures. A camera would go here; this is a pattern that a test can predict.

/// Most cells that the control table has room for.
pub const MAX_CELLS: usize = 16;
/// Time from one capture to the next, µs.
pub const PERIOD_US: u64 = 10_000;

/// The positions of all cells at one time.
pub struct Capture {
    /// One more with each capture, wrapping.
    pub sample: u32,
    /// In µs of the tracker's clock, wrapping.
    pub time_us: u32,
    /// Bit *i* is set when cell *i* was seen.
    pub valid_mask: u16,
    /// Along the canal, µm; the last one known where a cell was not seen.
    pub positions_um: [i32; MAX_CELLS],
}

impl Capture {
    /// The newest capture of `cells` cells, at most [`MAX_CELLS`].
    pub fn newest(now_us: u64, cells: usize) -> Self {
        let sample = (now_us / PERIOD_US) as u32; // wraps
        let mut capture = Self {
            sample,
            time_us: (now_us - now_us % PERIOD_US) as u32, // wraps
            valid_mask: 0,
            positions_um: [0; MAX_CELLS],
        };
        for cell in 0..cells {
            let seen = is_seen(cell, cells, sample);
            capture.valid_mask |= u16::from(seen) << cell;
            // A cell is hidden in one capture at a time.
            let known = if seen { sample } else { sample.wrapping_sub(1) };
            capture.positions_um[cell] = position_um(cell, known);
        }
        capture
    }
}

/// Position of a cell at a capture, µm. The worm moves on by 100 µm with each capture and starts again every 1000 captures.
pub fn position_um(cell: usize, sample: u32) -> i32 {
    50_000 * cell as i32 + 100 * (sample % 1_000) as i32
}

/// Whether a cell is seen at a capture. The last cell is hidden in every tenth.
pub fn is_seen(cell: usize, cells: usize, sample: u32) -> bool {
    !(cell + 1 == cells && sample % 10 == 9)
}

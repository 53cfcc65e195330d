//! The tables of servo and tracker, and the exchange of a tick with devices that answer anything.

use dynamixel_bus::packet::{DeviceId, FastReplyWriter, FastSegment, MAX_PACKET_LEN, StatusFlags, StatusPacket};
use std::time::Instant;
use worm_physics::MAX_CELLS;
use wormd::link::servo::BLOCK_LEN;
use wormd::link::tracker::block_len;
use wormd::link::{ExchangePlan, Port, PortError, ReadPlan, ServoReading, TrackerQuery, TrackerReading, WormBus};

/// The bytes as a block of each device; then as what both answer in ticks, see [`Answers`].
pub(crate) fn tracker_table(data: &[u8]) {
    check_tracker_block(data);
    if let Some(block) = data.first_chunk::<BLOCK_LEN>() {
        check_servo(&ServoReading::from_block(block, data.len().is_multiple_of(2)));
    }
    for read in [ReadPlan::FastBulk, ReadPlan::Bulk, ReadPlan::Separate] {
        exchange(data, read);
    }
}

fn check_tracker_block(bytes: &[u8]) {
    let Ok(reading) = TrackerReading::from_block(bytes) else {
        return;
    };
    check_tracker(&reading);
    let again = reading.to_block();
    let again = TrackerReading::from_block(&again[..bytes.len()]);
    assert_eq!(again, Ok(reading), "written and read again");
}

fn check_tracker(reading: &TrackerReading) {
    let is_metric = |position_m: &f64| position_m.abs() <= 2148.0;
    assert!(reading.positions_m.iter().all(is_metric), "a position beyond 32 bits");
    assert!(
        reading.pitch_rad.is_none_or(|pitch_rad| pitch_rad.abs() < 6.0),
        "a pitch beyond 16 bits"
    );
    let cells = usize::from(reading.cell_count).min(MAX_CELLS);
    assert_eq!(
        u32::from(reading.valid) >> cells,
        0,
        "a cell is valid that is not tracked"
    );
}

fn check_servo(reading: &ServoReading) {
    let values = [
        reading.goal_velocity_rad_s,
        reading.duty,
        reading.current_a,
        reading.velocity_rad_s,
        reading.position_rad,
        reading.voltage_v,
        reading.temperature_c,
    ];
    assert!(values.iter().all(|value| value.is_finite()), "{reading:?}");
    assert!((-1.0..=1.0).contains(&reading.duty), "{reading:?}");
}

/// Ticks until the answers are used up.
fn exchange(data: &[u8], read: ReadPlan) {
    let (Some(servo), Some(tracker)) = (DeviceId::new(1), DeviceId::new(100)) else {
        return;
    };
    let plan = ExchangePlan {
        servo,
        tracker: Some(TrackerQuery {
            id: tracker,
            cells: 4,
            emergency_stop_mask: Some(1),
            pitch: data.first().is_some_and(|byte| byte & 1 == 1),
        }),
        read,
    };
    let mut bus = WormBus::new(Answers { rest: data });
    for _ in 0..MAX_TICKS {
        let outcome = bus.exchange(&plan, 1.0, Instant::now());
        if let Ok(reading) = &outcome.servo {
            check_servo(reading);
        }
        if let Ok(reading) = &outcome.tracker {
            check_tracker(reading);
        }
        if outcome.received_bytes == 0 {
            break;
        }
    }
}

/// Most ticks of one input.
const MAX_TICKS: usize = 200;

/// A port that answers what its bytes say. A piece of an answer begins with its kind and its length: raw bytes, a status packet
/// with a right CRC (ID, flags, data), or the fast reply of both devices with right CRCs (cut where the data ends).
struct Answers<'d> {
    rest: &'d [u8],
}

impl Answers<'_> {
    fn next_piece(&mut self, out: &mut [u8]) -> usize {
        let [kind, length, rest @ ..] = self.rest else {
            self.rest = &[];
            return 0;
        };
        let (piece, rest) = rest.split_at(usize::from(*length).min(rest.len()));
        self.rest = rest;
        match (kind % 3, piece) {
            (1, [id, flags, data @ ..]) => {
                let Some(id) = DeviceId::new(*id) else { return 0 };
                let flags = StatusFlags::from_wire(*flags);
                StatusPacket { id, flags, data }.encode(out).unwrap_or(0)
            }
            (2, [flags, data @ ..]) => fast_reply(*flags, data, out),
            _ => {
                let len = piece.len().min(out.len());
                out[..len].copy_from_slice(&piece[..len]);
                len
            }
        }
    }
}

fn fast_reply(flags: u8, data: &[u8], out: &mut [u8]) -> usize {
    let lengths = [BLOCK_LEN, block_len(4)];
    let Ok(mut writer) = FastReplyWriter::new(out, lengths.map(|length| length as u16).into_iter()) else {
        return 0;
    };
    let mut rest = data;
    for (id, length) in [1, 100].into_iter().zip(lengths) {
        let Some((data, behind)) = rest.split_at_checked(length) else {
            break;
        };
        rest = behind;
        let Some(id) = DeviceId::new(id) else { break };
        let flags = StatusFlags::from_wire(flags);
        if writer.push(FastSegment { id, flags, data }).is_err() {
            break;
        }
    }
    writer.len()
}

impl Port for Answers<'_> {
    fn send(&mut self, _: &[u8], _: Instant) -> Result<(), PortError> {
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _: Instant) -> Result<usize, PortError> {
        let mut piece = [0; 2 * MAX_PACKET_LEN];
        let len = self.next_piece(&mut piece).min(into.len());
        into[..len].copy_from_slice(&piece[..len]);
        Ok(len)
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        Ok(0)
    }

    fn set_baud_rate(&mut self, _: u32) -> Result<(), PortError> {
        Ok(())
    }
}

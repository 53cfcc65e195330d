//! The device of `examples/tracker`, byte by byte and with a clock of its own.

#[path = "../examples/tracker/capture.rs"]
mod capture;
#[path = "../examples/tracker/device.rs"]
mod device;

use capture::{PERIOD_US, is_seen, position_um};
use device::{FIRMWARE, MODEL, NO_PITCH, Tracker};
use dynamixel_bus::packet::{
    Decoder, DeviceId, FastReplyWriter, FastSegment, Instruction, InstructionPacket, MAX_PACKET_LEN, Packet, ReadSpan,
    ReadSpans, Recipient, StatusError, StatusFlags, StatusPacket,
};

const ID: u8 = 100;
const CELLS: usize = 5;

fn id(id: u8) -> DeviceId {
    DeviceId::new(id).expect("a valid ID")
}

fn instruction(recipient: Recipient, instruction: Instruction<'_>) -> Vec<u8> {
    let mut out = [0; MAX_PACKET_LEN];
    let packet = InstructionPacket { recipient, instruction };
    let len = packet.encode(&mut out).expect("it fits");
    out[..len].to_vec()
}

fn to_tracker(what: Instruction<'_>) -> Vec<u8> {
    instruction(Recipient::One(id(ID)), what)
}

fn to_all(what: Instruction<'_>) -> Vec<u8> {
    instruction(Recipient::All, what)
}

fn status_of(device: u8, data: &[u8]) -> Vec<u8> {
    let mut out = [0; MAX_PACKET_LEN];
    let status = StatusPacket {
        id: id(device),
        flags: StatusFlags::OK,
        data,
    };
    let len = status.encode(&mut out).expect("it fits");
    out[..len].to_vec()
}

/// What the tracker sends while it receives `bytes`.
fn send(tracker: &mut Tracker, bytes: &[u8], now_us: u64) -> Vec<u8> {
    let mut sent = Vec::new();
    for &byte in bytes {
        tracker.receive(byte, now_us, |answer| sent.extend_from_slice(answer));
    }
    sent
}

/// The only status in `bytes`: who sent it, its error and its data.
fn parse(bytes: &[u8]) -> (u8, Option<StatusError>, Vec<u8>) {
    let mut decoder = Decoder::new();
    assert_eq!(decoder.push(bytes), bytes.len());
    let status = match decoder.next_packet() {
        Some(Ok(Packet::Status(status))) => (status.id.get(), status.flags.error, status.data.to_vec()),
        other => panic!("{other:?} from {bytes:02X?}"),
    };
    assert!(decoder.is_empty());
    status
}

fn ask(tracker: &mut Tracker, what: Instruction<'_>, now_us: u64) -> (u8, Option<StatusError>, Vec<u8>) {
    parse(&send(tracker, &to_tracker(what), now_us))
}

fn tracker() -> Tracker {
    Tracker::new(id(ID), CELLS)
}

const READ_ID: Instruction<'static> = Instruction::Read { address: 7, length: 1 };

#[test]
fn ping_says_model_and_firmware() {
    let [low, high] = MODEL.to_le_bytes();
    assert_eq!(
        ask(&mut tracker(), Instruction::Ping, 0),
        (ID, None, vec![low, high, FIRMWARE])
    );
}

#[test]
fn broadcast_ping_is_answered_in_the_slot_of_the_id() {
    let mut tracker = tracker();
    let mut sent = send(&mut tracker, &to_all(Instruction::Ping), 1_000);
    tracker.poll(200_999, |answer| sent.extend_from_slice(answer));
    assert_eq!(sent, []);
    tracker.poll(201_000, |answer| sent.extend_from_slice(answer));
    assert_eq!(parse(&sent).0, ID);
    tracker.poll(300_000, |answer| panic!("a second answer: {answer:02X?}"));
}

#[test]
fn block_holds_one_capture() {
    // In capture 19 the last cell is hidden; its position is that of capture 18.
    for sample in [0u32, 7, 19, 1_000] {
        let now_us = u64::from(sample) * PERIOD_US + 1_234;
        let read = Instruction::Read {
            address: 128,
            length: 11 + 4 * CELLS as u16,
        };
        let (_, error, data) = ask(&mut tracker(), read, now_us);
        assert_eq!(error, None);
        let mut expected = sample.to_le_bytes().to_vec();
        expected.extend((sample * PERIOD_US as u32).to_le_bytes());
        let hides_last = sample == 19;
        expected.extend([CELLS as u8, if hides_last { 0b0_1111 } else { 0b1_1111 }, 0]);
        for cell in 0..CELLS {
            assert_eq!(is_seen(cell, CELLS, sample), !(hides_last && cell == 4));
            let known = if hides_last && cell == 4 { 18 } else { sample };
            expected.extend(position_um(cell, known).to_le_bytes());
        }
        assert_eq!(data, expected);
    }
}

#[test]
fn pitch_and_emergency_stop_are_read_in_front_of_the_capture() {
    let mut tracker = tracker();
    let read = Instruction::Read {
        address: 125,
        length: 4,
    };
    // Nothing is known before a sensor has measured it.
    for (pitch, pressed, sample) in [(NO_PITCH, false, 7), (-1234, true, 8), (9000, false, 9)] {
        if pitch != NO_PITCH {
            tracker.set_pitch(pitch);
        }
        tracker.set_emergency_stop(pressed);
        let (_, error, data) = ask(&mut tracker, read, sample * PERIOD_US);
        let [low, high] = pitch.to_le_bytes();
        assert_eq!((error, data), (None, vec![low, high, u8::from(pressed), sample as u8]));
    }
}

#[test]
fn errors_are_those_of_the_protocol() {
    let write = |address, data| Instruction::Write { address, data };
    let table: [(Instruction<'_>, Option<StatusError>); 11] = [
        (
            Instruction::Read { address: 7, length: 0 },
            Some(StatusError::DataLength),
        ),
        (
            Instruction::Read {
                address: 202,
                length: 1,
            },
            None,
        ),
        (
            Instruction::Read {
                address: 202,
                length: 2,
            },
            Some(StatusError::Access),
        ),
        (
            Instruction::Read {
                address: u16::MAX,
                length: u16::MAX,
            },
            Some(StatusError::Access),
        ),
        (write(0, &[1, 2]), Some(StatusError::Access)),
        (write(50, &[1]), Some(StatusError::Access)),
        (write(7, &[1, 0]), Some(StatusError::Access)),
        (write(7, &[]), Some(StatusError::DataLength)),
        (write(7, &[253]), Some(StatusError::DataRange)),
        (write(68, &[3]), Some(StatusError::DataRange)),
        (Instruction::Action, Some(StatusError::Instruction)),
    ];
    for (what, expected) in table {
        let (from, error, _) = ask(&mut tracker(), what, 0);
        assert_eq!((from, error), (ID, expected), "{what:?}");
    }
    // An instruction that no codec knows, with a valid CRC.
    let unknown = [0xFF, 0xFF, 0xFD, 0x00, ID, 0x03, 0x00, 0x77];
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_UMTS).checksum(&unknown).to_le_bytes();
    let sent = send(&mut tracker(), &[&unknown[..], &crc].concat(), 0);
    assert_eq!(parse(&sent).1, Some(StatusError::Instruction));
}

#[test]
fn id_can_be_changed() {
    let mut tracker = tracker();
    assert_eq!(
        ask(&mut tracker, Instruction::Write { address: 7, data: &[9] }, 0),
        (ID, None, vec![])
    );
    assert_eq!(send(&mut tracker, &to_tracker(Instruction::Ping), 0), []);
    let ping = instruction(Recipient::One(id(9)), READ_ID);
    assert_eq!(parse(&send(&mut tracker, &ping, 0)), (9, None, vec![9]));
}

#[test]
fn status_return_level_decides_what_is_answered() {
    // (level, answers: ping, read, write, fast bulk read)
    for (level, expected) in [
        (2, [true; 4]),
        (1, [true, true, false, true]),
        (0, [true, false, false, false]),
    ] {
        let mut tracker = tracker();
        let set = Instruction::Write {
            address: 68,
            data: &[level],
        };
        assert_eq!(ask(&mut tracker, set, 0).1, None, "answered at the level of before");
        let wire = [span(ID, 7, 1).to_wire()];
        let fast = to_all(Instruction::FastBulkRead(ReadSpans::from_valid(&wire)));
        let found = [
            to_tracker(Instruction::Ping),
            to_tracker(READ_ID),
            to_tracker(Instruction::Write {
                address: 7,
                data: &[ID],
            }),
            fast,
        ]
        .map(|request| !send(&mut tracker, &request, 0).is_empty());
        assert_eq!(found, expected, "level {level}");
        let raise = Instruction::Write {
            address: 68,
            data: &[2],
        };
        assert_eq!(ask(&mut tracker, raise, 0).1, None, "answered at the level of after");
    }
}

#[test]
fn sync_and_bulk_writes_and_broadcasts_are_obeyed_silently() {
    use dynamixel_bus::packet::{BulkWrites, SyncWrites};
    let level = |tracker: &mut Tracker| ask(tracker, Instruction::Read { address: 68, length: 1 }, 0).2;
    let mut tracker = tracker();
    let writes = SyncWrites::new(1, &[1, 0, ID, 1]).expect("records");
    assert_eq!(
        send(&mut tracker, &to_all(Instruction::SyncWrite { address: 68, writes }), 0),
        []
    );
    assert_eq!(level(&mut tracker), [1]);
    let writes = BulkWrites::new(&[ID, 68, 0, 1, 0, 2]).expect("records");
    assert_eq!(send(&mut tracker, &to_all(Instruction::BulkWrite(writes)), 0), []);
    assert_eq!(level(&mut tracker), [2]);
    assert_eq!(
        send(
            &mut tracker,
            &to_all(Instruction::Write {
                address: 68,
                data: &[1]
            }),
            0
        ),
        []
    );
    assert_eq!(level(&mut tracker), [1]);
}

fn span(device: u8, address: u16, length: u16) -> ReadSpan {
    ReadSpan {
        id: id(device),
        address,
        length,
    }
}

#[test]
fn plain_reads_of_several_devices_are_answered_in_turn() {
    let wire = [span(1, 98, 2), span(ID, 7, 1), span(2, 98, 2)].map(ReadSpan::to_wire);
    let bulk = to_all(Instruction::BulkRead(ReadSpans::from_valid(&wire)));
    let sync = to_all(Instruction::SyncRead {
        address: 7,
        length: 1,
        ids: &[1, ID, 2],
    });
    for request in [bulk, sync] {
        let mut tracker = tracker();
        assert_eq!(send(&mut tracker, &request, 0), []);
        assert_eq!(
            send(&mut tracker, &status_of(3, &[0; 2]), 100),
            [],
            "not the one before"
        );
        let sent = send(&mut tracker, &status_of(1, &[0; 2]), 100);
        assert_eq!(parse(&sent), (ID, None, vec![ID]));
        assert_eq!(send(&mut tracker, &status_of(1, &[0; 2]), 100), [], "only once");
    }
    let first = to_all(Instruction::SyncRead {
        address: 7,
        length: 1,
        ids: &[ID, 1],
    });
    assert_eq!(parse(&send(&mut tracker(), &first, 0)).0, ID);
    let not_asked = to_all(Instruction::SyncRead {
        address: 7,
        length: 1,
        ids: &[1, 2],
    });
    let behind_nobody = to_all(Instruction::SyncRead {
        address: 7,
        length: 1,
        ids: &[253, ID],
    });
    for request in [not_asked, behind_nobody] {
        let mut tracker = tracker();
        assert_eq!(send(&mut tracker, &[request, status_of(1, &[0])].concat(), 0), []);
    }
}

/// A fast reply of three devices, the tracker in the middle.
fn fast_reply() -> ([[u8; ReadSpan::WIRE_LEN]; 3], Vec<u8>, [usize; 4]) {
    let spans = [span(1, 98, 49), span(ID, 128, 31), span(2, 98, 10)];
    // The tracker's own codec wrote this at time 0: see `block_holds_one_capture`.
    let mut own = vec![0; 8];
    own.extend([CELLS as u8, 0b1_1111, 0]);
    (0..CELLS).for_each(|cell| own.extend(position_um(cell, 0).to_le_bytes()));
    // A header within the data, which nothing is stuffed against, must not confuse the listener.
    let mut servo = [0xA5; 49];
    servo[20..24].copy_from_slice(&[0xFF, 0xFF, 0xFD, 0x00]);
    let mut out = [0; MAX_PACKET_LEN];
    let mut writer = FastReplyWriter::new(&mut out, spans.iter().map(|span| span.length)).expect("it fits");
    let mut ends = [0, writer.len(), 0, 0];
    for (device, data) in [(1, &servo[..]), (ID, &own), (2, &[7; 10])] {
        let segment = FastSegment {
            id: id(device),
            flags: StatusFlags::OK,
            data,
        };
        writer.push(segment).expect("as asked");
        let end = if device == 1 {
            1
        } else if device == ID {
            2
        } else {
            3
        };
        ends[end] = writer.len();
    }
    let len = ends[3];
    (spans.map(ReadSpan::to_wire), out[..len].to_vec(), ends)
}

#[test]
fn segment_of_a_fast_reply_follows_the_one_before() {
    let (wire, reply, [_, before, behind, end]) = fast_reply();
    let request = to_all(Instruction::FastBulkRead(ReadSpans::from_valid(&wire)));
    let mut tracker = tracker();
    assert_eq!(send(&mut tracker, &request, 0), []);
    assert_eq!(
        send(&mut tracker, &reply[..before - 1], 100),
        [],
        "not before the last byte"
    );
    assert_eq!(
        send(&mut tracker, &reply[before - 1..before], 200),
        reply[before..behind]
    );
    // The devices behind it go on, and the next request is understood.
    assert_eq!(send(&mut tracker, &reply[behind..end], 300), []);
    assert_eq!(ask(&mut tracker, READ_ID, 300).2, [ID]);
}

#[test]
fn first_of_a_fast_reply_sends_the_header() {
    let sync = to_all(Instruction::FastSyncRead {
        address: 7,
        length: 1,
        ids: &[ID, 1],
    });
    let sent = send(&mut tracker(), &sync, 0);
    let mut out = [0; MAX_PACKET_LEN];
    let mut writer = FastReplyWriter::new(&mut out, [1, 1].into_iter()).expect("it fits");
    let segment = FastSegment {
        id: id(ID),
        flags: StatusFlags::OK,
        data: &[ID],
    };
    writer.push(segment).expect("as asked");
    let len = writer.len();
    assert_eq!(sent, out[..len]);
}

#[test]
fn nothing_follows_a_damaged_segment() {
    let (wire, reply, [_, before, ..]) = fast_reply();
    let request = to_all(Instruction::FastBulkRead(ReadSpans::from_valid(&wire)));
    for damaged in [4, 30, before - 1] {
        let mut tracker = tracker();
        let mut reply = reply[..before].to_vec();
        reply[damaged] ^= 0x10;
        assert_eq!(send(&mut tracker, &request, 0), []);
        assert_eq!(send(&mut tracker, &reply, 100), [], "byte {damaged}");
        // The line is idle, then the controller asks again.
        assert_eq!(ask(&mut tracker, READ_ID, 20_000).2, [ID]);
    }
}

#[test]
fn request_after_a_silent_device_is_answered() {
    let (wire, reply, [_, before, ..]) = fast_reply();
    let request = to_all(Instruction::FastBulkRead(ReadSpans::from_valid(&wire)));
    // The device before falls silent at once, or in the middle.
    for heard in [0, 3, 20] {
        let mut tracker = tracker();
        assert_eq!(send(&mut tracker, &request, 0), []);
        assert_eq!(send(&mut tracker, &reply[..heard], 100), []);
        assert_eq!(ask(&mut tracker, READ_ID, 20_000).2, [ID], "after {heard} bytes");
        // What was waited for is not waited for any longer.
        assert_eq!(send(&mut tracker, &reply[..before], 20_100), []);
    }
}

#[test]
fn damaged_packets_and_those_of_others_are_ignored() {
    let good = to_tracker(READ_ID);
    for byte in 0..good.len() {
        let mut damaged = good.clone();
        damaged[byte] ^= 0x04;
        let mut tracker = tracker();
        assert_eq!(send(&mut tracker, &damaged, 0), [], "byte {byte}");
        assert_eq!(ask(&mut tracker, READ_ID, 20_000).2, [ID], "byte {byte}");
    }
    let mut tracker = tracker();
    assert_eq!(
        send(&mut tracker, &instruction(Recipient::One(id(1)), Instruction::Ping), 0),
        []
    );
    assert_eq!(send(&mut tracker, &status_of(1, &[1, 2, 3]), 0), []);
    assert_eq!(send(&mut tracker, b"noise\xFF\xFF\xFD", 0), []);
    assert_eq!(ask(&mut tracker, READ_ID, 0).2, [ID], "right behind noise");
}

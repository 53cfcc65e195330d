//! Byte-exact vectors of the maker's manual, and properties that hold for any bytes.

use super::*;
use proptest::prelude::*;

fn device(id: u8) -> DeviceId {
    DeviceId::new(id).expect("a valid ID")
}

fn to(id: u8, instruction: Instruction<'_>) -> InstructionPacket<'_> {
    InstructionPacket {
        recipient: Recipient::from_wire(id).expect("a valid ID"),
        instruction,
    }
}

fn answer(id: u8, data: &[u8]) -> StatusPacket<'_> {
    StatusPacket {
        id: device(id),
        flags: StatusFlags::OK,
        data,
    }
}

fn span(id: u8, address: u16, length: u16) -> ReadSpan {
    ReadSpan {
        id: device(id),
        address,
        length,
    }
}

fn bytes_of(hex: &str) -> Vec<u8> {
    hex.split_whitespace()
        .map(|byte| u8::from_str_radix(byte, 16).expect("hexadecimal"))
        .collect()
}

fn decode_one(bytes: &[u8], check: impl FnOnce(Packet<'_>)) {
    let mut decoder = Decoder::new();
    assert_eq!(decoder.push(bytes), bytes.len());
    check(decoder.next_packet().expect("a packet").expect("a valid packet"));
    assert!(decoder.next_packet().is_none());
    assert_eq!((decoder.is_empty(), decoder.garbage_bytes()), (true, 0));
}

/// e-manual "Protocol 2.0", the examples of each instruction.
#[test]
fn instructions_of_the_manual() {
    let bulk_read = [span(1, 144, 2).to_wire(), span(2, 146, 1).to_wire()];
    let fast_bulk_read = [
        span(3, 132, 4).to_wire(),
        span(7, 124, 2).to_wire(),
        span(4, 146, 1).to_wire(),
    ];
    let bulk_write = bytes_of("01 20 00 02 00 A0 00 02 1F 00 01 00 50");
    let sync_write = bytes_of("01 96 00 00 00 02 AA 00 00 00");
    let table = [
        (to(1, Instruction::Ping), "FF FF FD 00 01 03 00 01 19 4E"),
        (to(254, Instruction::Ping), "FF FF FD 00 FE 03 00 01 31 42"),
        (
            to(
                1,
                Instruction::Read {
                    address: 132,
                    length: 4,
                },
            ),
            "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15",
        ),
        (
            to(
                1,
                Instruction::Write {
                    address: 116,
                    data: &[0, 2, 0, 0],
                },
            ),
            "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89",
        ),
        (
            to(
                1,
                Instruction::RegWrite {
                    address: 104,
                    data: &[0xC8, 0, 0, 0],
                },
            ),
            "FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E",
        ),
        (to(1, Instruction::Action), "FF FF FD 00 01 03 00 05 02 CE"),
        (
            to(1, Instruction::FactoryReset(ResetScope::AllButId)),
            "FF FF FD 00 01 04 00 06 01 A1 E6",
        ),
        (to(1, Instruction::Reboot), "FF FF FD 00 01 03 00 08 2F 4E"),
        (
            to(1, Instruction::ClearMultiTurn),
            "FF FF FD 00 01 08 00 10 01 44 58 4C 22 B1 DC",
        ),
        (
            to(1, Instruction::ControlTableBackup(BackupAction::Store)),
            "FF FF FD 00 01 08 00 20 01 43 54 52 4C 16 F5",
        ),
        (
            // The manual prints 92 F5; the CRC of the official SDK says otherwise.
            to(1, Instruction::ControlTableBackup(BackupAction::Restore)),
            "FF FF FD 00 01 08 00 20 02 43 54 52 4C 9E F5",
        ),
        (
            to(
                254,
                Instruction::SyncRead {
                    address: 132,
                    length: 4,
                    ids: &[1, 2],
                },
            ),
            "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA",
        ),
        (
            to(
                254,
                Instruction::SyncWrite {
                    address: 116,
                    writes: SyncWrites::new(4, &sync_write).expect("whole"),
                },
            ),
            "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87",
        ),
        (
            to(
                254,
                Instruction::FastSyncRead {
                    address: 132,
                    length: 4,
                    ids: &[3, 7, 4],
                },
            ),
            "FF FF FD 00 FE 0A 00 8A 84 00 04 00 03 07 04 20 F2",
        ),
        (
            to(
                254,
                Instruction::BulkRead(ReadSpans::new(&bulk_read).expect("valid IDs")),
            ),
            "FF FF FD 00 FE 0D 00 92 01 90 00 02 00 02 92 00 01 00 1A 05",
        ),
        (
            to(
                254,
                Instruction::BulkWrite(BulkWrites::new(&bulk_write).expect("whole")),
            ),
            "FF FF FD 00 FE 10 00 93 01 20 00 02 00 A0 00 02 1F 00 01 00 50 B7 68",
        ),
        (
            // The manual prints the CRC of its fast sync read here (20 F2); this is what the official SDK sends.
            to(
                254,
                Instruction::FastBulkRead(ReadSpans::new(&fast_bulk_read).expect("valid IDs")),
            ),
            "FF FF FD 00 FE 12 00 9A 03 84 00 04 00 07 7C 00 02 00 04 92 00 01 00 DA 2D",
        ),
    ];
    for (packet, hex) in table {
        let expected = bytes_of(hex);
        let mut out = [0; MAX_PACKET_LEN];
        let len = packet.encode(&mut out).expect("it fits");
        assert_eq!(out[..len], expected, "{packet:?}");
        decode_one(&expected, |decoded| assert_eq!(decoded, Packet::Instruction(packet)));
    }
}

/// e-manual "Protocol 2.0", the answers in the same examples.
#[test]
fn answers_of_the_manual() {
    let table = [
        (
            answer(1, &[0x06, 0x04, 0x26]),
            "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D",
        ),
        (
            answer(2, &[0x06, 0x04, 0x26]),
            "FF FF FD 00 02 07 00 55 00 06 04 26 6F 6D",
        ),
        (
            answer(1, &[0xA6, 0, 0, 0]),
            "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0",
        ),
        (answer(1, &[]), "FF FF FD 00 01 04 00 55 00 A1 0C"),
        (
            answer(2, &[0x1F, 0x08, 0, 0]),
            "FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE",
        ),
        (answer(1, &[0x77, 0]), "FF FF FD 00 01 06 00 55 00 77 00 C3 69"),
        (answer(2, &[0x24]), "FF FF FD 00 02 05 00 55 00 24 8B A9"),
    ];
    for (packet, hex) in table {
        let expected = bytes_of(hex);
        let mut out = [0; MAX_PACKET_LEN];
        let len = packet.encode(&mut out).expect("it fits");
        assert_eq!(out[..len], expected, "{packet:?}");
        decode_one(&expected, |decoded| assert_eq!(decoded, Packet::Status(packet)));
    }
}

/// e-manual "Fast Bulk Read" and "Fast Sync Read": three devices' segments, each with the CRC of all before it.
#[test]
fn fast_replies_of_the_manual() {
    let bulk = "FF FF FD 00 FE 14 00 55 00 03 A6 00 00 00 67 A4  00 07 A5 01 24 74  00 04 1F D9 C1";
    let spans = [span(3, 132, 4), span(7, 124, 2), span(4, 146, 1)];
    let data: [&[u8]; 3] = [&[0xA6, 0, 0, 0], &[0xA5, 1], &[0x1F]];
    let expected = bytes_of(bulk);
    let mut out = [0; MAX_PACKET_LEN];
    let mut writer = FastReplyWriter::new(&mut out, spans.iter().map(|span| span.length)).expect("it fits");
    for (span, data) in spans.iter().zip(data) {
        writer
            .push(FastSegment {
                id: span.id,
                flags: StatusFlags::OK,
                data,
            })
            .expect("of the length asked for");
    }
    let len = writer.len();
    assert_eq!(out[..len], expected);
    decode_one(&expected, |packet| {
        let Packet::FastReply(reply) = packet else {
            panic!("a fast reply, not {packet:?}")
        };
        let read: Vec<_> = reply
            .segments(spans)
            .map(|segment| segment.expect("intact").data)
            .collect();
        assert_eq!(read, data);
    });
}

#[test]
fn fast_reply_cut_short_yields_the_devices_before_the_cut() {
    let whole = bytes_of("FF FF FD 00 FE 14 00 55 00 03 A6 00 00 00 67 A4 00 07 A5 01 24 74 00 04 1F D9 C1");
    let spans = [span(3, 132, 4), span(7, 124, 2), span(4, 146, 1)];
    for cut in 0..whole.len() {
        let good = [16, 22].iter().filter(|&&segment_end| cut >= segment_end).count();
        let mut decoder = Decoder::new();
        decoder.push(&whole[..cut]);
        assert!(decoder.next_packet().is_none());
        let found = decoder
            .unfinished_fast_reply()
            .map(|reply| reply.segments(spans).collect::<Vec<_>>());
        let Some(segments) = found else {
            assert!(cut < 8, "a header of a fast reply is 8 bytes");
            continue;
        };
        for (at, segment) in segments.iter().enumerate() {
            let expected = if at < good {
                None
            } else {
                Some(SegmentError::Missing(spans[at].id))
            };
            assert_eq!(segment.err(), expected, "cut at {cut}");
        }
    }
}

#[test]
fn damaged_fast_reply_yields_the_devices_before_the_damage() {
    let mut bytes = bytes_of("FF FF FD 00 FE 14 00 55 00 03 A6 00 00 00 67 A4 00 07 A5 01 24 74 00 04 1F D9 C1");
    bytes[18] ^= 1;
    let spans = [span(3, 132, 4), span(7, 124, 2), span(4, 146, 1)];
    let mut decoder = Decoder::new();
    decoder.push(&bytes);
    let Some(Ok(Packet::FastReply(reply))) = decoder.next_packet() else {
        panic!("a fast reply")
    };
    assert!(!reply.is_intact());
    let errors: Vec<_> = reply.segments(spans).map(|segment| segment.err()).collect();
    assert_eq!(
        errors,
        [
            None,
            Some(SegmentError::Crc(device(7))),
            Some(SegmentError::Crc(device(4)))
        ]
    );
}

#[test]
fn fast_reply_of_the_wrong_device_is_refused() {
    let whole = bytes_of("FF FF FD 00 FE 14 00 55 00 03 A6 00 00 00 67 A4 00 07 A5 01 24 74 00 04 1F D9 C1");
    decode_one(&whole, |packet| {
        let Packet::FastReply(reply) = packet else {
            panic!("a fast reply, not {packet:?}")
        };
        let mut segments = reply.segments([span(9, 132, 4), span(7, 124, 2)]);
        assert_eq!(
            segments.next(),
            Some(Err(SegmentError::WrongId {
                expected: device(9),
                found: 3
            }))
        );
        assert_eq!(segments.next(), Some(Err(SegmentError::Missing(device(7)))));
    });
}

#[test]
fn header_in_a_payload_is_stuffed() {
    let packet = answer(1, &[0xFF, 0xFF, 0xFD, 0xFD, 0xFF, 0xFF, 0xFD]);
    let mut out = [0; MAX_PACKET_LEN];
    let len = packet.encode(&mut out).expect("it fits");
    assert_eq!(out[9..len - 2], bytes_of("FF FF FD FD FD FF FF FD FD"));
    decode_one(&out[..len], |decoded| assert_eq!(decoded, Packet::Status(packet)));
}

#[test]
fn error_byte_both_ways() {
    for byte in 0..=u8::MAX {
        assert_eq!(StatusFlags::from_wire(byte).to_wire(), byte);
    }
    let flags = StatusFlags::from_wire(0x87);
    assert_eq!(
        flags,
        StatusFlags {
            alert: true,
            error: Some(StatusError::Access)
        }
    );
}

#[test]
fn malformed_instructions_say_what_is_wrong() {
    let unknown = MalformedInstruction::UnknownCode { code: 0x77 };
    let short = MalformedInstruction::Parameters {
        code: 0x02,
        parameter_len: 3,
    };
    for (code, parameters, error) in [(0x77, &[][..], unknown), (0x02, &[1, 2, 3][..], short)] {
        let mut out = [0; MAX_PACKET_LEN];
        let mut writer = encode::PacketWriter::new(&mut out, 5, code);
        writer.bytes(parameters);
        let len = writer.finish().expect("it fits");
        let mut decoder = Decoder::new();
        decoder.push(&out[..len]);
        let recipient = Recipient::One(device(5));
        assert_eq!(
            decoder.next_packet(),
            Some(Err(DecodeError::Instruction { recipient, error }))
        );
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let packet = to(1, Instruction::Ping);
    assert_eq!(packet.encode(&mut [0; 10]), Ok(10));
    for buffer_len in 0..10 {
        assert_eq!(
            packet.encode(&mut vec![0; buffer_len]),
            Err(EncodeError::BufferTooSmall { buffer_len })
        );
    }
    let data = [0; MAX_PACKET_LEN];
    assert_eq!(
        answer(1, &data).encode(&mut [0; 2 * MAX_PACKET_LEN]),
        Err(EncodeError::TooLong)
    );
    assert_eq!(
        FastReplyWriter::new(&mut [0; 2000], [600].into_iter()).err(),
        Some(EncodeError::TooLong)
    );
}

#[test]
fn damaged_length_does_not_swallow_the_next_packet() {
    let mut bytes = bytes_of("FF FF FD 00 01 04 00 55 00 A1 0C");
    bytes[5] = 15; // reaches to the end of the packet behind it
    bytes.extend(bytes_of("FF FF FD 00 02 05 00 55 00 24 8B A9"));
    bytes.truncate(22 + 1);
    let mut decoder = Decoder::new();
    decoder.push(&bytes);
    assert_eq!(
        decoder.next_packet(),
        Some(Err(DecodeError::Crc { id: 1, packet_len: 22 }))
    );
    assert_eq!(decoder.next_packet(), Some(Ok(Packet::Status(answer(2, &[0x24])))));
    assert_eq!(decoder.garbage_bytes(), 11);
}

#[test]
fn unfinished_packet_can_be_given_up() {
    let mut decoder = Decoder::new();
    decoder.push(&bytes_of("FF FF FD 00 01 FF 00 55 FF FF FD 00 01 03 00 01 19 4E"));
    assert_eq!(decoder.next_packet(), None);
    decoder.give_up_unfinished();
    assert_eq!(
        decoder.next_packet(),
        Some(Ok(Packet::Instruction(to(1, Instruction::Ping))))
    );
}

/// Bytes of which headers and stuffing are made, so that they meet often.
fn awkward_bytes(max_len: usize) -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![4 => Just(0xFF), 3 => Just(0xFD), 1 => Just(0x00), 1 => Just(0x55), 2 => any::<u8>()];
    prop::collection::vec(byte, 0..max_len)
}

proptest! {
    #[test]
    fn any_status_comes_back(id in 0u8..=252, flags in any::<u8>(), data in awkward_bytes(300)) {
        let packet = StatusPacket { id: device(id), flags: StatusFlags::from_wire(flags), data: &data };
        let mut out = [0; MAX_PACKET_LEN];
        let len = packet.encode(&mut out).expect("it fits");
        decode_one(&out[..len], |decoded| assert_eq!(decoded, Packet::Status(packet)));
    }

    #[test]
    fn any_write_comes_back(id in 0u8..=252, address in any::<u16>(), data in awkward_bytes(300)) {
        let packet = to(id, Instruction::Write { address, data: &data });
        let mut out = [0; MAX_PACKET_LEN];
        let len = packet.encode(&mut out).expect("it fits");
        decode_one(&out[..len], |decoded| assert_eq!(decoded, Packet::Instruction(packet)));
    }

    #[test]
    fn any_fast_reply_comes_back(first in awkward_bytes(100), second in awkward_bytes(100)) {
        let spans = [span(1, 98, first.len() as u16), span(100, 128, second.len() as u16)];
        let mut out = [0; MAX_PACKET_LEN];
        let mut writer = FastReplyWriter::new(&mut out, spans.iter().map(|span| span.length)).expect("it fits");
        for (span, data) in spans.iter().zip([&first, &second]) {
            writer.push(FastSegment { id: span.id, flags: StatusFlags::OK, data }).expect("of the length asked for");
        }
        let len = writer.len();
        decode_one(&out[..len], |packet| {
            let Packet::FastReply(reply) = packet else { panic!("a fast reply, not {packet:?}") };
            let read: Vec<_> = reply.segments(spans).map(|segment| segment.expect("intact").data).collect();
            assert_eq!(read, [&first[..], &second[..]]);
        });
    }

    /// Whatever comes, however cut: no panic, room for more, and a good packet behind it is found in the end.
    #[test]
    fn decoder_survives_anything(noise in awkward_bytes(3000), chunk in 1usize..200) {
        let ping = bytes_of("FF FF FD 00 01 03 00 01 19 4E");
        let mut decoder = Decoder::new();
        let mut stream = noise;
        // As much as the longest damaged length can swallow.
        stream.extend(core::iter::repeat_n(ping, 60).flatten());
        let mut last_was_ping = false;
        for mut piece in stream.chunks(chunk) {
            while !piece.is_empty() {
                let taken = decoder.push(piece);
                prop_assert!(taken > 0);
                piece = &piece[taken..];
                while let Some(packet) = decoder.next_packet() {
                    last_was_ping = packet == Ok(Packet::Instruction(to(1, Instruction::Ping)));
                }
            }
        }
        prop_assert!(last_was_ping);
        decoder.unfinished_fast_reply();
        decoder.give_up_unfinished();
    }
}

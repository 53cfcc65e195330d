//! The packets of the servo bus.

use dynamixel_bus::packet::{Decoder, DeviceId, MAX_PACKET_LEN, Packet, ReadSpan};

/// A stream of bytes, as it comes from a line with noise on it. The first byte says how it is cut.
pub(crate) fn packets(data: &[u8]) {
    let Some((&cut, stream)) = data.split_first() else {
        return;
    };
    let whole = decoded(stream, MAX_PACKET_LEN);
    let pieces = decoded(stream, usize::from(cut).max(1));
    assert_eq!(whole, pieces, "what comes out depends on how the stream was cut");
}

/// Everything that comes out of a stream which arrives in pieces of so many bytes.
fn decoded(stream: &[u8], piece_len: usize) -> Vec<String> {
    let mut decoder = Decoder::new();
    let mut seen = Vec::new();
    for piece in stream.chunks(piece_len) {
        let mut rest = piece;
        while !rest.is_empty() {
            let taken = decoder.push(rest);
            rest = &rest[taken..];
            let mut is_stuck = taken == 0;
            while let Some(found) = decoder.next_packet() {
                is_stuck = false;
                match found {
                    Ok(packet) => {
                        check(&packet);
                        seen.push(summary(&packet));
                    }
                    Err(error) => seen.push(error.to_string()),
                }
            }
            assert!(!is_stuck, "a decoder that takes nothing and gives nothing");
        }
    }
    // The end of a wait, and an idle line.
    if let Some(reply) = decoder.unfinished_fast_reply() {
        check(&Packet::FastReply(reply));
    }
    while !decoder.is_empty() {
        decoder.give_up_unfinished();
        while let Some(found) = decoder.next_packet() {
            if let Ok(packet) = found {
                check(&packet);
            }
        }
    }
    assert!(
        decoder.garbage_bytes() <= stream.len() as u64,
        "more garbage than bytes"
    );
    seen
}

/// A short text that differs for packets that differ.
fn summary(packet: &Packet<'_>) -> String {
    let mut wire = [0; 2 * MAX_PACKET_LEN];
    let len = match packet {
        Packet::Instruction(instruction) => instruction.encode(&mut wire),
        Packet::Status(status) => status.encode(&mut wire),
        Packet::FastReply(reply) => return format!("fast reply, intact: {}", reply.is_intact()),
    };
    let len = len.unwrap_or(0);
    let sum = wire[..len]
        .iter()
        .fold(0u64, |sum, &byte| sum.wrapping_mul(31).wrapping_add(u64::from(byte)));
    format!("{len} bytes, {sum:x}")
}

/// A packet that came out of the decoder can be encoded, and that decodes to the same.
fn check(packet: &Packet<'_>) {
    let mut wire = [0; 2 * MAX_PACKET_LEN];
    let len = match packet {
        Packet::Instruction(instruction) => instruction.encode(&mut wire),
        Packet::Status(status) => status.encode(&mut wire),
        Packet::FastReply(reply) => {
            let spans = [(1, 49), (100, 27), (2, 0), (3, u16::MAX)];
            let spans = spans.into_iter().filter_map(|(id, length)| {
                Some(ReadSpan {
                    id: DeviceId::new(id)?,
                    address: 98,
                    length,
                })
            });
            for segment in reply.segments(spans).flatten() {
                assert!(segment.data.len() <= MAX_PACKET_LEN, "a segment beyond its packet");
            }
            return;
        }
    };
    // A sender that did not stuff leaves a packet that is longer when it is stuffed.
    let Ok(len) = len else { return };
    let mut decoder = Decoder::new();
    decoder.push(&wire[..len]);
    assert_eq!(decoder.next_packet(), Some(Ok(*packet)), "encoded and decoded again");
    assert!(decoder.is_empty(), "bytes are left of a whole packet");
}

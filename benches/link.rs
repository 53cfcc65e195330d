//! What a tick's packets cost: request encoded, reply decoded to readings. Target: 1 µs together.

#[expect(dead_code, reason = "of the hot paths this bench takes the reply alone")]
mod hot_paths;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use dynamixel_bus::packet::{
    Decoder, DeviceId, Instruction, InstructionPacket, MAX_PACKET_LEN, Packet, ReadSpan, ReadSpans, Recipient,
};
use hot_paths::fast_reply;
use wormd::link::{ServoReading, TrackerReading, servo, tracker};

const CELLS: usize = 5;

fn spans() -> [ReadSpan; 2] {
    let id = |id| DeviceId::new(id).expect("a valid ID");
    [servo::block_span(id(1)), tracker::block_span(id(100), CELLS)]
}

/// Goal velocity and fast bulk read, one behind the other.
fn encode_request(spans: &[ReadSpan; 2], goal_rad_s: f64, out: &mut [u8]) -> usize {
    let counts = servo::scale::velocity_counts(goal_rad_s).to_le_bytes();
    let goal = Instruction::Write {
        address: servo::register::GOAL_VELOCITY.address,
        data: &counts,
    };
    let wire = spans.map(ReadSpan::to_wire);
    let read = Instruction::FastBulkRead(ReadSpans::new(&wire).expect("valid IDs"));
    let mut len = 0;
    for (recipient, instruction) in [(Recipient::One(spans[0].id), goal), (Recipient::All, read)] {
        len += InstructionPacket { recipient, instruction }
            .encode(&mut out[len..])
            .expect("it fits");
    }
    len
}

fn decode_reply(decoder: &mut Decoder, spans: [ReadSpan; 2], bytes: &[u8]) -> (ServoReading, TrackerReading) {
    decoder.push(bytes);
    let Some(Ok(Packet::FastReply(reply))) = decoder.next_packet() else {
        panic!("a fast reply")
    };
    let mut segments = reply.segments(spans);
    let servo = segments.next().expect("two").expect("intact");
    let block = servo.data.try_into().expect("a servo block");
    let tracker = segments.next().expect("two").expect("intact");
    (
        ServoReading::from_block(block, servo.flags.alert),
        TrackerReading::from_block(tracker.data).expect("a tracker block"),
    )
}

fn tick(criterion: &mut Criterion) {
    let spans = spans();
    let reply = &fast_reply(spans)[..];
    let mut request = [0; MAX_PACKET_LEN];
    let mut decoder = Decoder::new();
    criterion.bench_function("link/encode a tick's request", |bencher| {
        bencher.iter(|| encode_request(black_box(&spans), black_box(2.5), black_box(&mut request)));
    });
    criterion.bench_function("link/decode a tick's reply", |bencher| {
        bencher.iter(|| decode_reply(&mut decoder, black_box(spans), black_box(reply)));
    });
    criterion.bench_function("link/both", |bencher| {
        bencher.iter(|| {
            encode_request(black_box(&spans), black_box(2.5), black_box(&mut request));
            decode_reply(&mut decoder, black_box(spans), black_box(reply))
        });
    });
}

criterion_group!(benches, tick);
criterion_main!(benches);

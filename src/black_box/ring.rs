//! The compressed last minute.

use std::collections::VecDeque;
use worm_log::Chunk;

/// A chunk, and when it was made.
#[derive(Debug, Clone)]
pub(super) struct Held {
    /// The messages.
    pub chunk: Chunk,
    /// When the last of them was read from its topic, ns of `CLOCK_MONOTONIC`.
    pub taken_ns: u64,
}

/// The newest chunks, bounded in time and in memory.
#[derive(Debug)]
pub(super) struct Ring {
    chunks: VecDeque<Held>,
    bytes: usize,
    longest_ns: u64,
    max_bytes: usize,
}

impl Ring {
    /// Keeps `longest_ns`, and never more than `max_bytes`.
    pub(super) fn new(longest_ns: u64, max_bytes: usize) -> Self {
        Self {
            chunks: VecDeque::new(),
            bytes: 0,
            longest_ns,
            max_bytes,
        }
    }

    /// Adds the newest chunk, and forgets what is too old or too much.
    pub(super) fn push(&mut self, held: Held) {
        let oldest_ns = held.taken_ns.saturating_sub(self.longest_ns);
        self.bytes += held.chunk.bytes().len();
        self.chunks.push_back(held);
        // What was taken before the span began holds nothing of it.
        while let Some(front) = self.chunks.front()
            && (front.taken_ns < oldest_ns || self.bytes > self.max_bytes)
            && self.chunks.len() > 1
        {
            self.bytes -= front.chunk.bytes().len();
            self.chunks.pop_front();
        }
    }

    /// The chunks with anything that came after this time, the oldest first.
    pub(super) fn since(&self, time_ns: u64) -> impl Iterator<Item = &Held> {
        self.chunks.iter().filter(move |held| held.taken_ns >= time_ns)
    }

    /// Memory that the chunks take, bytes.
    pub(super) const fn bytes(&self) -> usize {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use worm_estimator::message::State;
    use worm_log::ChunkWriter;

    fn chunk(writer: &mut ChunkWriter, second: u64) -> Held {
        let state = State {
            time_ns: second * 1_000_000_000,
            ..State::unknown(4)
        };
        writer.write(&state).expect("in memory");
        Held {
            chunk: writer.take().expect("in memory").expect("a message"),
            taken_ns: second * 1_000_000_000,
        }
    }

    #[test]
    fn it_holds_its_time_and_never_more_than_its_memory() {
        let mut writer = ChunkWriter::new(0).expect("a compressor");
        let mut ring = Ring::new(60_000_000_000, 1 << 20);
        for second in 1..=1000 {
            ring.push(chunk(&mut writer, second));
        }
        let held: Vec<u64> = ring.since(0).map(|held| held.taken_ns / 1_000_000_000).collect();
        assert_eq!(held, (940..=1000).collect::<Vec<_>>());
        assert_eq!(ring.since(990_000_000_000).count(), 11);

        let bytes = ring.bytes();
        let mut small = Ring::new(u64::MAX, bytes / 2);
        for second in 1..=1000 {
            small.push(chunk(&mut writer, second));
            assert!(small.bytes() <= bytes / 2);
        }
        assert!(
            (25..=31).contains(&small.since(0).count()),
            "{}",
            small.since(0).count()
        );
    }
}

//! Inputs made from good ones: bits flipped, pieces cut out, repeated and mixed, lengths and numbers replaced by those that hurt.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Numbers that hurt as lengths and counts, in as many bytes as they take.
const COUNTS: [u64; 12] = [
    0,
    1,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0x8000,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    0x7fff_ffff_ffff_ffff,
    u64::MAX,
];
/// Numbers that hurt as text.
const NUMBERS: [&str; 16] = [
    "0",
    "-0.0",
    "-1",
    "nan",
    "-nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "5e-324",
    "1e400",
    "99999999999999999999",
    "null",
    "\"Infinity\"",
    "",
    "0x7fffffffffffffff",
];
/// Most bytes that a piece is repeated to.
const MAX_REPEATED: usize = 1 << 14;
const MAX_MUTATIONS: usize = 6;

/// Makes one input from a seed.
pub struct Mutator {
    rng: Xoshiro256PlusPlus,
}

impl Mutator {
    pub fn new(seed: u64) -> Self {
        Self {
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }

    /// One of the inputs, changed in a few ways.
    pub fn mutate(&mut self, inputs: &[&[u8]]) -> Vec<u8> {
        let mut bytes = inputs[self.rng.random_range(0..inputs.len())].to_vec();
        for _ in 0..self.rng.random_range(1..=MAX_MUTATIONS) {
            match self.rng.random_range(0..9) {
                0 => self.flip(&mut bytes),
                1 => self.set_bytes(&mut bytes),
                2 => bytes.truncate(self.place(&bytes)),
                3 => drop(bytes.drain(self.piece(&bytes))),
                4 => self.repeat(&mut bytes),
                5 => self.splice(&mut bytes, inputs),
                6 => self.set_count(&mut bytes),
                _ => self.set_number(&mut bytes),
            }
        }
        bytes
    }

    fn place(&mut self, bytes: &[u8]) -> usize {
        self.rng.random_range(0..=bytes.len())
    }

    fn piece(&mut self, bytes: &[u8]) -> std::ops::Range<usize> {
        let begin = self.place(bytes);
        // Short pieces more often than long ones.
        let longest = (bytes.len() - begin) >> self.rng.random_range(0..8);
        begin..begin + self.rng.random_range(0..=longest)
    }

    fn flip(&mut self, bytes: &mut [u8]) {
        for _ in 0..self.rng.random_range(1..8) {
            if let Some(byte) = bytes.get_mut(self.rng.random_range(0..=bytes.len())) {
                *byte ^= 1 << self.rng.random_range(0..8);
            }
        }
    }

    fn set_bytes(&mut self, bytes: &mut [u8]) {
        let value = [0, 0xff, b'\n', b',', b'"', b'[', self.rng.random()][self.rng.random_range(0..7)];
        let piece = self.piece(bytes);
        bytes[piece].fill(value);
    }

    fn repeat(&mut self, bytes: &mut Vec<u8>) {
        let piece = bytes[self.piece(bytes)].to_vec();
        let most = MAX_REPEATED / piece.len().max(1);
        let times = self.rng.random_range(1..=most.max(1));
        let at = self.place(bytes);
        bytes.splice(at..at, piece.repeat(times));
    }

    fn splice(&mut self, bytes: &mut Vec<u8>, inputs: &[&[u8]]) {
        let other = inputs[self.rng.random_range(0..inputs.len())];
        let piece = other[self.piece(other)].to_vec();
        let replaced = self.piece(bytes);
        bytes.splice(replaced, piece);
    }

    fn set_count(&mut self, bytes: &mut [u8]) {
        let count = COUNTS[self.rng.random_range(0..COUNTS.len())];
        let length = [1, 2, 4, 8][self.rng.random_range(0..4)];
        let mut wire = count.to_le_bytes()[..length].to_vec();
        if self.rng.random() {
            wire.reverse();
        }
        let at = self.place(bytes);
        for (byte, value) in bytes[at..].iter_mut().zip(wire) {
            *byte = value;
        }
    }

    /// Replaces a number in a text.
    fn set_number(&mut self, bytes: &mut Vec<u8>) {
        let from = self.place(bytes);
        let is_of_number = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'e');
        let Some(begin) = bytes[from..].iter().position(is_of_number).map(|at| from + at) else {
            return;
        };
        let length = bytes[begin..].iter().take_while(|byte| is_of_number(byte)).count();
        let number = NUMBERS[self.rng.random_range(0..NUMBERS.len())];
        bytes.splice(begin..begin + length, number.bytes());
    }
}

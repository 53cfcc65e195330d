//! A port with faults, the same ones each time.
//!
//! Faults are added between bus and port, so that neither has code for them. All randomness comes from one seeded generator and is drawn byte
//! by byte in the order of the traffic: the same seed and the same traffic give the same faults.

use std::collections::VecDeque;
use std::ops::Range;
use std::time::{Duration, Instant};

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::{Port, PortError};

/// The faults and their probabilities, 0 to 1. Begin with [`NONE`](Self::NONE): `Faults { drop: 0.01, ..Faults::NONE }`.
#[derive(Debug, Clone, PartialEq)]
pub struct Faults {
    /// Probability that a received byte is lost.
    pub drop: f64,
    /// Probability that a bit of a received byte is flipped.
    pub flip: f64,
    /// Probability that a received byte is duplicated.
    pub duplicate: f64,
    /// Probability that an answer ends early, after 0 to 63 bytes.
    pub truncate: f64,
    /// Probability that an answer comes late, by [`delay_by`](Self::delay_by).
    pub delay: f64,
    /// Delay of a late answer.
    pub delay_by: Duration,
    /// Probability that a sent byte is lost.
    pub drop_sent: f64,
    /// Nothing is received after these requests, counted from the first one sent.
    pub silence: Range<u64>,
}

impl Faults {
    /// No faults.
    pub const NONE: Self = Self {
        drop: 0.0,
        flip: 0.0,
        duplicate: 0.0,
        truncate: 0.0,
        delay: 0.0,
        delay_by: Duration::ZERO,
        drop_sent: 0.0,
        silence: 0..0,
    };
}

/// A port with faults.
#[derive(Debug)]
pub struct FaultInjector<P> {
    port: P,
    faults: Faults,
    rng: Xoshiro256PlusPlus,
    requests: u64,
    /// Bytes left of this answer, if it is truncated.
    answer_left: Option<usize>,
    /// This answer is late.
    answer_delayed: bool,
    waiting: VecDeque<(Option<Instant>, u8)>, // in the order of delivery
}

/// Bytes taken from the port at a time.
const CHUNK: usize = 256;

impl<P: Port> FaultInjector<P> {
    /// Wraps `port` with `faults`.
    pub fn new(port: P, faults: Faults, seed: u64) -> Self {
        Self {
            port,
            faults,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            requests: 0,
            answer_left: None,
            answer_delayed: false,
            waiting: VecDeque::with_capacity(4 * CHUNK),
        }
    }

    /// Changes the faults from now on.
    pub fn set_faults(&mut self, faults: Faults) {
        self.faults = faults;
    }

    /// The port without faults.
    pub fn port_mut(&mut self) -> &mut P {
        &mut self.port
    }

    fn happens(&mut self, probability: f64) -> bool {
        // A float in 0..1 has 53 bits. Nothing is drawn for a probability of 0, so that one more kind of fault does not change the
        // others.
        probability > 0.0 && ((self.rng.next_u64() >> 11) as f64) < probability * (1u64 << 53) as f64
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.rng.next_u64() % bound
    }

    /// Whether what is received now is passed on as it comes.
    fn passes_everything(&self) -> bool {
        self.faults == Faults::NONE && self.answer_left.is_none() && !self.answer_delayed
    }

    /// Queues bytes from the port, with faults.
    fn pass(&mut self, bytes: &[u8]) {
        let silent = self.faults.silence.contains(&self.requests.saturating_sub(1));
        let due = self.answer_delayed.then(|| Instant::now() + self.faults.delay_by);
        for &byte in bytes {
            match &mut self.answer_left {
                Some(0) => continue,
                Some(left) => *left -= 1,
                None => {}
            }
            if silent || self.happens(self.faults.drop) {
                continue;
            }
            let mut byte = byte;
            if self.happens(self.faults.flip) {
                byte ^= 1 << self.below(8);
            }
            self.waiting.push_back((due, byte));
            if self.happens(self.faults.duplicate) {
                self.waiting.push_back((due, byte));
            }
        }
    }

    /// Delivers what is due.
    fn take_due(&mut self, into: &mut [u8]) -> usize {
        let now = Instant::now();
        let mut taken = 0;
        for room in into {
            let Some(&(due, byte)) = self.waiting.front() else {
                break;
            };
            if due.is_some_and(|due| due > now) {
                break;
            }
            *room = byte;
            taken += 1;
            self.waiting.pop_front();
        }
        taken
    }
}

impl<P: Port> Port for FaultInjector<P> {
    fn now(&self) -> Instant {
        self.port.now()
    }

    fn pass_time(&mut self, time: Duration) -> Result<(), PortError> {
        self.port.pass_time(time)
    }

    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), PortError> {
        self.requests += 1;
        self.answer_left = if self.happens(self.faults.truncate) {
            Some(self.below(64) as usize)
        } else {
            None
        };
        self.answer_delayed = self.happens(self.faults.delay);
        if self.faults.drop_sent > 0.0 {
            let mut kept = Vec::with_capacity(bytes.len());
            for &byte in bytes {
                if !self.happens(self.faults.drop_sent) {
                    kept.push(byte);
                }
            }
            return self.port.send(&kept, deadline);
        }
        self.port.send(bytes, deadline)
    }

    fn receive(&mut self, into: &mut [u8], deadline: Instant) -> Result<usize, PortError> {
        if self.waiting.is_empty() && self.passes_everything() {
            return self.port.receive(into, deadline);
        }
        loop {
            let taken = self.take_due(into);
            if taken > 0 {
                return Ok(taken);
            }
            let due = self.waiting.front().and_then(|&(due, _)| due);
            let until = due.map_or(deadline, |due| due.min(deadline));
            let mut chunk = [0; CHUNK];
            let received = self.port.receive(&mut chunk, until)?;
            self.pass(&chunk[..received]);
            if received == 0 {
                // A port in memory returns at once, so the wait for delayed bytes is here.
                if due.is_some() {
                    std::thread::sleep(until.saturating_duration_since(Instant::now()));
                }
                if due.is_none_or(|due| due > deadline) {
                    return Ok(0);
                }
            }
        }
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        let discarded = self.port.discard_input()?;
        // Delayed bytes have not arrived yet: they come after the next request, like late answers.
        let mut arrived = 0;
        let mut scratch = [0; CHUNK];
        loop {
            match self.take_due(&mut scratch) {
                0 => return Ok(discarded + arrived),
                taken => arrived += taken,
            }
        }
    }

    fn set_baud_rate(&mut self, baud: u32) -> Result<(), PortError> {
        self.port.set_baud_rate(baud)
    }
}

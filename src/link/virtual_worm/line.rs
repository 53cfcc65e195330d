//! The line back to the controller: answers wait there until they are due, and some are lost, damaged or late.

use super::camera::draw;
use super::conditions::WireConditions;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::collections::VecDeque;

/// Answers on their way, in the order in which they were given.
#[derive(Debug, Clone)]
pub(super) struct Line {
    conditions: WireConditions,
    rng: Xoshiro256PlusPlus,
    waiting: VecDeque<(f64, Vec<u8>)>, // due times never fall
}

impl Line {
    pub(super) fn new(seed: u64) -> Self {
        Self {
            conditions: WireConditions::default(),
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            waiting: VecDeque::new(),
        }
    }

    pub(super) fn set_conditions(&mut self, conditions: WireConditions) {
        self.conditions = conditions;
    }

    /// Puts an answer on the line that leaves its device at `at_s`.
    pub(super) fn put(&mut self, mut answer: Vec<u8>, at_s: f64) {
        if self.happens(self.conditions.drop_fraction) {
            return;
        }
        if self.happens(self.conditions.corrupt_fraction) && !answer.is_empty() {
            let bit = (draw(&mut self.rng) * answer.len() as f64 * 8.0) as usize;
            answer[bit / 8] ^= 1 << (bit % 8);
        }
        // A line keeps the order: what was put on it earlier comes first, even when the delay got shorter meanwhile.
        let earliest_s = self.waiting.back().map_or(0.0, |&(due_s, _)| due_s);
        self.waiting
            .push_back(((at_s + self.conditions.delay_s).max(earliest_s), answer));
    }

    /// Appends what is due to `out`.
    pub(super) fn take_due(&mut self, now_s: f64, out: &mut Vec<u8>) {
        while let Some((due_s, _)) = self.waiting.front()
            && *due_s <= now_s
        {
            if let Some((_, answer)) = self.waiting.pop_front() {
                out.extend(answer);
            }
        }
    }

    /// When the next answer is due.
    pub(super) fn next_due_s(&self) -> Option<f64> {
        self.waiting.front().map(|&(due_s, _)| due_s)
    }

    fn happens(&mut self, fraction: f64) -> bool {
        // Nothing is drawn for what cannot happen, so that one more kind of fault does not change the others.
        fraction > 0.0 && draw(&mut self.rng) < fraction
    }
}

/// A second seed that has nothing to do with the first.
pub(super) fn derived_seed(seed: u64) -> u64 {
    Xoshiro256PlusPlus::seed_from_u64(seed).next_u64()
}

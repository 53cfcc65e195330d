//! The causes of late ticks, and what each means.

use super::outcome::Outcome;
use worm_estimator::message::Culprit;

/// What a culprit means, in one sentence.
pub fn meaning(culprit: Culprit) -> &'static str {
    match culprit {
        Culprit::None => "The tick was in time.",
        Culprit::Wake => "The timer woke the loop late on a free CPU: interrupts off, deep idle, or a silent host.",
        Culprit::Bus => "The devices were late with their answer, or the port passed it on late.",
        Culprit::Compute => "The tick's own computation took too long.",
        Culprit::Publish => "Publishing, or waking the listeners, took too long.",
        Culprit::Scheduler => "The loop could have run, and the scheduler gave the CPU to another thread.",
        Culprit::PageFault => "The loop touched memory that was not resident, and waited for it.",
        Culprit::Stolen => "The host took the CPU away from this virtual machine.",
    }
}

impl Outcome {
    /// The culprits with the number of ticks that each made late, the most frequent first.
    pub fn blamed(&self) -> Vec<(Culprit, u64)> {
        let named = self.culprits.iter();
        let mut blamed: Vec<(Culprit, u64)> = named
            .filter_map(|(name, ticks)| Some((Culprit::from_name(name)?, *ticks)))
            .filter(|(_, ticks)| *ticks > 0)
            .collect();
        blamed.sort_by_key(|(culprit, ticks)| (std::cmp::Reverse(*ticks), *culprit));
        blamed
    }
}

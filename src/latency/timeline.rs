//! One tick as its parts on the clock, and the latest ticks of a run.

use serde::Serialize;
use worm_estimator::message::{Culprit, Timing};
use worm_estimator::time::microseconds;

/// One tick, complete: where its time went, and who made it late.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tick {
    /// The tick's number since the controller started.
    pub sequence: u64,
    /// How long after the deadline the loop ran, µs.
    pub wake_us: f64,
    /// The bus exchange, µs.
    pub bus_us: f64,
    /// The tick's own computation, µs.
    pub compute_us: f64,
    /// Publishing, µs.
    pub publish_us: f64,
    /// Waking who listens, µs.
    pub notify_us: f64,
    /// Share of it in which the loop could have run and had no CPU, µs; zero where the tick was in time.
    pub waited_us: f64,
    /// Time that the host took the CPUs away for, µs, in steps of the kernel's clock tick; zero where the tick was in time.
    pub stolen_us: f64,
    /// Page faults in it; zero where the tick was in time.
    pub page_faults: u32,
    /// Whether it ended after the next deadline.
    pub late: bool,
    /// Who made it late, or took the largest part of it where it was in time.
    #[serde(serialize_with = "name_of")]
    pub culprit: Culprit,
}

fn name_of<S: serde::Serializer>(culprit: &Culprit, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(culprit.name())
}

impl Tick {
    /// The tick that `timing` tells of; `publish_ns` stands in the timing of the tick that follows it.
    pub fn new(timing: &Timing, publish_ns: u64) -> Self {
        let late = timing.overrun != 0;
        let parts = [
            (Culprit::Wake, timing.wake_lateness_ns),
            (Culprit::Bus, timing.bus_ns),
            (Culprit::Compute, timing.compute_ns),
            (Culprit::Publish, publish_ns + timing.notify_ns),
        ];
        let largest = parts
            .into_iter()
            .max_by_key(|part| part.1)
            .map_or(Culprit::None, |part| part.0);
        Self {
            sequence: timing.sequence,
            wake_us: microseconds(timing.wake_lateness_ns),
            bus_us: microseconds(timing.bus_ns),
            compute_us: microseconds(timing.compute_ns),
            publish_us: microseconds(publish_ns),
            notify_us: microseconds(timing.notify_ns),
            waited_us: microseconds(timing.waited_ns),
            stolen_us: microseconds(timing.stolen_ns),
            page_faults: timing.minor_faults.saturating_add(timing.major_faults),
            late,
            culprit: Culprit::try_from(timing.culprit)
                .ok()
                .filter(|_| late)
                .unwrap_or(largest),
        }
    }

    /// From the deadline to the end of the tick, µs.
    pub fn total_us(&self) -> f64 {
        self.wake_us + self.bus_us + self.compute_us + self.publish_us + self.notify_us
    }
}

/// The latest ticks of a run, the latest first.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct WorstTicks(Vec<Tick>);

impl WorstTicks {
    /// How many are kept.
    pub const KEPT: usize = 10;

    /// Considers one more tick.
    pub fn consider(&mut self, tick: Tick) {
        let place = self.0.partition_point(|kept| kept.total_us() >= tick.total_us());
        if place < Self::KEPT {
            self.0.truncate(Self::KEPT - 1);
            self.0.insert(place, tick);
        }
    }

    /// The ticks, the latest first.
    pub fn ticks(&self) -> &[Tick] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tick(sequence: u64, bus_ns: u64) -> Tick {
        // SAFETY: a message is plain numbers, of which zero is one.
        let mut timing: Timing = unsafe { std::mem::zeroed() };
        timing.sequence = sequence;
        timing.bus_ns = bus_ns;
        Tick::new(&timing, 1_000)
    }

    #[test]
    fn the_ten_latest_are_kept_in_order() {
        let mut worst = WorstTicks::default();
        // 37 and 101 share no divisor: every value from 0 to 100 comes once, in no order.
        (0..101).for_each(|sequence| worst.consider(tick(sequence, sequence * 37 % 101 * 1_000)));
        let kept: Vec<f64> = worst.ticks().iter().map(Tick::total_us).collect();
        let expected: Vec<f64> = (0..10).map(|place| 101.0 - f64::from(place)).collect();
        assert_eq!(kept, expected);
        assert!(
            worst
                .ticks()
                .iter()
                .all(|tick| tick.culprit == Culprit::Bus && !tick.late)
        );
    }
}

//! The loop's ticks, counted: what the `timing` topic tells, and when states were received, become histograms.

use super::histogram::Durations;
use super::timeline::{Tick, WorstTicks};
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use worm_estimator::message::{Culprit, Timing};
use worm_estimator::time::seconds;

/// States whose timing, and timings whose state, may be on their way: some seconds at the highest rate.
const ON_THE_WAY: usize = 65_536;

/// Pauses of the computer: times of 10 ms and more in which it did not run the loop though it had to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct HostPauses {
    /// How many.
    pub count: u64,
    /// How long they were together, s.
    pub total_s: f64,
    /// The longest, s.
    pub longest_s: f64,
    /// The newest, s.
    #[serde(skip)]
    pub newest_s: f64,
    #[serde(skip)]
    total_ns: u64,
}

impl HostPauses {
    /// Adds a pause; nothing for a tick without one, whose pause is 0.
    pub fn add(&mut self, pause_ns: u64) {
        if pause_ns == 0 {
            return;
        }
        self.newest_s = seconds(pause_ns);
        self.count += 1;
        self.total_ns += pause_ns;
        self.total_s = seconds(self.total_ns);
        self.longest_s = self.longest_s.max(self.newest_s);
    }
}

impl std::fmt::Display for HostPauses {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "host-paused {} time(s), {:.2} s in all, {:.0} ms at most: the computer did not run the loop",
            self.count,
            self.total_s,
            self.longest_s * 1e3
        )
    }
}

/// What a run of ticks amounts to.
#[derive(Debug, Clone, Default)]
pub struct TickStats {
    /// Ticks.
    pub ticks: u64,
    /// Deadlines that passed without a tick.
    pub overruns: u64,
    /// Those of them whose culprit is wormd's own work.
    pub overruns_of_product: u64,
    /// How long after its deadline each tick began; deadlines that were missed count as served when the tick before ended.
    pub wake: Durations,
    /// From one tick's beginning to the next one's.
    pub period: Durations,
    /// From a tick's beginning to its end.
    pub execution: Durations,
    /// Bus exchange.
    pub bus: Durations,
    /// Computation.
    pub compute: Durations,
    /// Publishing.
    pub publish: Durations,
    /// Computation and publishing.
    pub own_work: Durations,
    /// Waking who listens.
    pub notify: Durations,
    /// Late ticks by culprit.
    pub culprits: BTreeMap<&'static str, u64>,
    /// Pauses of the computer.
    pub host_pauses: HostPauses,
    /// The latest ticks.
    pub worst: WorstTicks,
    last: Option<Timing>,
    /// Deadlines that had been missed before the last tick, as the controller counts them.
    missed_before_last: u64,
}

impl TickStats {
    /// Takes the timings of one run of the loop, one after the other. A tick is counted when the next one has told what its
    /// publishing took.
    pub fn take(&mut self, timing: &Timing) {
        self.host_pauses.add(timing.host_paused_ns);
        let Some(last) = self.last.replace(*timing) else {
            self.missed_before_last = timing.overruns;
            return;
        };
        let missed = last.overruns.saturating_sub(self.missed_before_last);
        self.missed_before_last = last.overruns;
        if timing.sequence != last.sequence + 1 {
            return;
        }
        let publish_ns = timing.publish_ns;
        let own_ns = last.compute_ns + publish_ns;
        let execution_ns = last.bus_ns + own_ns + last.notify_ns;
        let began_ns = last.deadline_ns + last.wake_lateness_ns;
        let ended_ns = began_ns + execution_ns;
        self.ticks += 1;
        self.wake.record(last.wake_lateness_ns);
        // Missed deadlines would have been served when the tick that cost them ended: coordinated omission, mended.
        let period_ns = timing.deadline_ns.saturating_sub(last.deadline_ns) / (missed + 1);
        for number in 1..=missed {
            let missed_ns = last.deadline_ns + number * period_ns;
            self.wake.record(ended_ns.saturating_sub(missed_ns));
        }
        let next_began_ns = timing.deadline_ns + timing.wake_lateness_ns;
        self.period.record(next_began_ns.saturating_sub(began_ns));
        self.execution.record(execution_ns);
        self.bus.record(last.bus_ns);
        self.compute.record(last.compute_ns);
        self.publish.record(publish_ns);
        self.own_work.record(own_ns);
        self.notify.record(last.notify_ns);
        let tick = Tick::new(&last, publish_ns);
        if tick.late {
            self.overruns += missed;
            if matches!(tick.culprit, Culprit::Compute | Culprit::Publish | Culprit::PageFault) {
                self.overruns_of_product += missed;
            }
            *self.culprits.entry(tick.culprit.name()).or_default() += 1;
        }
        self.worst.consider(tick);
    }
}

/// How long states took from before they were published until somebody had them: brings together when a state was received and
/// what its timing says, whichever comes first.
#[derive(Debug, Clone, Default)]
pub struct Deliveries {
    /// The durations so far.
    pub durations: Durations,
    published: VecDeque<(u64, u64)>,
    received: VecDeque<(u64, u64)>,
}

impl Deliveries {
    /// Takes a timing: its state was handed over for publishing when its computation had ended.
    pub fn take(&mut self, timing: &Timing) {
        let published_ns = timing.deadline_ns + timing.wake_lateness_ns + timing.bus_ns + timing.compute_ns;
        self.published.push_back((timing.sequence, published_ns));
        self.meet();
    }

    /// Takes the number of a state and when it was in hand, ns.
    pub fn received(&mut self, sequence: u64, received_ns: u64) {
        self.received.push_back((sequence, received_ns));
        self.meet();
    }

    fn meet(&mut self) {
        while let (Some(&(published, published_ns)), Some(&(received, received_ns))) =
            (self.published.front(), self.received.front())
        {
            if published == received {
                self.durations.record(received_ns.saturating_sub(published_ns));
            }
            if published <= received {
                self.published.pop_front();
            }
            if received <= published {
                self.received.pop_front();
            }
        }
        for waiting in [&mut self.published, &mut self.received] {
            if waiting.len() > ON_THE_WAY {
                waiting.pop_front();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Timings at 1 kHz: number, deadline ms; wake, bus, compute, publish of the last and notify in µs; overruns and culprit.
    fn timing(sequence: u64, deadline_ms: u64, us: [u64; 5], overruns: u64, culprit: Culprit) -> Timing {
        let [wake, bus, compute, publish, notify] = us.map(|us| us * 1_000);
        Timing {
            sequence,
            deadline_ns: deadline_ms * 1_000_000,
            wake_lateness_ns: wake,
            bus_ns: bus,
            compute_ns: compute,
            publish_ns: publish,
            notify_ns: notify,
            waited_ns: 0,
            stolen_ns: 0,
            overruns,
            period_ns: 1_000_000,
            host_paused_ns: 0,
            host_pauses: 0,
            overrun: u32::from(culprit != Culprit::None),
            culprit: culprit.code(),
            minor_faults: 0,
            major_faults: 0,
        }
    }

    #[test]
    fn ticks_are_counted_whole_and_missed_deadlines_with_them() {
        let timings = [
            timing(7, 1, [50, 100, 2, 9, 10], 40, Culprit::None),
            timing(8, 2, [50, 3000, 2, 4, 10], 43, Culprit::Bus),
            timing(9, 6, [50, 100, 2, 5, 10], 43, Culprit::None),
            timing(10, 7, [50, 100, 1500, 4, 10], 44, Culprit::Compute),
            timing(11, 9, [50, 100, 2, 4, 10], 44, Culprit::None),
        ];
        let mut account = TickStats::default();
        timings.iter().for_each(|timing| account.take(timing));
        assert_eq!(
            (account.ticks, account.overruns, account.overruns_of_product),
            (4, 4, 1)
        );
        assert_eq!(account.culprits, BTreeMap::from([("bus", 1), ("compute", 1)]));
        // Four ticks, and the four that were missed: at 3, 4 and 5 ms, when the second ended at 5.067 ms; at 8 ms, when the
        // fourth ended at 8.664 ms.
        assert_eq!(account.wake.count(), 8);
        let near = |us: f64, expected: f64| (us / expected - 1.0).abs() < 0.01;
        assert!(
            near(account.wake.percentiles().max, 2067.0),
            "{:?}",
            account.wake.percentiles()
        );
        assert!(near(account.own_work.percentiles().max, 1504.0));
        assert!(near(account.period.percentiles().max, 4000.0));
        let worst: Vec<u64> = account.worst.ticks().iter().map(|tick| tick.sequence).collect();
        assert_eq!(worst, [8, 10, 7, 9]);
    }

    #[test]
    fn deliveries_meet_whichever_comes_first() {
        let mut deliveries = Deliveries::default();
        deliveries.received(7, 1_160_000);
        deliveries.take(&timing(6, 0, [50, 100, 2, 4, 10], 0, Culprit::None));
        deliveries.take(&timing(7, 1, [50, 100, 2, 4, 10], 0, Culprit::None));
        deliveries.take(&timing(8, 2, [50, 100, 2, 4, 10], 0, Culprit::None));
        deliveries.received(9, 3_160_000);
        deliveries.take(&timing(9, 3, [50, 100, 2, 4, 10], 0, Culprit::None));
        let told = deliveries.durations.percentiles();
        assert_eq!(deliveries.durations.count(), 2);
        assert!((told.max - 8.0).abs() < 0.1, "{told:?}");
    }
}

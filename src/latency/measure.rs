//! The durations of a run, each with its name and the best that this machine can do.

use super::histogram::{Durations, Percentiles};
use super::outcome::Outcome;

/// One duration of the loop with its floor, where it has one.
#[derive(Debug, Clone, Copy)]
pub struct Measure<'a> {
    /// What it is called.
    pub name: &'static str,
    /// What was measured of wormd.
    pub durations: &'a Durations,
    /// The name of what was measured without wormd in the same run, and its durations.
    pub floor: Option<(&'static str, &'a Durations)>,
}

impl Measure<'_> {
    /// Its ratio to the floor at one percentile; none where either was not measured.
    pub fn ratio(&self, percentile: fn(&Percentiles) -> f64) -> Option<f64> {
        ratio(self.durations, self.floor?.1, percentile)
    }
}

/// Ratio of a duration to its floor at one percentile; none where either was not measured, or the floor is 0.
pub fn ratio(durations: &Durations, floor: &Durations, percentile: fn(&Percentiles) -> f64) -> Option<f64> {
    let ratio = percentile(&durations.measured()?) / percentile(&floor.measured()?);
    ratio.is_finite().then_some(ratio)
}

impl Outcome {
    /// All durations, in the order in which a tick goes through them.
    pub fn measures(&self) -> [Measure<'_>; 11] {
        let alone = |name, durations| Measure {
            name,
            durations,
            floor: None,
        };
        let over = |name, durations, floor_name, floor| Measure {
            name,
            durations,
            floor: Some((floor_name, floor)),
        };
        [
            over("wake lateness", &self.wake_us, "bare sleeper", &self.floor_wake_us),
            alone("tick period", &self.period_us),
            alone("tick from begin to end", &self.execution_us),
            alone("bus exchange", &self.bus_us),
            alone("computation", &self.compute_us),
            alone("publishing", &self.publish_us),
            alone("computation and publishing", &self.own_work_us),
            over(
                "waking who listens",
                &self.notify_us,
                "bare notifier",
                &self.floor_notify_us,
            ),
            over(
                "delivery, woken by the event",
                &self.delivery_us,
                "bare iceoryx2 pair",
                &self.floor_delivery_us,
            ),
            over(
                "delivery, never asleep",
                &self.polled_delivery_us,
                "bare iceoryx2 pair",
                &self.floor_polled_delivery_us,
            ),
            alone("from stall to alarm", &self.alarm_us),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_ratio_only_where_both_were_measured() {
        let of = |ns: &[u64]| {
            let mut durations = Durations::default();
            ns.iter().for_each(|ns| durations.record(*ns));
            durations
        };
        let table: [(&[u64], &[u64], Option<f64>); 5] = [
            (&[200], &[100], Some(2.0)),
            (&[0], &[100], Some(0.0)),
            (&[], &[100], None),
            (&[200], &[], None),
            (&[200], &[0], None),
        ];
        for (durations, floor, expected) in table {
            assert_eq!(ratio(&of(durations), &of(floor), |us| us.p50), expected);
        }
    }
}

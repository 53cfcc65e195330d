//! How much longer than the quickest something was on the way from a robot, whose clock is another one. Pure.
//!
//! What waited in a process that was suspended, or behind an outage, looks new when it comes: the round trip that it carries is older.

/// How much clocks of two computers drift apart at most, as a fraction.
const DRIFT: f64 = 5e-4;

/// The quickest way so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Delay {
    /// The kernel's name for the run of the robot's computer: with each its clock begins anew.
    boot_id: String,
    /// The least difference of both clocks, ns, as it may have drifted until the time that stands beside it.
    least: Option<(i128, u64)>,
}

impl Delay {
    /// Takes what was made at a time of the robot's clock and comes now. Returns how much longer than the quickest it was on the way, ns.
    pub(super) fn take(&mut self, boot_id: &str, made_ns: u64, now_ns: u64) -> u64 {
        if self.boot_id != boot_id {
            boot_id.clone_into(&mut self.boot_id);
            self.least = None;
        }
        let difference = i128::from(now_ns) - i128::from(made_ns);
        let least = self.least.map_or(difference, |(least, since_ns)| {
            let drift_ns = DRIFT * now_ns.saturating_sub(since_ns) as f64;
            difference.min(least + drift_ns as i128)
        });
        self.least = Some((least, now_ns));
        u64::try_from(difference - least).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_waited_on_the_way_is_older_than_it_looks() {
        const S: u64 = 1_000_000_000;
        let mut delay = Delay::default();
        // The robot's clock is 100 s ahead; then its computer starts anew.
        for (boot, made_s, now_s, waited_s) in [
            ("a", 100.0, 0.2, 0.0),
            ("a", 101.0, 1.1, 0.0),
            ("a", 102.0, 2.3, 0.2),
            // The process between was suspended for ten seconds.
            ("a", 103.0, 13.1, 10.0),
            ("a", 113.1, 13.2, 0.0),
            // An hour of silence, after which the clocks differ by 0.1 s more; and half an hour in which something waited.
            ("a", 3713.0, 3613.2, 0.0),
            ("a", 3714.0, 5414.2, 1799.1),
            ("b", 1.0, 5420.0, 0.0),
            ("b", 2.0, 5422.0, 1.0),
        ] {
            let [made_ns, now_ns] = [made_s, now_s].map(|s: f64| (s * S as f64) as u64);
            let found_s = delay.take(boot, made_ns, now_ns) as f64 / S as f64;
            assert!(
                (found_s - waited_s).abs() < 0.02 * waited_s + 0.01,
                "{found_s} of {waited_s} s at {now_s} s"
            );
        }
    }
}

//! Speed ramps, and the rounding of speeds to the servo's counts.

/// A commanded cam velocity that approaches its target with bounded acceleration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    velocity_rad_s: f64,
    target_rad_s: f64,
    acceleration_rad_s2: f64,
}

impl Ramp {
    pub(super) fn at_rest(acceleration_rad_s2: f64) -> Self {
        Self {
            velocity_rad_s: 0.0,
            target_rad_s: 0.0,
            acceleration_rad_s2,
        }
    }

    pub(super) fn aim(&mut self, target_rad_s: f64) {
        self.target_rad_s = target_rad_s;
    }

    /// Stops at once: for faults, in which torque goes off, and for a lapsed lease.
    pub(super) fn halt(&mut self) {
        self.velocity_rad_s = 0.0;
        self.target_rad_s = 0.0;
    }

    pub(super) fn advance(&mut self, dt_s: f64) -> f64 {
        let max = self.acceleration_rad_s2 * dt_s;
        self.velocity_rad_s += (self.target_rad_s - self.velocity_rad_s).clamp(-max, max);
        self.velocity_rad_s
    }

    pub(super) fn target_rad_s(&self) -> f64 {
        self.target_rad_s
    }

    pub(super) fn direction_of_target(&self) -> f64 {
        if self.target_rad_s < 0.0 { -1.0 } else { 1.0 }
    }

    /// Whether the velocity has the direction of its target already.
    pub(super) fn has_turned(&self) -> bool {
        self.velocity_rad_s * self.target_rad_s > 0.0
    }

    pub(super) fn is_at_rest(&self) -> bool {
        self.velocity_rad_s == 0.0 && self.target_rad_s == 0.0
    }
}

/// Rounds velocities to whole counts so that their mean is exact: later ticks make up for what one tick rounded off.
///
/// One count is 0.229 rev/min, a tenth of the speed of a slow gait; plain rounding would make such a gait wrong by several per cent.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CountRounding {
    owed_counts: f64,
}

impl CountRounding {
    pub(super) fn round(&mut self, counts: f64) -> i32 {
        if counts == 0.0 {
            // Standing still means a goal of exactly 0: no remainder survives a stop.
            self.owed_counts = 0.0;
            return 0;
        }
        let wanted = counts + self.owed_counts;
        let rounded = wanted.round();
        self.owed_counts = wanted - rounded;
        rounded as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_never_passes_its_target_nor_its_acceleration() {
        let mut ramp = Ramp::at_rest(10.0);
        for (target, ticks) in [(2.5, 250), (-2.5, 500), (0.0, 250)] {
            ramp.aim(target);
            for tick in 1..=ticks {
                let before = ramp.velocity_rad_s;
                let after = ramp.advance(1e-3);
                assert!((after - before).abs() <= 0.01 + 1e-12, "tick {tick} towards {target}");
            }
            assert!(
                (ramp.velocity_rad_s - target).abs() < 1e-9,
                "reaches {target} in {ticks} ms"
            );
        }
        assert!(
            !Ramp {
                velocity_rad_s: 0.1,
                ..ramp
            }
            .is_at_rest()
        );
    }

    #[test]
    fn rounding_keeps_the_mean_speed_exact() {
        for counts in [0.3, -0.3, 2.18, 104.8, -104.8] {
            let mut rounding = CountRounding::default();
            let sum: i64 = (0..10_000).map(|_| i64::from(rounding.round(counts))).sum();
            assert!(
                (sum as f64 / 1e4 - counts).abs() < 1e-4,
                "{counts}: mean {}",
                sum as f64 / 1e4
            );
        }
    }

    #[test]
    fn nothing_is_owed_across_a_stop() {
        let mut rounding = CountRounding::default();
        rounding.round(0.4);
        assert_eq!([rounding.round(0.0), rounding.round(0.4)], [0, 0]);
    }
}

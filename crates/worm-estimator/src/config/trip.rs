//! What a trip does on its own.

use super::check::Checker;
use serde::Deserialize;

/// What a trip does when nobody was heard for `trip.link_timeout_s`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnLinkLoss {
    /// It holds.
    Hold,
    /// It goes home.
    Return,
    /// It goes on.
    Continue,
}

/// What a trip that holds for a lost link does when somebody is heard again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnLinkBack {
    /// It waits for `wormd trip resume`.
    Wait,
    /// It goes on.
    GoOn,
}

/// What a trip does where the worm does not get ahead.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnStuck {
    /// It goes home.
    Return,
    /// It holds.
    Hold,
}

/// What a trip does on its own.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Trip {
    /// What it does when the link is lost.
    pub link_loss: OnLinkLoss,
    /// Silence after which the link counts as lost, s.
    pub link_timeout_s: f64,
    /// What it does when the link is back.
    pub on_link_back: OnLinkBack,
    /// Fraction of the battery's energy that is kept back beyond what the way home needs.
    pub reserve_share: f64,
    /// What it does where the worm does not get ahead.
    pub on_stuck: OnStuck,
    /// Gait cycles over which the advance is averaged for that.
    pub stuck_cycles: u32,
    /// Fraction of the planned advance below which the worm does not get ahead.
    pub stuck_share: f64,
}

impl Default for Trip {
    fn default() -> Self {
        Self {
            link_loss: OnLinkLoss::Hold,
            link_timeout_s: 30.0,
            on_link_back: OnLinkBack::Wait,
            reserve_share: 0.1,
            on_stuck: OnStuck::Return,
            stuck_cycles: 5,
            stuck_share: 0.25,
        }
    }
}

impl Trip {
    pub(super) fn check(&self, checker: &mut Checker) {
        for (key, value, range, unit) in [
            ("trip.link_timeout_s", self.link_timeout_s, 1.0..=1e6, "s"),
            ("trip.reserve_share", self.reserve_share, 0.0..=0.9, ""),
            ("trip.stuck_cycles", f64::from(self.stuck_cycles), 2.0..=100.0, "cycles"),
            ("trip.stuck_share", self.stuck_share, 0.0..=0.9, ""),
        ] {
            checker.range(key, value, range, unit);
        }
    }
}

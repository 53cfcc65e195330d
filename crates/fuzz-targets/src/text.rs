//! Configurations and campaigns.

use crate::readable;
use std::path::Path;
use worm_analysis::recording::Campaign;
use worm_estimator::config::Config;
use worm_estimator::estimate::Observer;
use worm_estimator::message::State;
use worm_physics::{Physics, Worm};

/// A configuration: one that is accepted describes a worm, its physics and an estimator.
pub(crate) fn config_toml(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    match Config::from_toml(text, Path::new("worm.toml")) {
        Ok(config) => check(&config),
        Err(error) => drop(readable(error)),
    }
}

fn check(config: &Config) {
    assert!(config.problems().is_empty(), "accepted with problems");
    assert!(config.advice().len() < 100, "more advice than anybody reads");
    let worm = Worm::try_from(config).expect("a checked configuration has a valid worm");
    assert_eq!(worm.cells(), config.worm.cells, "as many cells");
    Physics::try_from(config).expect("a checked configuration has valid physics");
    let mut observer = Observer::new(config).expect("a checked configuration has an estimator");
    observer.update(&State::unknown(config.worm.cells));
}

/// A campaign: the worm's configuration and the recordings that it names do not exist.
pub(crate) fn campaign_toml(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    match Campaign::from_toml(text, Path::new("no-such-folder/campaign.toml")) {
        Ok(campaign) => {
            assert_ne!(campaign.runs.is_empty(), campaign.advances.is_empty(), "either of them");
            for advance in &campaign.advances {
                let values = [
                    advance.slope_deg,
                    advance.payload_kg,
                    advance.advance_m,
                    advance.sigma_m,
                ];
                assert!(values.iter().all(|value| value.is_finite()), "{advance:?}");
                assert!(advance.sigma_m > 0.0, "{advance:?}");
                assert!(advance.cycle_s.is_none_or(f64::is_finite), "{advance:?}");
            }
        }
        Err(error) => drop(readable(error)),
    }
}

//! Routes.

use crate::readable;
use std::path::Path;
use worm_plan::Route;
use worm_plan::route::MAX_LEGS;

/// A route: what is accepted has legs in their ranges.
pub(crate) fn route_csv(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    match Route::from_csv(text, Path::new("route.csv")) {
        Ok(route) => {
            assert!(
                (1..=MAX_LEGS).contains(&route.legs().len()),
                "{} legs",
                route.legs().len()
            );
            for leg in route.legs() {
                assert!(leg.length_m > 0.0 && leg.length_m <= 1e5, "{leg:?}");
                assert!((-90.0..=90.0).contains(&leg.slope_deg), "{leg:?}");
            }
            let (slopes_deg, of_leg) = route.slopes();
            for (leg, slope) in route.legs().iter().zip(of_leg) {
                assert_eq!(slopes_deg[slope], leg.slope_deg);
            }
        }
        Err(error) => drop(readable(error)),
    }
}

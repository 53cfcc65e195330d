//! How a trip stands, in words.

use worm_estimator::message::{AlarmKind, LinkLoss, TripPhase, TripReason, TripStatus};

/// Whether something has changed that people want to know.
pub(crate) fn differs(a: &TripStatus, b: &TripStatus) -> bool {
    let of = |trip: &TripStatus| {
        (
            (trip.phase, trip.reason, trip.heading, trip.alarm),
            (trip.needs_operator, trip.leg, trip.link_is_lost, trip.by),
        )
    };
    of(a) != of(b)
}

/// Whether it is over.
pub(crate) fn is_over(trip: &TripStatus) -> bool {
    matches!(
        TripPhase::try_from(trip.phase),
        Ok(TripPhase::Done | TripPhase::Aborted)
    )
}

/// A change, for the log: `outbound, leg 2 of 3, 1.20 m from home: started`.
pub(crate) fn change(trip: &TripStatus) -> String {
    let phase = TripPhase::try_from(trip.phase).map_or("?", TripPhase::name);
    let leg = match TripPhase::try_from(trip.phase) {
        Ok(TripPhase::Done | TripPhase::Aborted) => String::new(),
        _ => format!(", leg {} of {}", trip.leg, trip.leg_count),
    };
    let link = if trip.link_is_lost == 1 {
        format!(", nobody was heard for {:.0} s", trip.link_age_s)
    } else {
        String::new()
    };
    let resume = if trip.needs_operator == 1 {
        "; `wormd trip resume` makes it go on"
    } else {
        ""
    };
    format!(
        "trip {phase}{leg}, {} m from home: {}{link}{resume}",
        place(trip),
        reason(trip)
    )
}

/// Distance from home, m, with its standard error where that shows.
fn place(trip: &TripStatus) -> String {
    if trip.position_sigma_m >= 0.005 {
        format!("{:.2} ± {:.2}", trip.position_m, trip.position_sigma_m)
    } else {
        format!("{:.2}", trip.position_m)
    }
}

/// Why the trip does what it does.
pub(crate) fn reason(trip: &TripStatus) -> String {
    let alarm = AlarmKind::try_from(trip.alarm).map_or(String::new(), |alarm| format!(" ({alarm})"));
    let by = match trip.by.as_str() {
        "" => String::new(),
        by => format!(" by {by}"),
    };
    let text = match TripReason::try_from(trip.reason) {
        Ok(TripReason::Started) => "as planned",
        Ok(TripReason::EndOfRoute) => "the end of the route was reached",
        Ok(TripReason::Home) => "the worm is at home",
        Ok(TripReason::Energy) => "what is left in the battery is needed for the way home",
        Ok(TripReason::LinkLost) => "the link was lost",
        Ok(TripReason::LinkBack) => "the link is back",
        Ok(TripReason::Operator) => "told so",
        Ok(TripReason::HoldCommanded) => "a hold was commanded",
        Ok(TripReason::StopCommanded) => "the worm was stopped",
        Ok(TripReason::OtherDriver) => "somebody else drives",
        Ok(TripReason::Alarm) => "an alarm",
        Ok(TripReason::Fault) => "a fault",
        Ok(TripReason::Stuck) => "the worm does not get ahead",
        Ok(TripReason::Lapsed) => "the crawl was not renewed in time, several times",
        Ok(TripReason::Suspended) => "the trip's process was suspended",
        Ok(TripReason::Refused) => "the controller refuses",
        Ok(TripReason::ControllerGone) => "the controller is gone",
        Ok(TripReason::Ended) => "the trip's process was told to end",
        Err(_) => "a reason that is not known here",
    };
    format!("{text}{alarm}{by}")
}

/// One line for a picture: what it does, where, and when it is over.
pub(crate) fn line(trip: &TripStatus) -> String {
    let phase = TripPhase::try_from(trip.phase);
    let mut text = format!(
        "trip {}: {} of {:.2} m",
        phase.map_or("?", TripPhase::name),
        place(trip),
        trip.length_m
    );
    if !matches!(phase, Ok(TripPhase::Done | TripPhase::Aborted)) {
        text += &format!(", leg {} of {}", trip.leg, trip.leg_count);
    }
    match phase {
        Ok(TripPhase::Outbound | TripPhase::Returning) => {
            if trip.left_s.is_finite() {
                text += &format!(", over in {}", span(trip.left_low_s, trip.left_high_s));
            }
            if trip.reason != TripReason::Started.code() {
                text += &format!(", {}", reason(trip));
            }
        }
        _ => text += &format!(", {}", reason(trip)),
    }
    if trip.link_is_lost == 1 {
        let policy = LinkLoss::try_from(trip.link_loss).map_or("?", LinkLoss::name);
        text += &format!("; link lost ({policy})");
    }
    text
}

/// What is left in the battery, and what the way home needs.
pub(crate) fn energy(trip: &TripStatus) -> Option<String> {
    (trip.energy_left_j.is_finite() && trip.energy_home_j.is_finite()).then(|| {
        format!(
            "left {:.0} J ({:.0} to {:.0}), home needs {:.0} J ({:.0} to {:.0})",
            trip.energy_left_j,
            trip.energy_left_low_j,
            trip.energy_left_high_j,
            trip.energy_home_j,
            trip.energy_home_low_j,
            trip.energy_home_high_j
        )
    })
}

/// A span of time: `12 to 15 min`.
pub(crate) fn span(low_s: f64, high_s: f64) -> String {
    let (scale, unit, digits) = match high_s {
        high_s if high_s >= 7200.0 => (3600.0, "h", 1),
        high_s if high_s >= 180.0 => (60.0, "min", 0),
        _ => (1.0, "s", 0),
    };
    format!("{:.digits$} to {:.digits$} {unit}", low_s / scale, high_s / scale)
}

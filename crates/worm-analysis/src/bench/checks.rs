//! Whether a recording is on the scale of an X-series servo, and its current has a sign.

use super::recording::ServoRecording;
use std::path::Path;
use worm_log::ReadError;
use worm_physics::servo::COUNT_RAD;

/// From here on a current in mA is the 16 bits of a negative one, read without sign.
const UNSIGNED_FROM_MA: f64 = 32_768.0;
/// Largest current of a servo, mA.
const MAX_MA: f64 = 20_000.0;
/// Largest angle and goal of a bench, rad: beyond it the values are counts or degrees.
const MAX_RAD: f64 = 60.0;
/// Smallest difference of positions over a count from which they are another servo's.
const COARSER: f64 = 1.5;
/// Differences of positions that must be there to tell the count from them.
const MIN_CHANGES: usize = 30;
/// Time over which positions and velocities are compared, s; that by which the servo's velocity may lag; and the motion needed for it, rad.
const OVER_S: f64 = 0.2;
const LAG_S: f64 = 0.02;
const MIN_MOTION_RAD: f64 = 0.5;
/// Distance from the goal from which the loop pulls one way, rad; readings that it must pull each way for; and the median current there that is
/// more than noise, A.
const PULLED_RAD: f64 = 20.0 * COUNT_RAD;
const MIN_PULLED: usize = 30;
const MIN_PULLED_A: f64 = 5e-3;
/// One in so many of these readings may be negative: a motor that brakes gives current back.
const NEGATIVE: usize = 10;
/// Velocity over the slope of the positions that is believed.
const RATIO: std::ops::RangeInclusive<f64> = 0.6..=1.6;

/// Refuses a current that is no signed number of mA.
pub(super) fn signed_current(path: &Path, line: u64, current_ma: f64) -> Result<(), ReadError> {
    let place = format!("line {line}");
    if (UNSIGNED_FROM_MA..65_536.0).contains(&current_ma) {
        let signed = current_ma - 65_536.0;
        let problem = format!("current_ma = {current_ma}: that is {signed} read without its sign");
        let remedy = "read present current as a signed number of 16 bits: take 65,536 off every value from 32,768 on";
        return Err(ReadError::at(path, place, problem, remedy));
    }
    if current_ma.abs() > MAX_MA {
        let problem = format!("current_ma = {current_ma}: no servo draws that");
        return Err(ReadError::at(path, place, problem, "give the current in mA"));
    }
    Ok(())
}

/// Refuses a current that stays positive, or nearly so, while the loop pulls both ways, as an ammeter at the supply shows it.
pub(super) fn current_of_both_signs(recording: &ServoRecording) -> Result<(), ReadError> {
    let pulled = |sign: f64| -> Vec<f64> {
        let readings = (1..recording.readings()).filter(|&at| {
            let to_goal_rad = recording.goal_rad[at - 1] - recording.position_rad[at];
            recording.torque_enabled[at - 1] && sign * to_goal_rad > PULLED_RAD
        });
        readings.map(|at| recording.current_a[at]).collect()
    };
    let is_positive = |mut current_a: Vec<f64>| {
        current_a.sort_by(f64::total_cmp);
        current_a.len() >= MIN_PULLED
            && current_a[current_a.len() / NEGATIVE] >= 0.0
            && current_a[current_a.len() / 2] >= MIN_PULLED_A
    };
    if !is_positive(pulled(1.0)) || !is_positive(pulled(-1.0)) {
        return Ok(());
    }
    Err(ReadError::whole(
        &recording.source,
        "current_ma is hardly ever negative, and the servo pulled both ways: it has no sign",
        "give the servo's present current, which has one; an ammeter at the supply shows none, so give its current the sign of goal_rad less \
         position_rad, and `explain` finds that it is the supply's",
    ))
}

/// Refuses positions and velocities that are not those of a servo with 4096 counts in a turn, in rad and rad/s.
pub(super) fn scale(recording: &ServoRecording) -> Result<(), ReadError> {
    let path = &recording.source;
    for (name, values) in [
        ("position_rad", &recording.position_rad),
        ("goal_rad", &recording.goal_rad),
    ] {
        let far = values.iter().position(|value| value.abs() > MAX_RAD);
        if let Some(at) = far {
            let problem = format!(
                "{name} = {} at {} s: that is no angle in rad",
                values[at], recording.time_s[at]
            );
            let remedy = "turn counts or degrees into rad: 2π/4096 for each count of an X-series servo";
            return Err(ReadError::whole(path, problem, remedy));
        }
    }
    let changes: Vec<f64> = recording
        .position_rad
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|change| *change > 1e-9)
        .collect();
    let least = changes.iter().copied().fold(f64::INFINITY, f64::min);
    if changes.len() >= MIN_CHANGES && least > COARSER * COUNT_RAD {
        let problem = format!(
            "another servo's scale: the positions change by {:.2} mrad at least, and a count of this servo is {:.2} mrad",
            1e3 * least,
            1e3 * COUNT_RAD
        );
        return Err(ReadError::whole(
            path,
            problem,
            "give position_rad of a servo with 4096 counts in a turn",
        ));
    }
    match velocity_over_slope(recording) {
        Some(ratio) if !RATIO.contains(&ratio) => Err(ReadError::whole(
            path,
            format!("another servo's scale: the velocities are {ratio:.2} times what the positions change by"),
            "give position_rad in rad and velocity_rad_s in rad/s: 2π/4096 and 0.02398 for each count of an X-series servo",
        )),
        _ => Ok(()),
    }
}

/// The velocities as read over the slopes of the positions, by least squares; none where it hardly moves.
fn velocity_over_slope(recording: &ServoRecording) -> Option<f64> {
    let (time_s, position_rad) = (&recording.time_s, &recording.position_rad);
    let (mut product, mut square, mut motion_rad) = (0.0, 0.0, 0.0);
    let mut from = 0;
    let mut integral_rad = 0.0;
    for at in 1..time_s.len() {
        if time_s[at] - time_s[at - 1] > OVER_S {
            // Over a hole nobody knows how fast it was.
            (from, integral_rad) = (at, 0.0);
            continue;
        }
        // The velocity lags, so a stretch begins and ends later for it; on the whole that only lowers the correlation.
        integral_rad += recording.velocity_rad_s[at] * (time_s[at] - time_s[at - 1]);
        if time_s[at] - time_s[from] >= OVER_S + LAG_S {
            let moved_rad = position_rad[at] - position_rad[from];
            product += integral_rad * moved_rad;
            square += moved_rad * moved_rad;
            motion_rad += moved_rad.abs();
            (from, integral_rad) = (at, 0.0);
        }
    }
    (motion_rad > MIN_MOTION_RAD).then(|| product / square)
}

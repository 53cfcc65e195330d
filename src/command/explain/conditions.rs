//! Checks that what is stated of a recording can be true, before a long search starts from it.

use crate::command::Failure;
use worm_analysis::experiment::RecordedRun;
use worm_analysis::identify::{Prior, gait};
use worm_estimator::config::Config;
use worm_physics::Worm;

/// How much shorter or longer the mean cycle time may be than the stated one, as a fraction: a motor under load is slower than it was ordered to
/// be, which is an effect to be found, and hardly ever quicker.
const SHORTER: f64 = 0.2;
const LONGER: f64 = 1.0;

/// A worm that would slide down even with this multiple of its nominal friction did not crawl there.
const MORE_FRICTION: f64 = 1.5;

/// Refuses a stated payload or cycle time that the recording contradicts.
///
/// # Errors
/// [`Failure::Unusable`] names the recording, what is stated and what it shows.
pub(super) fn check(runs: &[RecordedRun<'_>], config: &Config) -> Result<(), Failure> {
    let nominal = Worm::try_from(config).map_err(Failure::unusable)?;
    for run in runs {
        check_cycle(run, config)?;
        check_payload(run, &nominal)?;
    }
    Ok(())
}

fn check_cycle(run: &RecordedRun<'_>, config: &Config) -> Result<(), Failure> {
    let (Some(stated_s), recording) = (run.cycle_s, run.recording) else {
        return Ok(());
    };
    let step_order = config.worm.step_order_from_zero();
    let prior = Prior {
        step_order: &step_order,
        phase: recording.gait_phase.as_deref(),
    };
    // Without a gait, the search itself reports why.
    let phase = match recording.has_positions() {
        true => gait::find(&recording.time_s, &recording.position_m, &recording.filled(), prior)
            .map_or(None, |gait| Some(gait.phase)),
        false => recording.gait_phase.clone(),
    };
    let contradicts = |seen_s: f64| contradicts(seen_s, stated_s);
    match phase.and_then(|phase| cycle_s(&phase, step_order.len(), &recording.time_s)) {
        // Where the worm rests between the cycles, either the cam's turn or the whole cycle may be stated.
        Some([seen_s, turning_s]) if contradicts(seen_s) && contradicts(turning_s) => Err(Failure::unusable(format!(
            "{}: a gait cycle took {seen_s:.2} s, but cycle_s = {stated_s} is stated: give the time of this run, or leave \
             cycle_s out",
            recording.source.display()
        ))),
        _ => Ok(()),
    }
}

/// Whether a cycle that took so long cannot have been ordered to take the stated time.
fn contradicts(seen_s: f64, stated_s: f64) -> bool {
    !((1.0 - SHORTER) * stated_s..=(1.0 + LONGER) * stated_s).contains(&seen_s)
}

/// Mean time of the whole gait cycles, s, without rests before and after them; and what it would be if every step took the median
/// time of a step, so without rests between the cycles, too. None where there is no whole cycle.
fn cycle_s(phase: &[f64], cells: usize, time_s: &[f64]) -> Option<[f64; 2]> {
    let (first, last) = (phase.first()?.ceil(), phase.last()?.floor());
    let begun_s = |from: f64| time_s.get(phase.partition_point(|at| *at <= from)).copied();
    let ended_s = |until: f64| time_s.get(phase.partition_point(|at| *at < until)).copied();
    let cells = cells as f64;
    let steps = ((last - first) * cells).round() as usize;
    let step_s = |step: usize| {
        let phase = |step: usize| first + step as f64 / cells;
        Some(ended_s(phase(step + 1))? - begun_s(phase(step))?)
    };
    let mut steps_s: Vec<f64> = (0..steps).map(step_s).collect::<Option<_>>()?;
    steps_s.sort_by(f64::total_cmp);
    let median_s = steps_s.get(steps / 2)?;
    Some([(ended_s(last)? - begun_s(first)?) / (last - first), median_s * cells])
}

fn check_payload(run: &RecordedRun<'_>, nominal: &Worm) -> Result<(), Failure> {
    if run.payload_kg <= 0.0 {
        return Ok(());
    }
    let contacts = nominal.contacts().iter();
    let bounds_m: Vec<f64> = contacts
        .map(|contact| MORE_FRICTION * contact.forward_bound_m)
        .collect();
    let on_the_slope = |mass_kg: f64| {
        let worm = nominal.clone().with_max_deformations_m(&bounds_m)?;
        worm.with_mass_kg(mass_kg)?.with_slope_rad(run.slope_deg.to_radians())
    };
    let loaded = on_the_slope(nominal.mass_kg() + run.payload_kg).map_err(Failure::unusable)?;
    let unloaded = on_the_slope(nominal.mass_kg()).map_err(Failure::unusable)?;
    if loaded.check_hold().is_err() && unloaded.check_hold().is_ok() {
        return Err(Failure::unusable(format!(
            "{}: with a payload of {} kg at {}° the worm could not even hold itself, yet the recording shows a crawl: give the \
             mass that it carried, and the true slope",
            run.recording.source.display(),
            run.payload_kg,
            run.slope_deg
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_may_be_slow_and_hardly_quicker_than_ordered() {
        for (seen_s, expected) in [(1.5, true), (1.7, false), (2.7, false), (3.9, false), (4.1, true)] {
            assert_eq!(contradicts(seen_s, 2.0), expected, "{seen_s}");
        }
    }

    #[test]
    fn a_rest_between_the_cycles_is_separated_from_the_turning() {
        let (turn_s, dwell_s, rate_hz) = (2.5, 1.0, 120.0);
        let time_s: Vec<f64> = (0..3000).map(|sample| f64::from(sample) / rate_hz).collect();
        let phase = time_s.iter().map(|time_s| {
            let cycle = (time_s / (turn_s + dwell_s)).floor();
            cycle + ((time_s - cycle * (turn_s + dwell_s)) / turn_s).min(1.0)
        });
        let phase: Vec<f64> = phase.collect();
        let [seen_s, turning_s] = cycle_s(&phase, 4, &time_s).expect("whole cycles");
        assert!((seen_s - 3.5).abs() < 0.2, "{seen_s}");
        assert!((turning_s - turn_s).abs() < 0.1, "{turning_s}");
    }
}

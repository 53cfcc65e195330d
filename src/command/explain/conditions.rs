//! Whether what is stated of a recording can be true of it, before a long search starts from it.

use crate::command::Failure;
use crate::config::Config;
use crate::experiment::Run;
use crate::identify::{Gait, Prior, gait};
use crate::model::Worm;

/// How far the mean cycle time may be from the stated one, as a share.
const CYCLE_SHARE: f64 = 0.2;

/// A worm that would slide down with this much more friction than is believed did not crawl there.
const MORE_FRICTION: f64 = 1.5;

/// Refuses a stated payload or cycle time that the recording contradicts.
///
/// # Errors
/// [`Failure::Unusable`] names the recording, what is stated and what is seen.
pub(super) fn check(runs: &[Run<'_>], config: &Config) -> Result<(), Failure> {
    let believed = Worm::try_from(config).map_err(Failure::unusable)?;
    for run in runs {
        check_cycle(run, config)?;
        check_payload(run, &believed)?;
    }
    Ok(())
}

fn check_cycle(run: &Run<'_>, config: &Config) -> Result<(), Failure> {
    let (Some(stated_s), recording) = (run.cycle_s, run.recording) else {
        return Ok(());
    };
    let prior = Prior {
        step_order: &config.worm.step_order_from_zero(),
        phase: recording.gait_phase.as_deref(),
    };
    // Without a gait the search has more to say.
    let gait = gait::find(&recording.time_s, &recording.position_m, &recording.filled(), prior).ok();
    match gait.and_then(|gait| cycle_s(&gait, &recording.time_s)) {
        Some(seen_s) if (seen_s - stated_s).abs() > CYCLE_SHARE * stated_s => Err(Failure::unusable(format!(
            "{}: a gait cycle took {seen_s:.2} s, but cycle_s = {stated_s} is stated: give the time of this run, or leave \
             cycle_s out",
            recording.source.display()
        ))),
        _ => Ok(()),
    }
}

/// Mean time of the whole gait cycles, s, rests before and after them left out; none where there is no whole one.
fn cycle_s(gait: &Gait, time_s: &[f64]) -> Option<f64> {
    let (first, last) = (gait.phase.first()?.ceil(), gait.phase.last()?.floor());
    let begun_s = time_s.get(gait.phase.partition_point(|phase| *phase <= first))?;
    let ended_s = time_s.get(gait.phase.partition_point(|phase| *phase < last))?;
    (last > first).then(|| (ended_s - begun_s) / (last - first))
}

fn check_payload(run: &Run<'_>, believed: &Worm) -> Result<(), Failure> {
    if run.payload_kg <= 0.0 {
        return Ok(());
    }
    let contacts = believed.contacts().iter();
    let bounds_m: Vec<f64> = contacts
        .map(|contact| MORE_FRICTION * contact.forward_bound_m)
        .collect();
    let on_the_slope = |mass_kg: f64| {
        let worm = believed.clone().with_max_deformations_m(&bounds_m)?;
        worm.with_mass_kg(mass_kg)?.with_slope_rad(run.slope_deg.to_radians())
    };
    let loaded = on_the_slope(believed.mass_kg() + run.payload_kg).map_err(Failure::unusable)?;
    let unloaded = on_the_slope(believed.mass_kg()).map_err(Failure::unusable)?;
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

//! A law that nobody listed, as people read it.

use crate::explain::answer::{FoundLaw, LawAxes, LawOver};
use crate::explain::search::fit::Fit;
use crate::explain::search::held_out::HeldOut;
use crate::explain::search::law::find;
use crate::explain::search::law::fitted_law::FittedLaw;
use crate::explain::search::law::formula::Formula;
use crate::explain::search::law::shape::LawShape;
use crate::explain::worm::gap::{Measured, clusters};
use crate::explain::worm::recorded_worm::RecordedWorm;
use worm_estimator::number::percent;
use worm_physics::{ActsOn, Axis};

/// Fraction of the gap that a law must close on data held out.
const CLOSES: f64 = 0.25;

/// Fraction of a worm's gap that a law closes on data held out, with its 90 % interval.
pub(super) fn closure_of_worm(
    worm: &RecordedWorm<'_>,
    recalibrated: &Fit,
    without: &HeldOut,
    law: &FittedLaw,
) -> (f64, [f64; 2]) {
    let (left, open) = law.held_out.determined_beside(without);
    let floor = Measured::new(worm, &law.fit).floor_of_closure();
    let left = clusters(worm, &law.fit, &left);
    clusters(worm, recalibrated, &open).closure(&left, floor)
}

/// A law that was found, as people read it; none where it closes too little of the gap to be one. `held_out` says what it was judged on.
/// A closure that is not known is that of no law.
pub(super) fn law(
    found: &find::FoundLaw,
    (closure, closure_interval): (f64, [f64; 2]),
    held_out: &str,
) -> Option<FoundLaw> {
    if closure.is_nan() {
        return None;
    }
    law_that_outdid(found, (closure, closure_interval), held_out)
}

/// The same of a law that was held against the library, and is more probable and predicts better: how much of the gap it closes may be
/// within its error, as an effect's may, and is `NaN` then.
pub(in crate::explain) fn law_that_outdid(
    found: &find::FoundLaw,
    (closure, closure_interval): (f64, [f64; 2]),
    held_out: &str,
) -> Option<FoundLaw> {
    let law = &found.law;
    if closure < CLOSES || closure_interval[0] <= 0.0 {
        return None;
    }
    let over = over(&law.shape);
    let rivals: Vec<LawOver> = found.rivals.iter().map(|shape| self::over(shape)).collect();
    Some(FoundLaw {
        sentence: sentence(&over, found.formula.as_ref(), &rivals, closure, held_out),
        grid: axes(&law.shape, |(_, grid)| grid.clone()),
        value: law.value.clone(),
        band: law.band.clone(),
        formula: found.formula.as_ref().map(|formula| formula.text.clone()),
        closure,
        closure_interval,
        improvement: law.gain,
        rivals,
        seen: law.seen.clone(),
        over,
    })
}

fn over(shape: &LawShape) -> LawOver {
    LawOver {
        acts_on: shape.acts_on.name(),
        axis: axes(shape, |(axis, _)| axis.name()),
        cell: shape.cell.map(|cell| cell + 1),
        period: shape.period,
        memory_s: shape.memory_s,
    }
}

fn axes<T>(shape: &LawShape, of: impl Fn(&(Axis, Vec<f64>)) -> T) -> LawAxes<T> {
    match &shape.axes[..] {
        [first, second, ..] => LawAxes::Two([of(first), of(second)]),
        all => LawAxes::One(of(&all[0])),
    }
}

/// What a law says, in a sentence.
fn sentence(over: &LawOver, formula: Option<&Formula>, rivals: &[LawOver], closure: f64, held_out: &str) -> String {
    let says = match formula.filter(|formula| formula.is_constant) {
        Some(constant) => format!("{} is the same everywhere, {}", subject(over), constant.text),
        None => depends(over),
    };
    let says = capitalised(&says);
    let mut text = match closure.is_nan() {
        true => format!(
            "{says}: with it {held_out} that it was not fitted to are more probable; how much of the gap it closes there is within its error."
        ),
        false => format!(
            "{says}: it closes {} of the gap on {held_out} that it was not fitted to.",
            percent(closure)
        ),
    };
    if !rivals.is_empty() {
        let others: Vec<String> = rivals.iter().map(depends).collect();
        text += &format!(" As well does {}.", others.join("; or "));
    }
    text
}

fn subject(over: &LawOver) -> String {
    let whom = |every: &str| {
        over.cell
            .map_or_else(|| every.to_owned(), |cell| format!("cell {cell}"))
    };
    match ActsOn::named(over.acts_on) {
        Ok(ActsOn::FrictionFactor) => format!("the friction of {}", whom("every tip")),
        Ok(ActsOn::DriveDisplacement) => format!("where the drive holds {}", whom("each cell")),
        Ok(ActsOn::MotorFriction) => "the friction of the gears".to_owned(),
        Ok(ActsOn::MotorTorque) => "a torque on the output".to_owned(),
        Ok(ActsOn::ContactForce) | Err(_) => format!("a force on {}", whom("each cell")),
    }
}

/// That it depends on what it does.
fn depends(over: &LawOver) -> String {
    let names = over.axis.all().into_iter().map(|name| axis_in_words(name));
    let mut text = format!(
        "{} depends on {}",
        subject(over),
        names.collect::<Vec<_>>().join(" and on ")
    );
    let first = *over.axis.first();
    if let Some(period) = over.period.filter(|_| first != Axis::Phase.name()) {
        text += &match Axis::named(first) {
            Ok(Axis::Place) => format!(", repeats every {:.1} mm", 1e3 * period),
            Ok(axis) => format!(", repeats every {period:.2} {}", axis.unit()),
            Err(_) => String::new(),
        };
    }
    if let Some(memory_s) = over.memory_s {
        text += &format!(" in the last {memory_s} s");
    }
    text
}

/// What an axis is called in a sentence.
fn axis_in_words(name: &str) -> &str {
    match Axis::named(name) {
        Ok(Axis::Deformation) => "the deformation of the pad",
        Ok(Axis::DeformationRate) => "the rate at which the pad is deformed",
        Ok(Axis::RecentDeformation) => "how far the pad was deformed further",
        Ok(Axis::Speed) => "the speed of the cell",
        Ok(Axis::Load) => "the load on the cell",
        Ok(Axis::Place) => "the place in the canal",
        Ok(Axis::RecentSlide) => "how far the tip has slid",
        Ok(Axis::Phase) => "the phase of the gait",
        Ok(Axis::Slope) => "the slope",
        Ok(Axis::Time) => "the time since the start of the run",
        Ok(Axis::MotorSpeed) => "the speed",
        Ok(Axis::GearLoad) => "the torque on the gears",
        Ok(Axis::OutputLoad) => "the load on the output, against the motion or with it",
        Ok(Axis::MotorAngle) => "the angle",
        Err(_) => name,
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

//! What a law of a servo may depend on: the speed and the loads of its gears for friction, the angle for a torque, over the ranges that the
//! recordings go through.

use super::recorded_servo::RecordedServo;
use super::torque_balance::{Moment, moments};
use crate::explain::search::fit::Fit;
use crate::explain::search::law::grid::{about_rest, ends, evenly, parts, scaled, thinned, with_spacing};
use crate::explain::search::law::offer::Offer;
use crate::explain::search::law::shape::LawShape;
use crate::explain::search::plant::Recorded;
use nalgebra::{DMatrix, DVector};
use worm_physics::servo::ServoPhysics;
use worm_physics::{ActsOn, Axis};

/// Points along a load, where there is one axis and where there are two; and what lies between those along the angle at least, rad.
const POINTS: usize = 9;
const POINTS_OF_TWO: usize = 6;
const SPACING_RAD: f64 = 0.12;
/// Shortest period along the angle, in points of its grid, and longest over its width.
const OF_PERIOD: f64 = 2.2;
const LONGEST_PERIOD: f64 = 0.7;
/// Scales of a torque, as a fraction of the largest on the gears.
const TORQUES: [f64; 4] = [0.003, 0.01, 0.03, 0.1];

/// Speed from which a reading shows friction, rad/s; and readings that a point of a grid must have to be far from nothing.
const MOVES_RAD_S: f64 = 0.1;
const FEW: f64 = 5.0;

/// Where a reading is on an axis.
fn on(axis: Axis, moment: &Moment) -> f64 {
    match axis {
        Axis::MotorSpeed => moment.velocity_rad_s.abs(),
        Axis::GearLoad => moment.on_gears_n_m(),
        Axis::OutputLoad => moment.against_n_m(),
        _ => moment.angle_rad,
    }
}

/// Every law that is tried.
pub(super) fn laws(servo: &RecordedServo<'_>, recalibrated: &Fit) -> Vec<Offer> {
    let physics = servo.physics(recalibrated);
    let all: Vec<Moment> = (0..servo.runs())
        .flat_map(|run| moments(servo, run, &physics))
        .collect();
    let seen = |axis: Axis| -> Vec<f64> { all.iter().map(|moment| on(axis, moment)).collect() };
    let largest_n_m = seen(Axis::GearLoad).into_iter().fold(0.0, f64::max);
    let grid = |axis: Axis, points: usize| -> Option<Vec<f64>> {
        let (from, to) = ends(&seen(axis))?;
        Some(match axis {
            Axis::MotorSpeed => about_rest(0.0, to),
            Axis::GearLoad => evenly(0.0, to, points),
            Axis::MotorAngle => with_spacing(from, to, SPACING_RAD),
            _ => evenly(from, to, points),
        })
    };
    let offer = |acts_on: ActsOn, axes: &[Axis]| -> Option<Offer> {
        let points = if axes.len() > 1 { POINTS_OF_TWO } else { POINTS };
        let with_grids = axes.iter().map(|axis| Some((*axis, grid(*axis, points)?)));
        let axes: Vec<(Axis, Vec<f64>)> = with_grids.collect::<Option<_>>()?;
        let (first, of_first) = &axes[0];
        let width = of_first[of_first.len() - 1] - of_first[0];
        let periods = [OF_PERIOD * (of_first[1] - of_first[0]), LONGEST_PERIOD * width];
        Some(Offer {
            scaled: axes.iter().map(|(axis, grid)| scaled(*axis, grid)).collect(),
            period: None,
            periods: (*first == Axis::MotorAngle && periods[0] < periods[1]).then_some(periods),
            sigmas: TORQUES.map(|fraction| fraction * largest_n_m),
            seen: thinned(&seen(*first)),
            // Dry friction is recalibrated together with any law.
            constant: match acts_on {
                ActsOn::MotorFriction => 0.0,
                _ => Offer::CONSTANT,
            },
            guess: by_torque_balance(&all, &physics, acts_on, &axes),
            shape: LawShape::of_points(acts_on, axes, None),
        })
    };
    let friction = ActsOn::MotorFriction;
    [
        offer(friction, &[Axis::MotorSpeed]),
        offer(friction, &[Axis::GearLoad]),
        offer(friction, &[Axis::OutputLoad]),
        offer(friction, &[Axis::GearLoad, Axis::MotorSpeed]),
        offer(friction, &[Axis::OutputLoad, Axis::MotorSpeed]),
        offer(ActsOn::MotorTorque, &[Axis::MotorAngle]),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// What the torque balance shows of a law beyond the model, at the points of its grid: where an arm comes to rest changes by leaps, so a law
/// that is far from none is not found from there. Least squares over the readings in motion; none without such readings.
fn by_torque_balance(
    all: &[Moment],
    physics: &ServoPhysics,
    acts_on: ActsOn,
    axes: &[(Axis, Vec<f64>)],
) -> Option<Vec<f64>> {
    let points = axes.iter().map(|(_, grid)| grid.len()).product();
    let mut normal = DMatrix::identity(points, points) * FEW;
    let mut along = DVector::zeros(points);
    for moment in all.iter().filter(|moment| moment.velocity_rad_s.abs() > MOVES_RAD_S) {
        let beyond_n_m = moment.friction_n_m - moment.friction_of(physics);
        let value = match acts_on {
            // What turns the motor on is no friction.
            ActsOn::MotorTorque => -beyond_n_m * moment.velocity_rad_s.signum(),
            _ => beyond_n_m,
        };
        let hats = parts(axes, |axis| on(axes[axis].0, moment));
        for &(one, by) in &hats {
            along[one] += by * value;
            for &(other, of_other) in &hats {
                normal[(one, other)] += by * of_other;
            }
        }
    }
    let [least, most] = acts_on.range();
    let found = normal.cholesky()?.solve(&along);
    Some(found.iter().map(|value| value.clamp(least, most)).collect())
}

//! A law that nobody listed: what it says, and its picture with its band, over the data that carry it.

use crate::explain::answer::FoundLaw;
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{ACCENT, Axis, DrawError, INK, MID, MUTED, Row, Sheet, Stroke, Svg, draw};
use worm_estimator::number::{percent, significant};
use worm_physics::{ActsOn, Axis as Over};

const HEIGHT: f64 = 230.0;
const HEIGHT_OF_SEVERAL: f64 = 110.0;
const DATA_HEIGHT: f64 = 60.0;
/// Opacity of the band and of the data.
const BAND: f64 = 0.35;
const DATA: f64 = 0.7;
/// Classes of the histogram of the data.
const CLASSES: usize = 60;

/// The scale on which an axis is drawn, with its unit.
fn drawn(axis: &str) -> (f64, String) {
    match Over::named(axis) {
        Ok(Over::Deformation) => (1e3, "deformation of the pad, mm".to_owned()),
        Ok(Over::Place) => (1e3, "place of the tip along the canal, mm".to_owned()),
        Ok(Over::DeformationRate) => (1e3, "rate of the deformation, mm/s".to_owned()),
        Ok(Over::RecentDeformation) => (1e3, "deformation beyond its recent mean, mm".to_owned()),
        Ok(Over::RecentSlide) => (1e3, "recent slide of the tip, mm".to_owned()),
        Ok(Over::Speed) => (1e3, "speed of the cell, mm/s".to_owned()),
        Ok(Over::Load) => (1.0, "load on the cell, N".to_owned()),
        Ok(Over::Phase) => (1.0, "part of a cycle since the cell's own step began".to_owned()),
        Ok(Over::Slope) => (1.0, "slope, degrees".to_owned()),
        Ok(Over::Time) => (1.0, "gait cycles since the start of the run".to_owned()),
        Ok(Over::MotorSpeed) => (1.0, "speed, rad/s".to_owned()),
        Ok(Over::GearLoad) => (1.0, "torque on the gears, N m".to_owned()),
        Ok(Over::OutputLoad) => (1.0, "load on the output, against the motion above 0, N m".to_owned()),
        Ok(Over::MotorAngle) => (1.0, "angle, rad".to_owned()),
        Err(_) => (1.0, axis.to_owned()),
    }
}

/// What a law gives, by name and as it is drawn, and the scale on which that is.
fn drawn_of(law: &FoundLaw) -> (&'static str, &'static str, f64) {
    match ActsOn::named(law.over.acts_on) {
        Ok(ActsOn::FrictionFactor) => ("the friction", "friction over that of the model", 1.0),
        Ok(ActsOn::DriveDisplacement) => ("the displacement", "displacement ahead of the cam, mm", 1e3),
        Ok(ActsOn::MotorFriction) => ("the friction", "friction beside the model's, mN m", 1e3),
        Ok(ActsOn::MotorTorque) => ("the torque", "torque on the output, mN m", 1e3),
        Ok(ActsOn::ContactForce) | Err(_) => ("the force", "force on each cell towards smaller positions, N", 1.0),
    }
}

/// What there is to say of a law: what it says, how sure that is, and the nearest formula.
pub(super) fn paragraphs(law: &FoundLaw) -> Vec<String> {
    let [low, high] = law.closure_interval.map(percent);
    let closure = match law.closure.is_nan() {
        true => String::new(),
        false => format!("The closure lies between {low} and {high} (90 %). "),
    };
    let mut all = vec![
        law.sentence.clone(),
        format!(
            "{closure}The law stands in the model as an effect named table, which every simulation and prediction obeys. It is no cause: \
             what lies beyond the data that carry it is not known."
        ),
    ];
    let formula = law.formula.as_ref();
    all.extend(formula.map(|formula| format!("A formula predicts as well: {formula}.")));
    all
}

/// The law over its first axis, a row for each point of the second where it has two.
pub(super) fn figure(law: &FoundLaw) -> Result<Figure, DrawError> {
    let (name, quantity, _) = drawn_of(law);
    let name = match law.over.cell {
        Some(cell) => format!("{name}, cell {cell}"),
        None => name.to_owned(),
    };
    let rows = match law.over.axis.all().get(1) {
        Some(second) => format!(" A row for each {}, which stands at its right.", drawn(second).1),
        None => String::new(),
    };
    Ok(Figure {
        id: "law",
        title: "The law, over the data that carry it",
        keys: vec![
            Key::new(Mark::Line, ACCENT, "the law"),
            Key::new(Mark::Band, MUTED, "its 90 % band"),
            Key::new(Mark::Dashed, INK, "no law"),
            Key::new(Mark::Band, MID, "below: how much of the data is there"),
        ],
        panels: vec![Panel::new(name, quantity, picture(law)?)],
        caption: format!(
            "The law is linear between its points. Where there are no data it is what the prior of a smooth law makes of it.{rows}"
        ),
    })
}

/// A point of the law as it is drawn: where it is, its value and its band.
type Point = (f64, f64, [f64; 2]);

/// The law over its first axis at each point of the second, with that; a law that repeats over one period, its end followed by its
/// beginning.
fn rows_of(law: &FoundLaw) -> Vec<(Option<f64>, Vec<Point>)> {
    let unit = drawn_of(law).2;
    let grids = law.grid.all();
    let second: Vec<Option<f64>> = match grids.get(1) {
        Some(second) => second.iter().copied().map(Some).collect(),
        None => vec![None],
    };
    let width = second.len();
    let row = |(number, at_second): (usize, Option<f64>)| {
        let values = law.value.iter().zip(&law.band).skip(number).step_by(width);
        let mut points: Vec<Point> = grids[0]
            .iter()
            .zip(values)
            .map(|(at, (value, band))| (*at, unit * value, band.map(|end| unit * end)))
            .collect();
        if let (Some(period), Some(&(first, value, band))) = (law.over.period, points.first()) {
            points.push((first + period, value, band));
        }
        (at_second, points)
    };
    second.into_iter().enumerate().map(row).collect()
}

fn picture(law: &FoundLaw) -> Result<Svg, DrawError> {
    let (scale, label) = drawn(law.over.axis.first());
    let rows = rows_of(law);
    let (from, to) = match rows.first().map(|(_, points)| &points[..]) {
        Some([(from, ..), .., (to, ..)]) => (*from, *to),
        _ => (0.0, 1.0),
    };
    let width = (to - from).max(1e-9);
    let seen = law.seen.iter().map(|at| match law.over.period {
        Some(period) => from + (at - from).rem_euclid(period),
        None => *at,
    });
    let mut classes = vec![0.0_f64; CLASSES];
    for at in seen {
        let class = ((at - from) / width * CLASSES as f64).clamp(0.0, CLASSES as f64 - 1.0);
        classes[class as usize] += 1.0;
    }
    let most = classes.iter().fold(1.0, |most: f64, count| most.max(*count));
    let neutral = ActsOn::named(law.over.acts_on).map_or(0.0, ActsOn::neutral);
    let height = if rows.len() > 1 { HEIGHT_OF_SEVERAL } else { HEIGHT };
    let row_of_law = |(at_second, points): &(Option<f64>, Vec<Point>)| {
        let ends = points.iter().flat_map(|(_, value, [low, high])| [*value, *low, *high]);
        Row {
            label: at_second.map(|at| (significant(at, 2), INK)),
            ..Row::new(Axis::around(ends.chain([neutral]), 4), height)
        }
    };
    let data = Row::new(Axis::between(0.0, 1.0, 1), DATA_HEIGHT);
    let sheet = Sheet {
        description: format!("The law over the {}", law.over.axis.first()),
        x_label: Some(label),
        x: Axis::between(from * scale, to * scale, 6),
        rows: rows.iter().map(row_of_law).chain([data]).collect(),
    };
    draw(&sheet, |row, plot| {
        let Some((_, points)) = rows.get(row) else {
            for (class, count) in classes.iter().enumerate().filter(|(_, count)| **count > 0.0) {
                let at = |class: usize| (from + width * class as f64 / CLASSES as f64) * scale;
                plot.fill([at(class), at(class + 1)], [0.0, count / most], MID, DATA)?;
            }
            return Ok(());
        };
        plot.ribbon(points.iter().map(|(at, _, band)| (at * scale, *band)), MUTED, BAND)?;
        plot.horizontal_line(neutral, Stroke::new(INK, 1.0).dashed())?;
        plot.line(
            points.iter().map(|(at, value, _)| (at * scale, *value)),
            Stroke::new(ACCENT, 2.2),
        )
    })
}

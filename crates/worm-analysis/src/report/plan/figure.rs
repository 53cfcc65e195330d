//! Figures of a plan.

use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{
    ACCENT, Axis, BLUE, DrawError, GOOD, INK, LIGHT, MUTED, Row, Sheet, Stroke, Svg, VERMILION, draw,
};
use worm_plan::{Candidate, Plan, Trip};

/// A time in minutes and an energy in J.
type Place = (f64, f64);

/// Designs farther from those that a panel is about than this factor are left out of it.
const ROOM: f64 = 1.5;

/// Energy against time.
pub(super) fn trade_off(plan: &Plan) -> Result<Figure, DrawError> {
    let candidate = |candidate: &Candidate| (candidate.time_s / 60.0, candidate.energy_j);
    let front: Vec<Place> = plan.search.front.iter().map(candidate).collect();
    let others: Vec<Place> = plan.search.cheapest_by_mechanism.iter().map(candidate).collect();
    let best = plan.search.best.as_ref().map(candidate);
    let of_trip = |trip: &Trip| Some((trip.time_s?.mean / 60.0, trip.energy_j?.mean));
    let configured = of_trip(&plan.configured);
    let panel = |title: &str, about: &[Place]| -> Result<Panel, DrawError> {
        let svg = trade_off_picture(about, &others, &front, configured, best)?;
        Ok(Panel::new(title, "energy out of the battery, J", svg))
    };
    let mut panels = vec![panel("The trade-off", &front)?];
    if let Some(configured) = configured {
        panels.push(panel(
            "With the configured worm",
            &[&front[..], &[configured]].concat(),
        )?);
    }
    let mut keys = vec![
        Key::new(
            Mark::Dot,
            LIGHT,
            "a number of cells, stiffness and order at its cheapest speed",
        ),
        Key::new(Mark::Line, BLUE, "trade-off"),
        Key::new(Mark::Diamond, GOOD, "least energy"),
    ];
    keys.extend(configured.map(|_| Key::new(Mark::Ring, INK, "the configured worm")));
    Ok(Figure {
        id: "trade-off",
        title: "Energy against time",
        keys,
        panels,
        caption: "Left of and below the blue line there is no design. Hotel power counts as long as the trip takes, so a slow worm is \
                  not a cheap one."
            .to_owned(),
    })
}

fn trade_off_picture(
    about: &[Place],
    others: &[Place],
    front: &[Place],
    configured: Option<Place>,
    best: Option<Place>,
) -> Result<Svg, DrawError> {
    let largest = |of: fn(&Place) -> f64| ROOM * about.iter().map(of).fold(0.0, f64::max);
    let (longest, most) = (largest(|at| at.0), largest(|at| at.1));
    let is_near = |at: &Place| at.0 <= longest && at.1 <= most;
    let near: Vec<Place> = others.iter().copied().filter(is_near).collect();
    let shown = || about.iter().chain(&near);
    let sheet = Sheet {
        description: "Energy of the trip against its time, for all designs and for those of the trade-off".to_owned(),
        x_label: Some("time, min".to_owned()),
        x: Axis::around(shown().map(|at| at.0), 7),
        rows: vec![Row::new(Axis::around(shown().map(|at| at.1), 6), 260.0)],
    };
    draw(&sheet, |_, plot| {
        plot.dots(near.iter().copied(), LIGHT, 2.2)?;
        plot.line(front.iter().copied(), Stroke::new(BLUE, 1.6))?;
        plot.dots(front.iter().copied(), BLUE, 2.6)?;
        if let Some((x, y)) = configured.filter(is_near) {
            plot.ring(x, y, INK)?;
        }
        if let Some((x, y)) = best {
            plot.diamond(x, y, GOOD)?;
        }
        Ok(())
    })
}

/// Charge along the route, above its slopes.
pub(super) fn charge(plan: &Plan) -> Result<Figure, DrawError> {
    let total_m = plan.length_m;
    let start = plan.battery.start_share * 100.0;
    let trips = [(&plan.configured, INK)]
        .into_iter()
        .chain(plan.best.iter().map(|best| (best, GOOD)));
    let curves: Vec<_> = trips
        .map(|(trip, colour)| {
            let mut at_m = 0.0;
            let mut points = vec![(0.0, [start; 3])];
            for leg in &trip.legs {
                at_m += leg.leg.length_m;
                let left = leg
                    .charge_left_share
                    .map(|left| [left.low, left.mean, left.high].map(|share| share * 100.0));
                points.push((at_m, left.unwrap_or([f64::NAN; 3])));
            }
            (points, colour)
        })
        .collect();
    let mut profile = Vec::new();
    let mut at_m = 0.0;
    for leg in &plan.route {
        profile.push(([at_m, at_m + leg.length_m], leg.slope_deg));
        at_m += leg.length_m;
    }
    let reserve = 100.0 * plan.battery.reserve_share;
    let shares = curves
        .iter()
        .flat_map(|(points, _)| points.iter().flat_map(|(_, shares)| *shares));
    let slopes = profile.iter().map(|(_, slope_deg)| *slope_deg);
    let sheet = Sheet {
        description: "Charge that is left along the route, and its slopes".to_owned(),
        x_label: Some("along the route, m".to_owned()),
        x: Axis::between(0.0, total_m, 7),
        rows: vec![
            Row::new(Axis::around(shares.chain([reserve, 0.0]), 5), 190.0),
            Row::new(Axis::around(slopes.chain([0.0, 10.0]), 3), 90.0),
        ],
    };
    let svg = draw(&sheet, |row, plot| {
        if row == 1 {
            for (ends, slope_deg) in &profile {
                plot.fill(*ends, [0.0, *slope_deg], VERMILION, 0.35)?;
                plot.line(ends.map(|x| (x, *slope_deg)), Stroke::new(VERMILION, 1.6))?;
            }
            return Ok(());
        }
        plot.horizontal_line(reserve, Stroke::new(ACCENT, 1.2).dashed())?;
        for (points, colour) in &curves {
            plot.ribbon(
                points.iter().map(|(x, [low, _, high])| (*x, [*low, *high])),
                *colour,
                0.12,
            )?;
            plot.line(
                points.iter().map(|(x, [_, mean, _])| (*x, *mean)),
                Stroke::new(*colour, 1.6),
            )?;
        }
        Ok(())
    })?;
    let mut keys = vec![Key::new(Mark::Line, INK, "the configured worm")];
    if plan.best.is_some() {
        keys.push(Key::new(Mark::Line, GOOD, "the best design"));
    }
    keys.extend([
        Key::new(Mark::Band, MUTED, "90 % interval"),
        Key::new(Mark::Dashed, ACCENT, "reserve"),
        Key::new(Mark::Line, VERMILION, "slope"),
    ]);
    Ok(Figure {
        id: "charge",
        title: "Charge along the route",
        keys,
        panels: vec![Panel::new("The whole trip", "above: charge left, %; below: slope, degrees", svg)],
        caption: "A line that ends before the route does is of a worm that fails there. What is not known is the same on every leg, so the \
                  interval grows with the distance."
            .to_owned(),
    })
}

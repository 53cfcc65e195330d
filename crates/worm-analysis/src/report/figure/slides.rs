//! Forward and backward slides per cycle against theory, figure 7 of the paper.

use super::bar::{Bar, theory_keys};
use super::slides_in_words;
use crate::experiment::{Analysis, CycleValues};
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{Axis, Colour, DrawError, MUTED, Row, SHADE, Sheet, Stroke, Svg, cell_colours, draw};
use crate::report::runs::Runs;
use worm_estimator::number::{count, fixed, mean};

/// Half the width of a bar, in places.
const HALF_BAR: f64 = 0.3;
/// Opacity of the forward and the backward slide.
const OPACITY: [f64; 2] = [1.0, 0.55];
const HEIGHT: f64 = 270.0;

/// Smallest slide that does not round to 0, m.
const MIN_SLIDE_M: f64 = 5e-6;

/// Forward and backward slide averaged over the cells, m; the backward one negative, as it is drawn.
const AVERAGES: [fn(&CycleValues) -> f64; 2] = [
    |values| mean(&values.forward_slide_m),
    |values| -mean(&values.backward_slide_m),
];

/// The forward and the backward slide at one place.
struct Place {
    name: String,
    colour: Colour,
    slides: [Bar; 2],
}

impl Place {
    fn of_cell(run: &Analysis, cell: usize, colour: Colour) -> Self {
        let of_cell = |list_m: &[f64]| list_m.get(cell).copied().unwrap_or(f64::NAN);
        Self {
            name: (cell + 1).to_string(),
            colour,
            slides: [
                Bar::of(run, |values| of_cell(&values.forward_slide_m)),
                Bar::of(run, |values| -of_cell(&values.backward_slide_m)),
            ],
        }
    }

    fn averaged(name: String, run: &Analysis) -> Self {
        // Not the mean of the cells' deviations, because the cells' slides depend on each other.
        let settled = || run.cycles.iter().filter(|cycle| cycle.settled);
        let bar = |average: fn(&CycleValues) -> f64| Bar {
            std: deviation(settled().map(|cycle| average(&cycle.values) * 1e3)),
            ..Bar::of(run, average)
        };
        Self {
            name,
            colour: SHADE,
            slides: AVERAGES.map(bar),
        }
    }
}

/// Standard deviation of a sample; `NaN` for fewer than two.
fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    (values.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt()
}

pub(super) fn figure(runs: Runs<'_>) -> Result<Figure, DrawError> {
    let of_cells = |run: &Analysis| {
        let colours = cell_colours(run.cells).into_iter().enumerate();
        let places = colours.map(|(cell, colour)| Place::of_cell(run, cell, colour));
        places.collect::<Vec<_>>()
    };
    let mut groups: Vec<(String, Vec<Place>)> = runs.named().map(|(name, run)| (name, of_cells(run))).collect();
    // The mean of the cells is compared over the slopes; where there is but one, it is beside the cells.
    match (runs.0, &mut groups[..]) {
        ([run], [(_, places)]) => places.push(Place::averaged("mean".to_owned(), run)),
        _ => {
            let all = runs.named().map(|(name, run)| Place::averaged(name, run)).collect();
            groups.insert(0, ("mean of the cells".to_owned(), all));
        }
    }
    // One scale for all panels, so that they can be compared.
    let places = groups.iter().flat_map(|(_, places)| places);
    let heights = places.flat_map(|place| &place.slides).flat_map(Bar::heights);
    let y = Axis::around(heights.chain([0.0]), 6);
    let mut panels = Vec::new();
    for (number, (title, places)) in groups.into_iter().enumerate() {
        let by_slope = number == 0 && runs.0.len() > 1;
        let svg = picture(&title, &places, &y, (!by_slope).then_some("cell"))?;
        panels.push(Panel::new(title, "slide per cycle, mm: forward up, backward down", svg));
    }
    let measured = "measured, in the colour of the cell; whiskers: standard deviation over the cycles";
    let keys = [Key::new(Mark::Box, SHADE, measured)].into_iter().chain(theory_keys());
    Ok(Figure {
        id: "slides",
        title: "How far the tips slide",
        keys: keys.collect(),
        panels,
        caption: caption(runs),
    })
}

fn picture(name: &str, places: &[Place], y: &Axis, x_label: Option<&str>) -> Result<Svg, DrawError> {
    let sheet = Sheet {
        description: format!("Forward and backward slide per cycle, {name}"),
        x_label: x_label.map(str::to_owned),
        x: Axis::named(places.iter().map(|place| place.name.clone()).collect()),
        rows: vec![Row::new(y.clone(), HEIGHT)],
    };
    draw(&sheet, |_, plot| {
        plot.horizontal_line(0.0, Stroke::new(MUTED, 1.0))?;
        for (number, place) in places.iter().enumerate() {
            for (bar, opacity) in place.slides.iter().zip(OPACITY) {
                bar.draw(plot, number as f64, HALF_BAR, place.colour, opacity)?;
            }
        }
        Ok(())
    })
}

fn caption(runs: Runs<'_>) -> String {
    let measured = runs.describe(|run| Some(slides_in_words(&run.mean)));
    let theory = match runs.describe(|run| Some(slides_in_words(&run.theory.identified.as_ref()?.values))) {
        none if none.is_empty() => "there is no theory to compare".to_owned(),
        theory => format!("theory predicts {theory} for the identified worm"),
    };
    let cycles = runs.describe(|run| {
        let settled = run.cycles.iter().filter(|cycle| cycle.settled).count();
        Some(count(settled, "settled cycle"))
    });
    let without = runs.without_theory();
    let max = most_backward(runs);
    format!(
        "After figure 7 of the paper. Slide of a tip per cycle, over {cycles}. Averaged over the cells, a tip slides {measured}; \
         {theory}{without}.{max}"
    )
}

/// The cell that slides back furthest, in words.
fn most_backward(runs: Runs<'_>) -> String {
    let cells = runs.named().flat_map(|(name, run)| {
        let slides = run.mean.backward_slide_m.iter().enumerate();
        slides.map(move |(cell, slide_m)| (name.clone(), cell, *slide_m))
    });
    let known = cells.filter(|(_, _, slide_m)| slide_m.is_finite());
    match known.max_by(|one, other| one.2.total_cmp(&other.2)) {
        Some((name, cell, slide_m)) if slide_m >= MIN_SLIDE_M => format!(
            " Cell {} slides back furthest, by {} mm at {name}: its tip holds least, or is loaded most.",
            cell + 1,
            fixed(slide_m * 1e3, 2)
        ),
        Some(_) => " No tip slides back.".to_owned(),
        None => String::new(),
    }
}

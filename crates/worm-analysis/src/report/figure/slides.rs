//! Forward and backward slides per cycle against theory, figure 7 of the paper.

use crate::experiment::{Analysis, CycleValues};
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{
    Axis, Colour, DrawError, INK, MUTED, Plot, Row, SHADE, Sheet, Stroke, Svg, cell_colours, draw,
};
use crate::report::runs::Runs;
use worm_estimator::number::{count, fixed, mean};

/// Half the width of a bar, in places.
const HALF_BAR: f64 = 0.3;
const FOOT: f64 = 0.08;
const HEIGHT: f64 = 270.0;

/// Least slide that is more than 0 as the figure says it, m.
const SEEN_M: f64 = 5e-6;

/// A forward and a backward slide, mm; the backward one counted negative, as it is drawn.
#[derive(Clone, Copy)]
struct Pair {
    forward_mm: f64,
    backward_mm: f64,
}

impl Pair {
    fn of_cell(values: &CycleValues, cell: usize) -> Self {
        let mm = |list: &[f64]| list.get(cell).map_or(f64::NAN, |slide_m| slide_m * 1e3);
        Self {
            forward_mm: mm(&values.forward_slide_m),
            backward_mm: -mm(&values.backward_slide_m),
        }
    }

    fn averaged(values: &CycleValues) -> Self {
        Self {
            forward_mm: mean(&values.forward_slide_m) * 1e3,
            backward_mm: -mean(&values.backward_slide_m) * 1e3,
        }
    }

    fn both(self) -> [f64; 2] {
        [self.forward_mm, self.backward_mm]
    }
}

/// What stands at one place: bars with whiskers, and theory.
struct Place {
    name: String,
    colour: Colour,
    measured: Pair,
    std: Pair,
    identified: Option<Pair>,
    nominal: Option<Pair>,
}

impl Place {
    fn new(name: String, colour: Colour, run: &Analysis, pair: impl Fn(&CycleValues) -> Pair, std: Pair) -> Self {
        Self {
            name,
            colour,
            measured: pair(&run.mean),
            std,
            identified: run.theory.identified.as_ref().map(|theory| pair(&theory.values)),
            nominal: run.theory.nominal.as_ref().map(|theory| pair(&theory.values)),
        }
    }

    fn heights(&self) -> impl Iterator<Item = f64> {
        let theory = self.identified.into_iter().chain(self.nominal).flat_map(Pair::both);
        let whiskers = self.measured.both().into_iter().zip(self.std.both());
        let whiskers = whiskers.flat_map(|(value, std)| [value, value - std.abs(), value + std.abs()]);
        theory.chain(whiskers)
    }

    fn draw(&self, plot: &mut Plot<'_, '_, '_>, x: f64) -> Result<(), DrawError> {
        let sides = self.measured.both().into_iter().zip(self.std.both());
        for ((height, std), opacity) in sides.zip([1.0, 0.55]) {
            plot.fill([x - HALF_BAR, x + HALF_BAR], [0.0, height], self.colour, opacity)?;
            plot.whisker(x, height - std.abs(), height + std.abs(), FOOT)?;
        }
        if let Some(nominal) = self.nominal {
            for height in nominal.both() {
                plot.ring(x + 0.16, height, INK)?;
            }
        }
        if let Some(identified) = self.identified {
            for height in identified.both() {
                plot.diamond(x - 0.16, height, INK)?;
            }
        }
        Ok(())
    }
}

pub(super) fn figure(runs: Runs<'_>) -> Result<Figure, DrawError> {
    let averaged = |name, run| Place::new(name, SHADE, run, Pair::averaged, averaged_std(run));
    let mut groups = Vec::new();
    for (name, run) in runs.named() {
        let places = cell_colours(run.cells).into_iter().enumerate().map(|(cell, colour)| {
            let std = Pair::of_cell(&run.std, cell);
            let pair = |values: &CycleValues| Pair::of_cell(values, cell);
            Place::new((cell + 1).to_string(), colour, run, pair, std)
        });
        groups.push((name, places.collect::<Vec<_>>()));
    }
    // The mean of the cells is compared over the slopes; where there is but one, it stands beside the cells.
    match (runs.0, &mut groups[..]) {
        ([run], [(_, places)]) => places.push(averaged("mean".to_owned(), run)),
        _ => {
            let all = runs.named().map(|(name, run)| averaged(name, run)).collect();
            groups.insert(0, ("mean of the cells".to_owned(), all));
        }
    }
    // One scale for all panels, so that they can be compared.
    let y = Axis::around(
        groups
            .iter()
            .flat_map(|(_, places)| places)
            .flat_map(Place::heights)
            .chain([0.0]),
        6,
    );
    let mut panels = Vec::new();
    for (number, (title, places)) in groups.into_iter().enumerate() {
        let by_slope = number == 0 && runs.0.len() > 1;
        let svg = picture(&title, &places, &y, (!by_slope).then_some("cell"))?;
        panels.push(Panel::new(title, "slide per cycle, mm: forward up, backward down", svg));
    }
    Ok(Figure {
        id: "slides",
        title: "How far the tips slide",
        keys: vec![
            Key::new(
                Mark::Box,
                SHADE,
                "measured, in the colour of the cell; whiskers: standard deviation over the cycles",
            ),
            Key::new(Mark::Diamond, INK, "theory, identified worm"),
            Key::new(Mark::Ring, INK, "theory, configured worm"),
        ],
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
        plot.level(0.0, Stroke::new(MUTED, 1.0))?;
        for (number, place) in places.iter().enumerate() {
            place.draw(plot, number as f64)?;
        }
        Ok(())
    })
}

/// Standard deviation over the settled cycles of the slides averaged over the cells: not the mean of the cells' deviations,
/// for the cells' slides depend on each other.
fn averaged_std(run: &Analysis) -> Pair {
    let settled = || run.cycles.iter().filter(|cycle| cycle.settled);
    let pairs: Vec<Pair> = settled().map(|cycle| Pair::averaged(&cycle.values)).collect();
    Pair {
        forward_mm: deviation(pairs.iter().map(|pair| pair.forward_mm)),
        backward_mm: deviation(pairs.iter().map(|pair| pair.backward_mm)),
    }
}

/// Standard deviation of a sample; `NaN` for fewer than two.
fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    (values.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt()
}

fn caption(runs: Runs<'_>) -> String {
    let slides = |pair: Pair| {
        format!(
            "{} mm forward and {} mm backward",
            fixed(pair.forward_mm, 2),
            fixed(-pair.backward_mm, 2)
        )
    };
    let measured = runs.describe(|run| Some(slides(Pair::averaged(&run.mean))));
    let theory = runs.describe(|run| {
        let theory = run.theory.identified.as_ref()?;
        Some(slides(Pair::averaged(&theory.values)))
    });
    let theory = if theory.is_empty() {
        "there is no theory to compare".to_owned()
    } else {
        format!("theory says for the identified worm {theory}")
    };
    let cycles = runs.describe(|run| {
        let settled = run.cycles.iter().filter(|cycle| cycle.settled).count();
        Some(count(settled, "settled cycle"))
    });
    let without = runs.without_theory();
    let max = most_backward(runs);
    format!(
        "After figure 7 of the paper. Slide of a tip per cycle, over {cycles}. In the mean over the cells a tip \
         slides {measured}; {theory}{without}.{max}"
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
        Some((name, cell, slide_m)) if slide_m >= SEEN_M => format!(
            " Furthest back slides cell {}, by {} mm at {name}: the tip that holds least, or the one that is loaded most.",
            cell + 1,
            fixed(slide_m * 1e3, 2)
        ),
        Some(_) => " No tip slides back.".to_owned(),
        None => String::new(),
    }
}

//! How much each effect of the library improves the fit.

use super::super::view::{best_of_each, is_tried, outcome, reached};
use crate::explain::answer::{Screened, ScreeningOutcome};
use crate::explain::{Answer, Verdict};
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{ACCENT, Axis, DrawError, INK, LIGHT, MID, MUTED, Row, SHADE, Sheet, Stroke, Svg, draw};
use worm_estimator::number::{fixed, significant};

/// Height of a bar's row, units.
const ROW: f64 = 21.0;
const HALF_BAR: f64 = 0.32;
/// Improvements below this are negligible: their bars have no length.
const MIN_IMPROVEMENT: f64 = 1.0;

pub(super) fn figure(answer: &Answer) -> Result<Figure, DrawError> {
    Ok(Figure {
        id: "screening",
        title: "How much each effect of the library improves the fit",
        keys: keys(answer),
        panels: vec![Panel::new(
            "improvement",
            "rise of twice the log likelihood, logarithmic",
            picture(answer)?,
        )],
        caption: "Each effect at its best cell. The further a bar reaches beyond the dashed line, the surer it is that \
                  something like that effect is there. Effects that look alike rise together: only the one that leaves no gap is \
                  the answer."
            .to_owned(),
    })
}

fn is_named(answer: &Answer, entry: &Screened) -> bool {
    answer.effects.iter().any(|effect| effect.name == entry.name)
}

fn keys(answer: &Answer) -> Vec<Key> {
    let role = match answer.verdict {
        Verdict::Ambiguous => "first candidate",
        _ => "named",
    };
    let has_named = answer.screening.iter().any(|entry| is_named(answer, entry));
    let named = has_named.then(|| Key::new(Mark::Box, ACCENT, role));
    let others = [
        Key::new(Mark::Box, SHADE, "refitted"),
        Key::new(Mark::Box, LIGHT, "as expected to first order; not refitted"),
        Key::new(Mark::Frame, MUTED, "as expected; the refit did not converge"),
        Key::new(Mark::Dashed, INK, "what chance reaches one time in a hundred"),
    ];
    named.into_iter().chain(others).collect()
}

fn picture(answer: &Answer) -> Result<Svg, DrawError> {
    let bars = best_of_each(answer);
    let names = bars.iter().map(|bar| match bar.cell {
        Some(cell) => format!("{}, cell {cell}", bar.name),
        None => bar.name.clone(),
    });
    let values = bars.iter().map(|bar| reached(bar)).chain([answer.threshold]);
    let over = bars.iter().filter(|bar| reached(bar) > answer.threshold).count();
    let sheet = Sheet {
        description: format!(
            "Improvement by each effect of the library: {over} of {} beyond the threshold of {}",
            bars.len(),
            fixed(answer.threshold, 1)
        ),
        x_label: Some("improvement".to_owned()),
        x: Axis::powers_of_ten(MIN_IMPROVEMENT, values),
        rows: vec![Row::new(Axis::listed(names.collect()), ROW * bars.len() as f64)],
    };
    draw(&sheet, |_, plot| {
        for (number, bar) in bars.iter().enumerate() {
            let row = (bars.len() - 1 - number) as f64;
            if !is_tried(bar) {
                plot.text_beside(MIN_IMPROVEMENT, row, MUTED, outcome(bar))?;
                continue;
            }
            let colour = match bar.improvement {
                Some(_) if is_named(answer, bar) => ACCENT,
                Some(_) => SHADE,
                None => LIGHT,
            };
            let end = reached(bar).max(MIN_IMPROVEMENT);
            let (along, across) = ([MIN_IMPROVEMENT, end], [row - HALF_BAR, row + HALF_BAR]);
            if bar.outcome == ScreeningOutcome::DidNotConverge {
                plot.edge(along, across, Stroke::new(MUTED, 1.5))?;
            } else {
                plot.fill(along, across, colour, 1.0)?;
            }
            plot.text_beside(end, row, INK, &significant(reached(bar), 2))?;
        }
        let untried = bars.iter().filter(|bar| !is_tried(bar)).count() as f64;
        let height = [untried - 0.5, bars.len() as f64 - 0.5];
        let name = format!("chance: {}", fixed(answer.threshold, 1));
        plot.threshold(answer.threshold, height, MID, &name)
    })
}

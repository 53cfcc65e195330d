//! The worst ticks: where the time of each went, what made it late, and the evidence.

use super::words::{NOT_MEASURED, us, with_unit};
use crate::latency::{Outcome, Tick};
use worm_analysis::report::page::{Figure, Key, Mark, Page, Panel, Table};
use worm_analysis::report::plot::{Axis, Colour, DrawError, INK, PAPER, Row, Sheet, Svg, cell_colours, draw};

/// Height of a tick's bar with the space to the next, units.
const ROW: f64 = 27.0;
const HALF_BAR: f64 = 0.34;
/// A tick longer than this multiple of the median of those shown is cut, so that the others remain visible.
const CUT: f64 = 4.0;
/// Room beside the longest bar for its length as text, as a fraction of the picture.
const BESIDE: f64 = 0.2;
/// Width of the gap in a bar that is cut, as a fraction of the picture.
const GAP: f64 = 0.008;

/// The parts of a tick in the order in which they come, µs.
fn parts(tick: &Tick) -> [(&'static str, f64); 5] {
    [
        ("wake", tick.wake_us),
        ("bus", tick.bus_us),
        ("computation", tick.compute_us),
        ("publishing", tick.publish_us),
        ("waking the listeners", tick.notify_us),
    ]
}

pub(super) fn add(page: &mut Page, outcome: &Outcome) -> Result<(), DrawError> {
    let ticks = outcome.worst_ticks.ticks();
    let Some(worst) = ticks.first() else {
        page.paragraph(&format!("The ticks were {NOT_MEASURED}."));
        return Ok(());
    };
    let colours = cell_colours(parts(worst).len());
    let named = parts(worst).map(|(name, _)| name).into_iter().zip(&colours);
    let mut keys: Vec<Key> = named.map(|(name, colour)| Key::new(Mark::Box, *colour, name)).collect();
    keys.push(Key::new(Mark::Dashed, INK, "next deadline"));
    page.figure(&Figure {
        id: "ticks",
        title: "Where the time of the worst ticks went",
        keys,
        panels: vec![Panel::new(
            "from the deadline to the end of the tick",
            "µs",
            picture(outcome, ticks, &colours)?,
        )],
        caption: "The worst first, each with its number and what made it late, or what took most of it where it was in time. What \
                  reaches beyond the dashed line was late. A bar with a gap at its end goes on to the length beside it."
            .to_owned(),
    });
    page.add(table(ticks));
    Ok(())
}

fn picture(outcome: &Outcome, ticks: &[Tick], colours: &[Colour]) -> Result<Svg, DrawError> {
    let period_us = 1e6 / outcome.rate_hz;
    let drawable = ticks.iter().map(Tick::total_us).filter(|us| Axis::is_drawable(*us));
    let lengths_us: Vec<f64> = drawable.collect(); // falling
    let median_us = lengths_us.get(lengths_us.len() / 2).copied().unwrap_or(0.0);
    let longest_us = lengths_us.first().copied().unwrap_or(0.0);
    let end_us = longest_us.min(CUT * median_us).max(1.1 * period_us);
    let names = ticks.iter().map(|tick| format!("{}, {}", tick.sequence, tick.culprit));
    let late = ticks.iter().filter(|tick| tick.late).count();
    let sheet = Sheet {
        description: format!(
            "The {} worst ticks, {late} of them late, the worst of {}, by {}",
            ticks.len(),
            with_unit(longest_us),
            ticks.first().map_or("none", |tick| tick.culprit.name())
        ),
        x_label: Some("µs after the deadline".to_owned()),
        x: Axis::between(0.0, (1.0 + BESIDE) * end_us, 5),
        rows: vec![Row::new(Axis::listed(names.collect()), ROW * ticks.len() as f64)],
    };
    draw(&sheet, |_, plot| {
        for (number, tick) in ticks.iter().enumerate() {
            let row = (ticks.len() - 1 - number) as f64;
            let across = [row - HALF_BAR, row + HALF_BAR];
            let mut from_us = 0.0;
            for ((_, part_us), colour) in parts(tick).into_iter().zip(colours) {
                let to_us = from_us + part_us;
                plot.fill([f64::min(from_us, end_us), to_us.min(end_us)], across, *colour, 1.0)?;
                from_us = to_us;
            }
            if from_us > end_us {
                let gap_us = GAP * sheet.x.high();
                plot.fill([end_us - 3.0 * gap_us, end_us - 2.0 * gap_us], across, PAPER, 1.0)?;
            }
            plot.text_beside(from_us.min(end_us), row, INK, &with_unit(from_us))?;
        }
        let height = [-0.5, ticks.len() as f64 - 0.5];
        plot.threshold(
            period_us,
            height,
            INK,
            &format!("next deadline: {}", with_unit(period_us)),
        )
    })
}

fn table(ticks: &[Tick]) -> Table {
    let head = [
        "tick",
        "culprit",
        "late",
        "total",
        "wake",
        "bus",
        "computation",
        "publishing",
        "waking",
        "without CPU",
        "stolen",
        "page faults",
    ];
    let mut table = Table::new("The worst ticks in numbers, µs", head);
    table.word_columns = 3;
    for tick in ticks {
        let mut row = vec![
            tick.sequence.to_string(),
            tick.culprit.to_string(),
            if tick.late { "yes" } else { "no" }.to_owned(),
            us(tick.total_us()),
        ];
        row.extend(parts(tick).map(|(_, part_us)| us(part_us)));
        row.extend(if tick.late {
            [us(tick.waited_us), us(tick.stolen_us), tick.page_faults.to_string()]
        } else {
            // Unknown: the kernel is asked about late ticks only.
            [us(f64::NAN), us(f64::NAN), us(f64::NAN)]
        });
        table.rows.push(row);
    }
    table.note = Some(
        "Without CPU: how long the loop was ready to run but had to wait. Stolen: what the host took from this virtual machine, in \
         steps of the kernel's clock tick. Both and the page faults are read in late ticks only."
            .to_owned(),
    );
    table
}

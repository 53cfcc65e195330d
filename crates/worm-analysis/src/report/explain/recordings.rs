//! The recordings that the answer rests on, and what to know about them.

use crate::explain::Answer;
use crate::explain::answer::RunSummary;
use crate::report::number::fixed;
use crate::report::page::Page;
use crate::report::runs::names_by_slope;
use crate::report::table::Table;

pub(super) fn add(page: &mut Page, answer: &Answer) {
    if answer.runs.is_empty() {
        page.paragraph("The answer lists no recordings.");
    } else {
        page.table(&table(
            &answer.runs,
            !answer.effects.is_empty(),
            answer.is_by_advances(),
        ));
    }
    page.warnings(&answer.warnings);
}

fn table(runs: &[RunSummary], is_named: bool, is_by_advances: bool) -> Table {
    let names = names_by_slope(runs.iter().map(|run| run.slope_deg));
    let title = if is_by_advances { "Advances" } else { "Recordings" };
    let mut table = Table::new(title, std::iter::once(String::new()).chain(names));
    let mut add = |quantity: &str, of: &dyn Fn(&RunSummary) -> String| {
        let mut row = vec![quantity.to_owned()];
        row.extend(runs.iter().map(of));
        table.rows.push(row);
    };
    if is_by_advances {
        let error_mm = |run: &RunSummary| fixed(run.advance_sigma_m.unwrap_or(f64::NAN) * 1e3, 3);
        add("known extra mass, g", &|run| fixed(run.payload_kg * 1e3, 0));
        add("time of a gait cycle, s", &|run| fixed(run.cycle_s, 3));
        add("advance a cycle, mm: measured", &|run| fixed(run.advance_m[0] * 1e3, 3));
        add("its standard error", &error_mm);
        add("by the recalibrated model", &|run| fixed(run.advance_m[1] * 1e3, 3));
        if is_named {
            add("by the first candidate", &|run| fixed(run.advance_m[2] * 1e3, 3));
        }
        return table;
    }
    let yes = |is_so: bool, otherwise: &str| if is_so { "yes" } else { otherwise }.to_owned();
    add("recording", &|run| run.recording.clone());
    add("known extra mass, g", &|run| fixed(run.payload_kg * 1e3, 0));
    add("whole gait cycles", &|run| run.cycles.to_string());
    add("time of a gait cycle, s", &|run| fixed(run.cycle_s, 3));
    add("gait phase recorded", &|run| {
        yes(run.phase_recorded, "no, found from the positions")
    });
    add("laid down where the recording begins", &|run| {
        yes(run.laid_down, "not seen")
    });
    add("noise of one position, mm", &|run| fixed(run.noise_m * 1e3, 3));
    add("wander of the body a cycle, mm", &|run| {
        fixed(run.drift_per_cycle_m * 1e3, 3)
    });
    add("advance a cycle, mm: measured", &|run| fixed(run.advance_m[0] * 1e3, 3));
    add("by the recalibrated model", &|run| fixed(run.advance_m[1] * 1e3, 3));
    if is_named {
        add("by the named model", &|run| fixed(run.advance_m[2] * 1e3, 3));
    }
    table
}

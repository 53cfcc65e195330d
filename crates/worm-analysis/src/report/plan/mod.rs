//! The page and the text on a trip: whether the worm makes it, which design is best for it, and what speed costs.

mod figure;
mod tables;

use super::page::{Page, Tile, TileRow};
use super::plot::DrawError;
use super::{ReportError, file};
use std::path::{Path, PathBuf};
use worm_estimator::number::{fixed, in_words, percent, significant};
use worm_plan::{Interval, Plan, Trip};

/// Seconds from which a time is told in hours.
const HOURS_FROM_S: f64 = 7200.0;

/// The page, as the text of one self-contained HTML file.
///
/// # Errors
/// [`DrawError`] where a figure could not be drawn.
pub fn page(plan: &Plan, title: &str) -> Result<String, DrawError> {
    let mut page = Page::new(title, &lead(plan));
    let rows: Vec<TileRow> = trips(plan).map(|(name, trip)| tiles(name, trip)).collect();
    page.tiles(&rows);
    page.warnings(&notes(plan));
    page.heading("Figures");
    page.figure(&figure::trade_off(plan)?);
    page.figure(&figure::charge(plan)?);
    page.heading("Tables");
    for (name, trip) in trips(plan) {
        page.add(tables::legs(name, trip));
    }
    page.add(tables::front(plan));
    page.add(tables::inertia(plan));
    Ok(page.finish())
}

/// Writes the page into a folder, which is made if necessary.
///
/// # Errors
/// [`ReportError`].
pub fn write(dir: &Path, plan: &Plan, title: &str) -> Result<PathBuf, ReportError> {
    let page = page(plan, title)?;
    file::replace(dir.join("plan.html"), page.as_bytes())
}

/// The same for the terminal, without figures.
pub fn text(plan: &Plan) -> String {
    let mut parts = vec![lead(plan)];
    parts.extend(trips(plan).map(|(name, trip)| tables::legs(name, trip).to_string()));
    parts.push(tables::front(plan).to_string());
    parts.push(tables::inertia(plan).to_string());
    parts.extend(notes(plan).into_iter().map(|note| format!("note: {note}")));
    parts.join("\n\n")
}

fn trips(plan: &Plan) -> impl Iterator<Item = (&'static str, &Trip)> {
    let best = plan.best.as_ref().map(|best| ("the best design", best));
    std::iter::once(("the configured worm", &plan.configured)).chain(best)
}

fn lead(plan: &Plan) -> String {
    let legs = worm_estimator::number::count(plan.route.len(), "leg");
    let mut lead = format!(
        "{} m in {legs}. {}",
        significant(plan.length_m, 3),
        verdict(&plan.configured)
    );
    match &plan.best {
        Some(best) => {
            let saved = match (best.energy_j, plan.configured.energy_j) {
                (Some(best), Some(configured)) => {
                    format!(", with {} of the energy", percent(best.mean / configured.mean))
                }
                _ => String::new(),
            };
            lead += &format!(
                " The best of {} designs has {}{saved}; {}.",
                plan.search.designs,
                tables::design(best),
                if best.feasible {
                    "the battery suffices"
                } else {
                    "the battery does not suffice"
                },
            );
        }
        None => lead += &format!(" None of {} designs makes the trip.", plan.search.designs),
    }
    lead
}

/// Whether the configured worm makes it, and where it fails.
fn verdict(trip: &Trip) -> String {
    if let Some(leg) = trip.failed_leg {
        let why = trip.legs.get(leg - 1).and_then(|leg| leg.failure);
        let why = why.map_or_else(String::new, |why| format!(": {why}"));
        return format!("The configured worm fails on leg {leg}{why}.");
    }
    let probability = percent(trip.arrival_probability);
    if trip.feasible {
        format!("The configured worm makes it with its reserve untouched, with a probability of {probability}.")
    } else {
        format!("The configured worm needs its reserve for it; without, its probability is {probability}.")
    }
}

fn notes(plan: &Plan) -> Vec<String> {
    let mut notes = Vec::new();
    if !plan.battery.is_configured {
        notes.push(format!(
            "no [battery] is configured: this counts on the {} J and {} W of hotel power of the commented configuration",
            plan.battery.capacity_j, plan.battery.hotel_power_w
        ));
    }
    if !plan.search.best_is_at_the_end_of.is_empty() {
        let names: Vec<String> = plan
            .search
            .best_is_at_the_end_of
            .iter()
            .map(|name| (*name).to_owned())
            .collect();
        notes.push(format!(
            "the best design lies at the end of its range in {}: a wider range may hold a better one",
            in_words(&names)
        ));
    }
    notes.extend(plan.search.notes.clone());
    notes.push(
        "friction inside the drive is that of [virtual_worm], and the intervals are those of a worm that has not crawled yet; once \
         it crawls, the topic `range` knows better"
            .to_owned(),
    );
    notes
}

fn tiles(name: &str, trip: &Trip) -> TileRow {
    let tile = |name: &str, value: Option<Interval>, scale: f64, unit: &str| {
        let value = value.map(|value| (value.mean * scale, value.low * scale, value.high * scale));
        Tile::new(
            name,
            value.map_or_else(|| fixed(f64::NAN, 0), |(mean, _, _)| significant(mean, 3)),
            unit,
            value.map_or_else(String::new, |(_, low, high)| {
                format!("{} to {}", significant(low, 3), significant(high, 3))
            }),
        )
    };
    let (time_unit, per_s) = time_unit(trip.time_s);
    TileRow {
        name: name.to_owned(),
        note: tables::design(trip),
        tiles: vec![
            tile("energy", trip.energy_j, 1.0, "J"),
            tile("time", trip.time_s, per_s, time_unit),
            tile("charge left", trip.charge_left_share, 100.0, "%"),
            tile("range", trip.range_m, 1.0, "m"),
        ],
        ..TileRow::default()
    }
}

/// The unit for a time, and what one second is in it.
fn time_unit(time: Option<Interval>) -> (&'static str, f64) {
    if time.is_some_and(|time| time.mean >= HOURS_FROM_S) {
        ("h", 1.0 / 3600.0)
    } else {
        ("min", 1.0 / 60.0)
    }
}

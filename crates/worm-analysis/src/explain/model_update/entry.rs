//! Named effects as `[[effect]]` entries.

use super::figure::Figure;
use crate::explain::answer::{Answer, FoundLaw, FoundParameter, NamedEffect, Verdict};
use worm_physics::effect::{self, Effect};

/// The entries that an answer adds to the end of a model; empty where nothing was named.
pub(super) fn entries(answer: &Answer) -> String {
    if answer.verdict == Verdict::Ambiguous && answer.is_by_advances() {
        return undecided(answer);
    }
    let (heading, rivals) = match answer.verdict {
        Verdict::Agrees | Verdict::OutsideLibrary => return answer.law.as_ref().map_or_else(String::new, table),
        Verdict::Explained if answer.effects.len() > 1 => ("Found by `wormd explain`; these act together.", &[][..]),
        Verdict::Explained => ("Found by `wormd explain`.", &[][..]),
        Verdict::Ambiguous if answer.rivals.is_empty() => (
            "Found by `wormd explain`, which is not sure: something else may be missing.",
            &[][..],
        ),
        Verdict::Ambiguous => (
            "Found by `wormd explain`, the likeliest of several that explain the data about as well.",
            answer.rivals.as_slice(),
        ),
    };
    let mut text = String::new();
    for effect in &answer.effects {
        text += &entry(effect, if text.is_empty() { heading } else { "" });
    }
    if !rivals.is_empty() && !text.is_empty() {
        text += "\n# The data do not decide against these. To try one, take its comment signs away and the entry above out.\n";
    }
    for rival in rivals {
        let heading = match &rival.together_with[..] {
            [] => String::new(),
            others => format!("Only together with {}.", others.join(" and ")),
        };
        text += &entry(rival, &heading).lines().map(commented_out).collect::<String>();
    }
    text
}

/// The candidates of a few advances: none is sure enough to be switched on.
fn undecided(answer: &Answer) -> String {
    let candidates = answer.effects.iter().chain(&answer.rivals);
    let entries = candidates.map(|effect| entry(effect, "").lines().map(commented_out).collect::<String>());
    let heading = "\n# Found by `wormd explain`: the advances do not decide between these, and each was fitted with a recalibration of its\n\
                   # own. To try one, take its comment signs away.\n";
    heading.to_owned() + &entries.collect::<String>()
}

/// A law that nobody listed.
fn table(law: &FoundLaw) -> String {
    let mut text = format!(
        "\n# Found by `wormd explain` where no effect of the library explains the data: a law at the points of a grid.\n# {}\n",
        law.sentence
    );
    if let Some(formula) = &law.formula {
        text += &format!("# Nearest formula: {formula}.\n");
    }
    text += "[[effect]]\nname = \"table\"\n";
    if let Some(cell) = law.over.cell {
        text += &format!("cell = {cell}\n");
    }
    let axes: Vec<(&str, &[f64])> = law
        .over
        .axis
        .all()
        .into_iter()
        .copied()
        .zip(law.grid.all().into_iter().map(Vec::as_slice))
        .collect();
    if let Some(memory_s) = law.over.memory_s {
        text += &format!("memory_s = {}\n", without_error(memory_s));
    }
    text + &table_fields(law.over.acts_on, &axes, law.over.period, &law.value)
}

/// What a table is given by, as lines of a file: what it acts on, its axes with the points of their grids, its period and its values.
pub(crate) fn table_fields(acts_on: &str, axes: &[(&str, &[f64])], period: Option<f64>, value: &[f64]) -> String {
    let list = |values: &[f64]| {
        let digits = values.iter().map(|&value| without_error(value));
        format!("[{}]", digits.collect::<Vec<_>>().join(", "))
    };
    let lists = |lists: Vec<String>| match &lists[..] {
        [one] => one.clone(),
        several => format!("[{}]", several.join(", ")),
    };
    let names = axes.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    let grids = axes.iter().map(|(_, grid)| list(grid)).collect();
    let width = axes.get(1).map_or(value.len(), |(_, second)| second.len());
    let rows: Vec<String> = value.chunks(width).map(list).collect();
    // That of a phase goes without saying.
    let period = period.filter(|_| axes.first().is_none_or(|(name, _)| *name != "phase"));
    let period = period.map_or_else(String::new, |period| format!("period = {}\n", without_error(period)));
    format!(
        "acts_on = \"{acts_on}\"\naxis = {}\n{period}grid = {}\nvalue = {}\n",
        lists(names),
        lists(grids),
        lists(rows)
    )
}

/// A number in the digits that it needs.
fn without_error(value: f64) -> String {
    Figure { value, sigma: 0.0 }.digits()
}

fn commented_out(line: &str) -> String {
    match line {
        "" => "\n".to_owned(),
        line if line.starts_with('#') => format!("{line}\n"),
        line => format!("# {line}\n"),
    }
}

/// One effect; an entry for each cell where its parameters are those of several. What was over when the recordings ended is not switched
/// on: the file is the model of the next ones.
fn entry(named: &NamedEffect, heading: &str) -> String {
    match &named.onset {
        Some(onset) if onset.is_over() => switched_on(named, heading).lines().map(commented_out).collect(),
        _ => switched_on(named, heading),
    }
}

fn switched_on(named: &NamedEffect, heading: &str) -> String {
    let known = effect::named(&named.name).ok();
    let mut comments = vec![heading.to_owned()];
    if let Some(onset) = &named.onset {
        comments.push(match onset.is_over() {
            true => format!(
                "It acted {}, and is over. To have it act, take the comment signs away.",
                onset.in_words()
            ),
            false => format!("It acts {}.", onset.in_words()),
        });
    }
    if let Some(effect) = known {
        comments.push(format!("{} {}", effect.sentence, effect.formula));
    }
    if !named.twins.is_empty() {
        comments.push(format!(
            "No cell positions can tell it from: {}.",
            named.twins.join("; ")
        ));
    }
    if !named.separated_by.is_empty() {
        comments.push(format!(
            "What would tell it from its neighbours: {}.",
            named.separated_by
        ));
    }
    let mut text = String::from("\n");
    for comment in comments.iter().filter(|comment| !comment.is_empty()) {
        // A line break within would leave the comment.
        let line = comment.split_whitespace().collect::<Vec<_>>().join(" ");
        text += &format!("# {line}\n");
    }
    let mut cells: Vec<Option<usize>> = Vec::new();
    for parameter in &named.parameters {
        let cell = parameter.cell.or(named.cell);
        if !cells.contains(&cell) {
            cells.push(cell);
        }
    }
    for cell in cells {
        text += "[[effect]]\n";
        text += &format!("name = \"{}\"\n", named.name);
        if let Some(cell) = cell {
            text += &format!("cell = {cell}\n");
        }
        let of_cell = |parameter: &&FoundParameter| parameter.cell.or(named.cell) == cell;
        for parameter in named.parameters.iter().filter(of_cell) {
            text += &line(parameter, known);
        }
    }
    text
}

/// One parameter, with its error beside it.
fn line(parameter: &FoundParameter, effect: Option<&Effect>) -> String {
    let figure = Figure {
        value: parameter.value,
        sigma: parameter.sigma,
    };
    let mut digits = figure.digits();
    let known = effect.and_then(|effect| effect.parameters.iter().find(|known| known.name == parameter.name));
    if let Some(known) = known {
        // A value at the end of its range must not be rounded out of it.
        let allowed = figure.rounded().clamp(known.min, known.max);
        if allowed != figure.rounded() {
            digits = format!("{allowed:?}");
        }
    }
    let line = format!("{} = {digits}", parameter.name);
    match figure.error_digits() {
        Some(error) => format!("{line} # ± {} {}", error, parameter.unit).trim_end().to_owned() + "\n",
        None => line + "\n",
    }
}

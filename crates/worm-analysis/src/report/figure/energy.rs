//! Energy per cycle by both methods, against theory and rigid contacts, figure 8 of the paper.

use super::bar::{Bar, theory_keys};
use crate::experiment::{Analysis, CycleValues};
use crate::report::page::{Figure, Key, Mark, Panel};
use crate::report::plot::{Axis, Colour, DrawError, LIGHT, MID, MUTED, Row, SHADE, Sheet, Stroke, Svg, draw};
use crate::report::runs::Runs;
use worm_estimator::number::{fixed, with_error};

/// Half the width of a bar and the distance between bars, in places.
struct Layout {
    half_bar: f64,
    pitch: f64,
}

/// The bars of a slope together at its place.
const GROUPED: Layout = Layout {
    half_bar: 0.085,
    pitch: 0.2,
};
/// Each bar at a place of its own, where there is only one slope.
const APART: Layout = Layout {
    half_bar: 0.3,
    pitch: 1.0,
};

/// A way to count the energy of a cycle.
pub(super) struct Method {
    pub name: &'static str,
    short: &'static str,
    pub colour: Colour,
    pub of: fn(&CycleValues) -> f64,
}

/// The three that are measured.
pub(super) const METHODS: [Method; 3] = [
    Method {
        name: "losses and weight (11)",
        short: "(11)",
        colour: SHADE,
        of: |values| values.energy_loss_j,
    },
    Method {
        name: "actuator work (13), net",
        short: "(13) net",
        colour: MID,
        of: |values| values.energy_actuator_net_j,
    },
    Method {
        name: "actuator work (13), positive part",
        short: "(13) positive",
        colour: LIGHT,
        of: |values| values.energy_actuator_positive_j,
    },
];

pub(super) fn figure(runs: Runs<'_>) -> Result<Figure, DrawError> {
    let methods = METHODS
        .iter()
        .map(|method| Key::new(Mark::Box, method.colour, method.name));
    let rigid = Key::new(Mark::Frame, MUTED, "rigid contacts, same advance");
    let keys = methods.chain([rigid]).chain(theory_keys()).collect();
    Ok(Figure {
        id: "energy",
        title: "What a cycle costs",
        keys,
        panels: vec![Panel::new(
            "energy per cycle",
            if runs.0.len() > 1 { "mJ, by slope" } else { "mJ" },
            picture(runs)?,
        )],
        caption: caption(runs),
    })
}

fn picture(runs: Runs<'_>) -> Result<Svg, DrawError> {
    let bars: Vec<[Bar; 3]> = runs
        .0
        .iter()
        .map(|run| METHODS.each_ref().map(|method| Bar::of(run, method.of)))
        .collect();
    let rigid_mj = runs.0.iter().map(|run| run.rigid_energy_j * 1e3);
    let heights = bars.iter().flatten().flat_map(Bar::heights);
    let heights = heights.chain(rigid_mj.clone()).chain([0.0]);
    let (layout, first, places) = match runs.0 {
        [_] => {
            let methods = METHODS.iter().map(|method| method.short).chain(["rigid"]);
            (APART, 0.0, methods.map(str::to_owned).collect())
        }
        _ => (GROUPED, -1.5 * GROUPED.pitch, runs.names()),
    };
    let sheet = Sheet {
        description: "Energy per cycle by slope and method".to_owned(),
        x_label: None,
        x: Axis::named(places),
        rows: vec![Row::new(Axis::around(heights, 6), 320.0)],
    };
    draw(&sheet, |_, plot| {
        plot.horizontal_line(0.0, Stroke::new(MUTED, 1.0))?;
        for (number, (bars, rigid_mj)) in bars.iter().zip(rigid_mj.clone()).enumerate() {
            let centre = |place: usize| number as f64 + first + place as f64 * layout.pitch;
            for (place, (bar, method)) in bars.iter().zip(&METHODS).enumerate() {
                bar.draw(plot, centre(place), layout.half_bar, method.colour, 1.0)?;
            }
            let x = centre(METHODS.len());
            let ends = [x - layout.half_bar, x + layout.half_bar];
            plot.edge(ends, [0.0, rigid_mj], Stroke::new(MUTED, 1.5))?;
        }
        Ok(())
    })
}

fn caption(runs: Runs<'_>) -> String {
    let measured = |of: fn(&CycleValues) -> f64| {
        runs.describe(|run| Some(format!("{} mJ", with_error(of(&run.mean) * 1e3, of(&run.std) * 1e3, 1))))
    };
    let losses = measured(|values| values.energy_loss_j);
    let net = measured(|values| values.energy_actuator_net_j);
    let theory = runs.describe(|run| {
        let theory = run.theory.identified.as_ref()?;
        Some(format!("{} mJ", fixed(theory.values.energy_loss_j * 1e3, 1)))
    });
    let theory = if theory.is_empty() { "none".to_owned() } else { theory };
    let without = runs.without_theory();
    let rigid = match runs.describe(|run| rigid_ratio(run).map(|ratio| format!("{} times", fixed(ratio, 2)))) {
        none if none.is_empty() => "Rigid contacts cannot be compared without an advance.".to_owned(),
        ratios => format!("Compliance costs {ratios} what rigid contacts would take for the same advance."),
    };
    format!(
        "After figure 8 of the paper. By losses and weight (11): {losses}; by net actuator work (13): {net}. Over a steady cycle \
         the two should agree; the positive part is what a drive pays that cannot take energy back. Theory of the identified \
         worm, net: {theory}{without}. {rigid}"
    )
}

/// Measured energy (11) over that of rigid contacts; none without an advance that would take energy.
pub(in crate::report) fn rigid_ratio(run: &Analysis) -> Option<f64> {
    let ratio = run.mean.energy_loss_j / run.rigid_energy_j;
    (run.rigid_energy_j > 0.0 && ratio.is_finite()).then_some(ratio)
}

//! A small picture of the worm in its canal.

use crate::experiment::Analysis;
use crate::report::plot::{DrawError, INK, MID, MUTED, Raw, Stroke, Svg, cell_colours};

/// Length of the canal shown, units; the picture is a little wider.
const LENGTH: f64 = 150.0;
const MARGIN: f64 = 14.0;

/// A point along and across the canal, turned by its slope, in the picture.
struct Canal {
    cosine: f64,
    sine: f64,
    centre: (f64, f64),
}

impl Canal {
    fn place(&self, along: f64, across: f64) -> (f64, f64) {
        (
            self.centre.0 + along * self.cosine - across * self.sine,
            self.centre.1 - along * self.sine - across * self.cosine,
        )
    }
}

/// The worm in its canal at its slope.
pub(in crate::report) fn schematic(run: &Analysis) -> Result<Svg, DrawError> {
    let slope_rad = if run.slope_deg.is_finite() {
        run.slope_deg.to_radians()
    } else {
        0.0
    };
    let width = LENGTH + 2.0 * MARGIN;
    let height = 2.0 * MARGIN + 36.0 + LENGTH * slope_rad.sin().abs();
    let canal = Canal {
        cosine: slope_rad.cos(),
        sine: slope_rad.sin(),
        centre: (0.5 * width, 0.5 * height),
    };
    Raw::picture("The worm in its canal", width, height, |raw| {
        let (half, wall) = (0.5 * LENGTH, 15.0);
        for across in [-wall, wall] {
            raw.path(
                &[canal.place(-half, across), canal.place(half, across)],
                Stroke::new(MUTED, 1.6),
            )?;
        }
        let pitch = (LENGTH - 40.0) / run.cells.max(1) as f64;
        let first = -0.5 * pitch * (run.cells as f64 - 1.0) - 8.0;
        let last = first + pitch * (run.cells as f64 - 1.0);
        raw.path(
            &[canal.place(first, 0.0), canal.place(last, 0.0)],
            Stroke::new(MID, 2.5),
        )?;
        // Cell 1 leads, so it is drawn last along the canal.
        for (cell, colour) in cell_colours(run.cells).into_iter().enumerate() {
            let along = last - pitch * cell as f64;
            for across in [-wall, wall] {
                let knee = (along - 0.12 * pitch, 0.75 * across);
                let tip = [
                    canal.place(along, 0.4 * across),
                    canal.place(knee.0, knee.1),
                    canal.place(along - 0.2 * pitch, across),
                ];
                raw.path(&tip, Stroke::new(colour, 1.6))?;
            }
            let (length, thickness) = (0.3 * pitch, 6.5);
            let corners = [
                (-length, -thickness),
                (length, -thickness),
                (length, thickness),
                (-length, thickness),
            ];
            raw.shape(&corners.map(|(x, y)| canal.place(along + x, y)), colour, 1.0)?;
        }
        let (tail, head) = (half - 20.0, half);
        raw.path(
            &[canal.place(tail, 0.0), canal.place(head - 4.0, 0.0)],
            Stroke::new(INK, 1.6),
        )?;
        let arrow = [(head, 0.0), (head - 7.0, 4.0), (head - 7.0, -4.0)];
        raw.shape(&arrow.map(|(along, across)| canal.place(along, across)), INK, 1.0)
    })
}

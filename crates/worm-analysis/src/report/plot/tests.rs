//! Values that cannot be drawn leave no trace in a picture.

use super::{Axis, DrawError, INK, Plot, Row, Sheet, Stroke, draw};

const STROKE: fn() -> Stroke = || Stroke::new(INK, 1.0);

fn picture(paint: impl Fn(&mut Plot<'_, '_, '_>) -> Result<(), DrawError>) -> String {
    let sheet = Sheet {
        description: "test".to_owned(),
        x_label: None,
        x: Axis::between(0.0, 10.0, 5),
        rows: vec![Row::new(Axis::between(-1.0, 1.0, 2), 100.0)],
    };
    draw(&sheet, |_, plot| paint(plot)).expect("a picture").into_string()
}

#[test]
fn what_is_not_finite_draws_nothing() {
    let empty = picture(|_| Ok(()));
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        for (x, y) in [(bad, 0.0), (5.0, bad), (bad, bad)] {
            let drawn = picture(|plot| {
                plot.line([(x, y)], STROKE())?;
                plot.line([(x, y)], STROKE().dashed())?;
                plot.vertical_line(x, y, y, STROKE())?;
                plot.dots([(x, y)], INK, 2.0)?;
                plot.ring(x, y, INK)?;
                plot.diamond(x, y, INK)?;
                plot.fill([1.0, x], [0.0, y], INK, 1.0)?;
                plot.text_beside(x, y, INK, "text")?;
                plot.ribbon([(x, [y, 0.0]), (5.0, [0.0, y])], INK, 1.0)?;
                plot.edge([1.0, x], [0.0, y], STROKE())?;
                plot.whisker(x, y, y, 0.1)
            });
            assert_eq!(drawn, empty, "at ({x}, {y})");
        }
        let drawn = picture(|plot| {
            plot.horizontal_line(bad, STROKE())?;
            plot.label_above(bad, INK, "name")?;
            plot.band([1.0, bad], INK, 1.0, "name")
        });
        assert_eq!(drawn, empty, "with {bad}");
    }
}

#[test]
fn a_line_breaks_where_it_is_not_known() {
    let whole = picture(|plot| {
        plot.line(
            [(1.0, 0.0), (2.0, 0.5), (3.0, f64::NAN), (4.0, 0.0), (5.0, 0.5)],
            STROKE(),
        )
    });
    let parts = picture(|plot| {
        plot.line([(1.0, 0.0), (2.0, 0.5)], STROKE())?;
        plot.line([(4.0, 0.0), (5.0, 0.5)], STROKE())
    });
    assert_eq!(whole, parts);
}

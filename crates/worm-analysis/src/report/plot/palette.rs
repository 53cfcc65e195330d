//! The colours: one for each cell through all figures, and greys for everything else.

use plotters::style::RGBColor;

/// A colour of the page.
pub type Colour = RGBColor;

/// Text and what matters most.
pub const INK: Colour = RGBColor(0x22, 0x2b, 0x36);
/// Tick labels and reference lines.
pub const MUTED: Colour = RGBColor(0x6a, 0x75, 0x82);
/// Grid lines.
pub const GRID: Colour = RGBColor(0xe6, 0xea, 0xee);
/// First of three bars side by side.
pub const SHADE: Colour = RGBColor(0x3d, 0x52, 0x66);
/// Second of them.
pub const MID: Colour = RGBColor(0x83, 0x98, 0xab);
/// Third of them.
pub const LIGHT: Colour = RGBColor(0xc4, 0xd0, 0xda);
/// What should catch the eye among them.
pub const ACCENT: Colour = RGBColor(0xc8, 0x10, 0x2e);
/// A value that reaches its aim. It is as dark as [`ACCENT`], so words must tell the two apart as well.
pub const GOOD: Colour = RGBColor(0x00, 0x73, 0x4f);
/// The background.
pub const PAPER: Colour = RGBColor(0xff, 0xff, 0xff);

/// Measured data with something else drawn over it.
pub const BLUE: Colour = RGBColor(0x00, 0x72, 0xb2);
/// What is drawn over it; the colour-blind can tell the two apart.
pub const VERMILION: Colour = RGBColor(0xd5, 0x5e, 0x00);

/// Okabe and Ito's colours, which the colour-blind can tell apart, without black and yellow.
const FEW: [Colour; 6] = [
    BLUE,
    VERMILION,
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
];

/// Stops of the viridis scale without its pale end, for more cells than can be told apart by hue.
const MANY: [Colour; 6] = [
    RGBColor(0x44, 0x01, 0x54),
    RGBColor(0x41, 0x44, 0x87),
    RGBColor(0x2a, 0x78, 0x8e),
    RGBColor(0x22, 0xa8, 0x84),
    RGBColor(0x7a, 0xd1, 0x51),
    RGBColor(0xd2, 0xc2, 0x1b),
];

/// One colour for each cell, cell 1 first.
pub fn cell_colours(cells: usize) -> Vec<Colour> {
    if cells <= FEW.len() {
        return FEW[..cells].to_vec();
    }
    let last_stop = MANY.len() - 1;
    (0..cells)
        .map(|cell| {
            let place = cell as f64 / (cells - 1) as f64 * last_stop as f64;
            let stop = (place.floor() as usize).min(last_stop - 1);
            mixed(MANY[stop], MANY[stop + 1], place - stop as f64)
        })
        .collect()
}

/// Stops of the diverging scale, from none to most, below and above zero: blue and orange, which the colour-blind can tell apart,
/// each as dark as its counterpart.
const BELOW: [Colour; 4] = [
    RGBColor(0xf7, 0xf7, 0xf7),
    RGBColor(0xa6, 0xcb, 0xe8),
    RGBColor(0x3b, 0x86, 0xc2),
    RGBColor(0x0a, 0x3d, 0x75),
];
const ABOVE: [Colour; 4] = [
    RGBColor(0xf7, 0xf7, 0xf7),
    RGBColor(0xfb, 0xc1, 0x86),
    RGBColor(0xd9, 0x6c, 0x14),
    RGBColor(0x7a, 0x2e, 0x04),
];

/// Diverging colour of a value as a fraction of the largest, −1 to 1; grey where it is not known.
pub fn diverging(fraction: f64) -> Colour {
    if fraction.is_nan() {
        return LIGHT;
    }
    let stops = if fraction < 0.0 { BELOW } else { ABOVE };
    let place = fraction.abs().min(1.0) * (stops.len() - 1) as f64;
    let stop = (place.floor() as usize).min(stops.len() - 2);
    mixed(stops[stop], stops[stop + 1], place - stop as f64)
}

fn mixed(from: Colour, to: Colour, fraction: f64) -> Colour {
    let mix = |from: u8, to: u8| (f64::from(from) + fraction * (f64::from(to) - f64::from(from))).round() as u8;
    RGBColor(mix(from.0, to.0), mix(from.1, to.1), mix(from.2, to.2))
}

/// The colour as CSS writes it.
pub fn css(colour: Colour) -> String {
    format!("#{:02x}{:02x}{:02x}", colour.0, colour.1, colour.2)
}

//! A bar: a measured quantity of a cycle with its scatter, and theory beside it.

use crate::experiment::{Analysis, CycleValues};
use crate::report::page::{Key, Mark};
use crate::report::plot::{Colour, DrawError, INK, Plot};

/// Width of a whisker's foot, and distance of theory's marks from the middle, as fractions of half a bar's width.
const FOOT: f64 = 0.3;
const BESIDE: f64 = 0.5;

/// The heights of a bar and of what belongs to it, in thousandths of the quantity's unit.
pub(super) struct Bar {
    pub measured: f64,
    pub std: f64,
    pub identified: Option<f64>,
    pub nominal: Option<f64>,
}

impl Bar {
    /// A quantity of a run, with its standard deviation over the cycles.
    pub fn of(run: &Analysis, quantity: impl Fn(&CycleValues) -> f64) -> Self {
        let height = |values: &CycleValues| quantity(values) * 1e3;
        let theory = &run.theory;
        Self {
            measured: height(&run.mean),
            std: height(&run.std).abs(),
            identified: theory.identified.as_ref().map(|theory| height(&theory.values)),
            nominal: theory.nominal.as_ref().map(|theory| height(&theory.values)),
        }
    }

    /// All that must fit into the picture.
    pub fn heights(&self) -> impl Iterator<Item = f64> + use<> {
        let measured = [self.measured, self.measured - self.std, self.measured + self.std];
        measured.into_iter().chain(self.identified).chain(self.nominal)
    }

    /// Draws the bar around a place.
    pub fn draw(
        &self,
        plot: &mut Plot<'_, '_, '_>,
        x: f64,
        half_width: f64,
        colour: Colour,
        opacity: f64,
    ) -> Result<(), DrawError> {
        plot.fill([x - half_width, x + half_width], [0.0, self.measured], colour, opacity)?;
        let (low, high) = (self.measured - self.std, self.measured + self.std);
        plot.whisker(x, low, high, FOOT * half_width)?;
        if let Some(nominal) = self.nominal {
            plot.ring(x + BESIDE * half_width, nominal, INK)?;
        }
        if let Some(identified) = self.identified {
            plot.diamond(x - BESIDE * half_width, identified, INK)?;
        }
        Ok(())
    }
}

/// Legend entries of theory's marks.
pub(super) fn theory_keys() -> [Key; 2] {
    [
        Key::new(Mark::Diamond, INK, "theory, identified worm"),
        Key::new(Mark::Ring, INK, "theory, configured worm"),
    ]
}

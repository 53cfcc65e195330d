//! Where a search for an effect starts, and restarts.

use super::definition::{Effect, ShapeStarts};

/// Most places along the canal.
const MAX_PLACES: f64 = 60.0;
/// By what fraction of its length each end of a stretch moves in a restart.
const END_SHIFTS: [f64; 7] = [-0.4, -0.15, -0.04, 0.0, 0.04, 0.15, 0.4];
/// By what factor the severity's distance from neutral changes in a restart.
const SEVERITY_FACTORS: [f64; 3] = [1.0, 1.8, 0.6];

impl Effect {
    /// Whether it acts at a place in the canal.
    pub fn has_place(&self) -> bool {
        matches!(self.shape_starts, ShapeStarts::AlongCanal { .. })
    }

    /// Values of all parameters with a given severity and neutral shape.
    pub fn values_with_neutral_shape(&self, severity: f64) -> Vec<f64> {
        let shape = self.parameters[1..].iter().map(|parameter| parameter.neutral);
        [severity].into_iter().chain(shape).collect()
    }

    /// Values of the parameters of shape from which a search starts; `canal_m` is the stretch of canal, from and to, that the
    /// worm crawled, m.
    pub fn starting_shapes(&self, (from_m, to_m): (f64, f64)) -> Vec<Vec<f64>> {
        match self.shape_starts {
            ShapeStarts::Neutral => vec![self.parameters[1..].iter().map(|parameter| parameter.neutral).collect()],
            ShapeStarts::Grid(lists) => combinations(lists),
            ShapeStarts::AlongCanal { spacing_m, lengths_m } => {
                let places = ((to_m - from_m) / spacing_m).ceil().clamp(1.0, MAX_PLACES) as usize;
                let places_m = (0..places).map(|place| from_m + spacing_m * place as f64);
                places_m
                    .flat_map(|place_m| lengths_m.iter().map(move |&length_m| vec![place_m, length_m]))
                    .collect()
            }
        }
    }

    /// Values, about those at which a fit has stopped, from which a better fit may be reached; none where the fit has a single
    /// valley. They may lie outside the parameters' ranges.
    ///
    /// A stretch of the canal needs them: the objective has a kink wherever a tip comes to stand on the other side of one of its
    /// ends, and a descent stops at the first.
    pub fn restarts(&self, values: &[f64]) -> Vec<Vec<f64>> {
        let &[severity, from_m, length_m] = values else {
            return Vec::new();
        };
        if !self.has_place() {
            return Vec::new();
        }
        let neutral = self.severity().neutral;
        let mut restarts = Vec::with_capacity(END_SHIFTS.len().pow(2) * SEVERITY_FACTORS.len());
        for start in END_SHIFTS {
            for end in END_SHIFTS {
                restarts.extend(SEVERITY_FACTORS.map(|factor| {
                    vec![
                        neutral - factor * (neutral - severity),
                        from_m + start * length_m,
                        length_m * (1.0 + end - start),
                    ]
                }));
            }
        }
        restarts
    }
}

/// Every choice of one value from each list, the last list's changing fastest.
fn combinations(lists: &[&[f64]]) -> Vec<Vec<f64>> {
    lists.iter().fold(vec![Vec::new()], |chosen, list| {
        let extend = |chosen: Vec<f64>| list.iter().map(move |&value| [&chosen[..], &[value]].concat());
        chosen.into_iter().flat_map(extend).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::super::library::{LIBRARY, named};

    #[test]
    fn starting_shapes_have_a_value_for_every_parameter_within_its_range() {
        for effect in LIBRARY {
            for shape in effect.starting_shapes((-0.02, 0.4)) {
                assert_eq!(shape.len() + 1, effect.parameters.len(), "{}", effect.name);
                for (value, parameter) in shape.iter().zip(&effect.parameters[1..]) {
                    assert!((parameter.min..=parameter.max).contains(value), "{}", effect.name);
                }
            }
        }
        let breakaway = named("breakaway-friction").expect("an effect");
        let shapes = breakaway.starting_shapes((0.0, 0.0));
        assert_eq!(shapes[..3], [vec![1e-5, 0.05], vec![1e-5, 0.3], vec![1e-4, 0.05]]);
        let patch = named("slick-patch").expect("an effect");
        let shapes = patch.starting_shapes((0.1, 0.145));
        assert_eq!(shapes.len(), 6);
        assert_eq!(shapes[..2], [vec![0.1, 0.02], vec![0.1, 0.05]]);
        assert_eq!(patch.starting_shapes((0.0, 1e3)).len(), 120);
    }

    #[test]
    fn only_a_stretch_of_the_canal_is_restarted() {
        for effect in LIBRARY {
            let values = effect.values_with_neutral_shape(effect.severity().max);
            assert_eq!(
                !effect.restarts(&values).is_empty(),
                effect.has_place(),
                "{}",
                effect.name
            );
        }
        let patch = named("slick-patch").expect("an effect");
        let restarts = patch.restarts(&[0.5, 0.2, 0.1]);
        assert_eq!(restarts.len(), 147);
        assert_eq!(restarts[0], [0.5, 0.2 - 0.4 * 0.1, 0.1]);
        assert!(restarts.contains(&vec![0.5, 0.2, 0.1]));
    }
}

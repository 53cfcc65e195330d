//! The nearest formula of few terms.
//!
//! Terms are added one after the other as long as the evidence grows, each with a prior as wide as that of the law. The formula stands where
//! it predicts data held out as well as the law does.

use super::super::fit::Fit;
use super::super::plant::Plant;
use super::evidence::Scores;
use super::fit::{LawSearch, STEP, Start, fit_shape};
use super::fitted_law::FittedLaw;
use super::offer::Offer;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;
use std::sync::Arc;
use worm_physics::Axis;

/// Part of the largest term below which a term is left out of the text.
const NEGLIGIBLE: f64 = 0.02;
/// Singular values, as a fraction of the largest, below which a combination of terms is nothing.
const NEGLIGIBLE_PART: f64 = 1e-9;
/// Most terms.
const TERMS: usize = 3;
/// Logarithm of the Bayes factor that a further term must bring.
const FURTHER: f64 = 3.0;
/// Rise of the score on data held out up to which a formula is as good as the law.
const AS_GOOD: f64 = 4.0;
/// Steps along a place or a time that are tried, and time constants as a fraction of its width.
const STEPS: usize = 12;
const DECAYS: [f64; 3] = [0.1, 0.3, 0.7];
/// The same of a slide, and of a speed and a load of a motor: friction changes near rest.
const DECAYS_FROM_REST: [f64; 4] = [0.01, 0.03, 0.1, 0.3];
/// Width of the turn of a force that has the sign of its axis, as a fraction of the largest.
const TURN: f64 = 0.05;

/// A formula with its values.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::explain) struct Formula {
    /// In words and figures, in SI units.
    pub text: String,
    /// How many terms it has.
    pub terms: usize,
    /// Whether it says that the law is the same everywhere.
    pub is_constant: bool,
    /// Fall of the score on data held out.
    pub gain: f64,
}

/// A term, by its values at a coordinate; a wave has two parts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Term {
    Constant,
    /// To a power of 1 or 2.
    Power(i32),
    Magnitude,
    SignedSquare,
    Sign,
    Decay(f64),
    Step(f64),
    Wave(f64),
}

impl Term {
    /// Its parts at a coordinate; `scale` is the largest on the axis.
    fn parts(self, at: f64, scale: f64) -> [f64; 2] {
        let one = match self {
            Self::Constant => 1.0,
            Self::Power(power) => (at / scale).powi(power),
            Self::Magnitude => (at / scale).abs(),
            Self::SignedSquare => at * at.abs() / (scale * scale),
            Self::Sign => (at / (TURN * scale)).tanh(),
            Self::Decay(constant) => (-at / constant).exp(),
            Self::Step(from) => f64::from(u8::from(at >= from)),
            Self::Wave(period) => return [(TAU * at / period).sin(), (TAU * at / period).cos()],
        };
        [one, 0.0]
    }

    fn count(self) -> usize {
        if matches!(self, Self::Wave(_)) { 2 } else { 1 }
    }

    /// With its coefficients.
    fn text(self, by: &[f64], scale: f64, axis: Axis, unit: &str) -> String {
        let symbol = axis.name().replace('-', " ");
        let with = |value: f64, unit: String, rest: &str| {
            let unit = if unit.starts_with('/') {
                format!("1{unit}")
            } else {
                unit
            };
            let space = if unit.is_empty() { "" } else { " " };
            format!("{}{space}{unit}{rest}", figure(value))
        };
        let per = |power: i32| match (power, unit == axis.unit()) {
            (1, true) => String::new(),
            (1, false) => format!("{unit}/({})", axis.unit()),
            (_, true) => format!("/({})", axis.unit()),
            (_, false) => format!("{unit}/({})²", axis.unit()),
        };
        let whole = unit.to_owned();
        match self {
            Self::Constant => with(by[0], whole, ""),
            Self::Power(1) => with(by[0] / scale, per(1), &format!(" · {symbol}")),
            Self::Power(_) => with(by[0] / (scale * scale), per(2), &format!(" · {symbol}²")),
            Self::Magnitude => with(by[0] / scale, per(1), &format!(" · |{symbol}|")),
            Self::SignedSquare => with(by[0] / (scale * scale), per(2), &format!(" · {symbol}·|{symbol}|")),
            Self::Sign => with(by[0], whole, &format!(" · sign({symbol})")),
            Self::Decay(constant) => with(
                by[0],
                whole,
                &format!(" · exp(−{symbol} / {} {})", figure(constant), axis.unit()),
            ),
            Self::Step(from) => with(
                by[0],
                whole,
                &format!(" from {symbol} {} {} on", figure(from), axis.unit()),
            ),
            Self::Wave(period) => {
                let (height, angle) = (by[0].hypot(by[1]), by[1].atan2(by[0]));
                with(
                    height,
                    whole,
                    &format!(
                        " · sin(2π {symbol} / {} {} {} {:.2})",
                        figure(period),
                        axis.unit(),
                        if angle < 0.0 { '−' } else { '+' },
                        angle.abs()
                    ),
                )
            }
        }
    }
}

/// Three digits.
fn figure(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{value:.digits$}").replace('-', "−")
}

/// Terms that make sense over an axis.
fn terms(axis: Axis, grid: &[f64], period: Option<f64>) -> Vec<Term> {
    let (first, last) = (grid[0], grid[grid.len() - 1]);
    let width = last - first;
    let mut terms = vec![Term::Constant];
    match axis {
        Axis::Place | Axis::Time => {
            terms.extend([Term::Power(1), Term::Power(2)]);
            terms.extend(DECAYS.map(|part| Term::Decay(part * width)));
            terms.extend((1..STEPS).map(|step| Term::Step(first + width * step as f64 / STEPS as f64)));
        }
        Axis::Phase => {
            terms.extend([1.0, 0.5].map(Term::Wave));
            terms.extend((1..8).map(|step| Term::Step(step as f64 / 8.0)));
        }
        Axis::Slope => terms.extend([Term::Power(1), Term::Power(2)]),
        Axis::RecentSlide => {
            terms.push(Term::Power(1));
            terms.extend(DECAYS_FROM_REST.map(|part| Term::Decay(part * width)));
        }
        Axis::Deformation | Axis::DeformationRate | Axis::RecentDeformation | Axis::Speed | Axis::Load => {
            terms.extend([
                Term::Power(1),
                Term::Power(2),
                Term::Magnitude,
                Term::SignedSquare,
                Term::Sign,
            ])
        }
        Axis::OutputLoad => terms.extend([Term::Power(1), Term::Power(2), Term::Magnitude, Term::Sign]),
        // These two have no sign.
        Axis::MotorSpeed | Axis::GearLoad => {
            terms.extend([Term::Power(1), Term::Power(2)]);
            terms.extend(DECAYS_FROM_REST.map(|part| Term::Decay(part * width)));
        }
        Axis::MotorAngle => terms.extend([Term::Power(1), Term::Wave(TAU), Term::Wave(0.5 * TAU)]),
    }
    terms.extend(period.filter(|_| axis != Axis::Phase).map(Term::Wave));
    terms
}

/// The formula that comes nearest to a fitted law, of one axis; none where none predicts as well.
pub(super) fn nearest<P: Plant>(
    search: &LawSearch<'_, '_, P>,
    law: &FittedLaw,
    (offer, scores): (&Offer, &Scores),
) -> Option<Formula> {
    let [(axis, grid)] = &offer.shape.axes[..] else {
        return None;
    };
    let scale = grid.iter().fold(0.0, |max: f64, at| max.max(at.abs())).max(1e-9);
    let sigma = offer.sigmas[2];
    let dictionary = terms(*axis, grid, law.shape.period);
    let columns = |terms: &[Term]| -> Vec<Vec<f64>> {
        let parts = terms
            .iter()
            .flat_map(|term| (0..term.count()).map(move |part| (term, part)));
        let of = |(term, part): (&Term, usize)| grid.iter().map(|at| sigma * term.parts(*at, scale)[part]).collect();
        parts.map(of).collect()
    };
    let root = |columns: &[Vec<f64>]| DMatrix::from_fn(grid.len(), columns.len(), |row, column| columns[column][row]);
    let ln_bayes = |terms: &[Term]| scores.ln_bayes(&root(&columns(terms)));
    let mut chosen: Vec<Term> = Vec::new();
    let mut best = 0.0;
    while chosen.len() < TERMS {
        let with = |term: &Term| [&chosen[..], &[*term]].concat();
        let tried = dictionary.iter().filter(|term| !chosen.contains(term));
        let next = tried.map(|term| (*term, ln_bayes(&with(term))));
        let (term, found) = next.max_by(|a, b| a.1.total_cmp(&b.1))?;
        if found < best + FURTHER {
            break;
        }
        best = found;
        chosen.push(term);
    }
    if chosen.is_empty() {
        return None;
    }
    let columns = columns(&chosen);
    let mut shape = offer.shape.clone();
    shape.columns.clone_from(&columns);
    let as_law = law.besides(search.problem, shape.clone());
    let starts = [
        (search.recalibrated, scores.most_probable(&root(&columns))),
        (&as_law, nearest_to(&law.beyond, &columns)),
    ];
    let chi_squared = |(from, at): &(&Fit, Vec<f64>)| {
        let hypothesis = search.recalibrated.hypothesis.with_law(Arc::new(shape.clone()), STEP);
        search
            .problem
            .evaluate(&hypothesis, [&from.at[..], at].concat())
            .chi_squared
    };
    let start = starts
        .into_iter()
        .min_by(|a, b| chi_squared(a).total_cmp(&chi_squared(b)))?;
    let fitted = fit_shape(
        search,
        Start {
            from: start.0,
            at: start.1,
            known: scores.by_columns(&columns),
            on_grid: columns,
            left: Vec::new(),
            seen: Vec::new(),
            shape,
        },
    );
    if fitted.gain < law.gain - AS_GOOD {
        return None;
    }
    let by = fitted.fit.hypothesis.law_coefficients(&fitted.fit.at);
    let mut from = 0;
    let mut text = String::new();
    let largest = |by: &[f64], term: &Term| {
        let at = |at: &f64| -> f64 { term.parts(*at, scale).iter().zip(by).map(|(part, by)| part * by).sum() };
        grid.iter().map(|here| at(here).abs()).fold(0.0, f64::max)
    };
    let mut of_terms: Vec<(Term, Vec<f64>, f64)> = Vec::new();
    for term in &chosen {
        let by: Vec<f64> = by[from..from + term.count()].iter().map(|by| sigma * by).collect();
        from += term.count();
        let most = largest(&by, term);
        of_terms.push((*term, by, most));
    }
    let most = of_terms.iter().map(|(_, _, most)| *most).fold(0.0, f64::max);
    // What the fit to the end leaves nothing of is not written.
    of_terms.retain(|(_, _, of_term)| *of_term > NEGLIGIBLE * most);
    let is_constant = of_terms.iter().all(|(term, _, _)| *term == Term::Constant);
    let count = of_terms.len();
    // The values are those beyond neutral.
    let neutral = law.shape.acts_on.neutral();
    if neutral != 0.0 {
        let constant = of_terms.iter().position(|(term, _, _)| *term == Term::Constant);
        let beyond = constant.map_or(0.0, |place| of_terms.remove(place).1[0]);
        of_terms.insert(0, (Term::Constant, vec![neutral + beyond], neutral));
    }
    for (term, by, _) in &of_terms {
        let part = term.text(by, scale, *axis, law.shape.acts_on.unit());
        text += &match (text.is_empty(), part.strip_prefix('−')) {
            (true, _) => part,
            (false, Some(rest)) => format!(" − {rest}"),
            (false, None) => format!(" + {part}"),
        };
    }
    Some(Formula {
        text,
        terms: count,
        is_constant,
        gain: fitted.gain,
    })
}

/// The coefficients with which columns come nearest to some values.
fn nearest_to(values: &[f64], columns: &[Vec<f64>]) -> Vec<f64> {
    let matrix = DMatrix::from_fn(values.len(), columns.len(), |row, column| columns[column][row]);
    let solved = matrix
        .svd(true, true)
        .solve(&DVector::from_column_slice(values), NEGLIGIBLE_PART);
    solved.map_or_else(|_| vec![0.0; columns.len()], |solved| solved.as_slice().to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_term_is_written_with_its_unit() {
        for (term, by, axis, unit, expected) in [
            (Term::Constant, 0.125, Axis::Speed, "N", "0.125 N"),
            (Term::Power(1), 0.2, Axis::Speed, "N", "20.0 N/(m/s) · speed"),
            (Term::Power(1), -0.3, Axis::Time, "", "−30.0 1/(cycles) · time"),
            (Term::Step(0.05), -0.4, Axis::Place, "", "−0.400 from place 0.0500 m on"),
            (Term::Power(1), 3e-3, Axis::GearLoad, "N m", "0.300 · gear load"),
            (
                Term::Power(2),
                2e-5,
                Axis::GearLoad,
                "N m",
                "0.200 1/(N m) · gear load²",
            ),
        ] {
            let text = term.text(&[by], 0.01, axis, unit);
            assert_eq!(text, expected);
        }
        let wave = Term::Wave(0.041).text(&[0.3, 0.4], 0.2, Axis::Place, "N");
        assert_eq!(wave, "0.500 N · sin(2π place / 0.0410 m + 0.93)");
    }
}

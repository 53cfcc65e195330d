//! What the search may vary: nuisances within their priors, and the parameters of effects.
//!
//! Recalibration hides effects: with friction, stiffness and the like free, much of an effect disappears into them. So they are free only
//! within what is not known of a machine that was built and measured with care, and what remains after fitting them is the gap. The
//! priors are normal about the nominal value, with limits; a value on its limit is reported.

use crate::least_squares::Quantity;
use worm_physics::effect::{Effect, Parameter};

/// Standard deviation of the prior of an effect's severity, in notable changes: 3° of slope, 0.4 N of drag, 0.4 of one cell's
/// friction.
const SEVERE: f64 = 20.0;

/// Limit of a law's coefficient, in standard deviations.
const MOST_OF_LAW: f64 = 12.0;

/// Shortest time for which an effect acts that begins and ends, cycles: what acts in one cycle alone is seen once by every cell, and any
/// event looks like some effect then.
const SHORTEST_SPELL: f64 = 2.0;

/// A quantity that is free in a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::explain) struct Free {
    pub what: What,
    /// Its prior and its limits.
    pub quantity: Quantity,
}

/// What a free quantity is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::explain) enum What {
    /// The plant's nuisance of this number: not known exactly, and no effect is about it.
    Nuisance(usize),
    /// A coefficient of the law, of this number.
    Law(usize),
    /// A parameter of the effect in this place of the hypothesis.
    Effect { place: usize, parameter: usize },
}

impl Free {
    /// A coefficient of a law: normal, of unit variance.
    pub fn of_law(number: usize, step: f64) -> Self {
        Self {
            what: What::Law(number),
            quantity: Quantity {
                centre: 0.0,
                sigma: 1.0,
                min: -MOST_OF_LAW,
                max: MOST_OF_LAW,
                step,
            },
        }
    }

    /// A parameter of an effect. Shape parameters have no prior but their range. The severity has a weak one about neutral, so that it
    /// returns there when the data that show it are left out.
    pub fn of_effect(place: usize, number: usize, parameter: &Parameter) -> Self {
        Self {
            what: What::Effect {
                place,
                parameter: number,
            },
            quantity: Quantity {
                centre: parameter.neutral,
                sigma: if number == 0 {
                    SEVERE * parameter.notable
                } else {
                    f64::INFINITY
                },
                min: parameter.min,
                max: parameter.max,
                step: 0.2 * parameter.notable,
            },
        }
    }
}

/// When an effect begins, ends, or does both, that does not act throughout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::explain) struct Onset {
    /// When it begins, cycles since the first sample of the run; it acts from the start on for none.
    pub begins: Option<f64>,
    /// When it ends, likewise; it acts to the end for none.
    pub ends: Option<f64>,
    /// The run in which it happens, once: the runs before and after are as at its start and its end. In every run for none.
    pub run: Option<usize>,
}

impl Onset {
    /// An effect that begins and stays.
    pub fn from(cycle: f64, run: Option<usize>) -> Self {
        Self {
            begins: Some(cycle),
            ends: None,
            run,
        }
    }

    /// An effect that acts from the start on and ends.
    pub fn until(cycle: f64, run: Option<usize>) -> Self {
        Self {
            begins: None,
            ends: Some(cycle),
            run,
        }
    }

    /// The same so many cycles later.
    pub fn moved(self, cycles: f64) -> Self {
        Self {
            begins: self.begins.map(|begins| begins + cycles),
            ends: self.ends.map(|ends| ends + cycles),
            ..self
        }
    }

    /// Whether it begins and ends again.
    pub fn comes_and_goes(&self) -> bool {
        self.begins.is_some() && self.ends.is_some()
    }

    /// For how many cycles it acts, where it begins and ends again.
    fn lasts(&self) -> Option<f64> {
        Some(self.ends? - self.begins?)
    }

    /// Whether it ends sooner than it may.
    pub fn is_too_short(&self) -> bool {
        self.lasts().is_some_and(|cycles| cycles < SHORTEST_SPELL)
    }

    /// Whether it ends as soon as it may.
    pub fn is_shortest(&self) -> bool {
        self.lasts().is_some_and(|cycles| cycles <= SHORTEST_SPELL)
    }

    /// Whether the effect begins or ends in a run.
    pub fn is_in(&self, run: usize) -> bool {
        self.run.is_none_or(|of| of == run)
    }

    /// Whether the effect acts so many cycles after the start of a run.
    pub fn acts_at(&self, run: usize, cycle: f64) -> bool {
        match self.run {
            Some(of) if run < of => self.begins.is_none(),
            Some(of) if run > of => self.ends.is_none(),
            _ => self.begins.is_none_or(|begins| cycle >= begins) && self.ends.is_none_or(|ends| cycle < ends),
        }
    }

    /// Whether the effect acts at some time of a run.
    pub fn acts_in(&self, run: usize) -> bool {
        self.is_in(run) || self.acts_at(run, 0.0)
    }
}

/// An effect assumed to act, on one cell or on all that it concerns.
#[derive(Debug, Clone, Copy)]
pub(in crate::explain) struct Hypothesised {
    pub effect: &'static Effect,
    pub cell: Option<usize>,
    /// When it begins or ends; it acts throughout for none.
    pub onset: Option<Onset>,
    /// The data may tell it from its twins, which are those of positions alone.
    pub without_twins: bool,
}

impl Hypothesised {
    /// An effect that acts throughout.
    pub fn throughout(effect: &'static Effect, cell: Option<usize>) -> Self {
        Self {
            effect,
            cell,
            onset: None,
            without_twins: false,
        }
    }

    /// Names and descriptions of what the data cannot distinguish from it.
    pub fn twins(&self) -> Vec<&'static str> {
        if self.without_twins {
            Vec::new()
        } else {
            self.effect.all_twins(self.cell)
        }
    }

    /// Whether the data cannot distinguish two effects.
    pub fn is_twin_of(&self, other: &Self) -> bool {
        !self.without_twins && self.cell.is_none() && other.cell.is_none() && self.effect.is_twin_of(other.effect)
    }

    /// Whether it is the same effect of the same cell, whenever it begins.
    pub fn is_same_effect(&self, other: &Self) -> bool {
        self.effect.name == other.effect.name && self.cell == other.cell
    }
}

impl PartialEq for Hypothesised {
    fn eq(&self, other: &Self) -> bool {
        self.is_same_effect(other) && self.onset == other.onset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_happens_in_one_run_lasts_and_what_happens_in_each_does_not() {
        let (yes, no) = (true, false);
        for (run, ends, at_start, at_end) in [
            (Some(1), no, [no, no, yes], [no, yes, yes]),
            (Some(1), yes, [yes, yes, no], [yes, no, no]),
            (None, no, [no, no, no], [yes, yes, yes]),
            (None, yes, [yes, yes, yes], [no, no, no]),
        ] {
            let onset = [Onset::from, Onset::until][usize::from(ends)](4.0, run);
            let found = [0, 1, 2].map(|run| (onset.acts_at(run, 0.0), onset.acts_at(run, f64::INFINITY)));
            assert_eq!(found.map(|(start, _)| start), at_start, "{onset:?}");
            assert_eq!(found.map(|(_, end)| end), at_end, "{onset:?}");
        }
        let spell = Onset {
            ends: Some(6.0),
            ..Onset::from(4.0, Some(1))
        };
        let acts = [0, 1, 2].map(|run| [0.0, 3.9, 4.0, 5.9, 6.0].map(|cycle| spell.acts_at(run, cycle)));
        assert_eq!(acts, [[no; 5], [no, no, yes, yes, no], [no; 5]]);
        assert_eq!([0, 1, 2].map(|run| spell.acts_in(run)), [no, yes, no]);
    }
}

//! Faults as a person asks for them: `KIND[:param=value[,param=value…]][@START[..END]]`.
//!
//! Without a window a fault holds from the start of the process to its end. With a window, START and END are **seconds
//! since the worm began to crawl**, that is since the first goal velocity other than zero that the motor obeyed; `@..END`
//! holds from the start of the process, `@START` to the end of it.
//!
//! A fault that is switched on while the worm runs holds from that moment on, and START and END are seconds since then.
//!
//! What kinds there are, with which parameters and what effect, stands in one table, `fault_kinds`.

use super::conditions::Conditions;
use super::fault_kinds::{Domain, FaultKind, KINDS};
use std::fmt::Write as _;
use std::str::FromStr;

/// Why a fault specification was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FaultError {
    /// No such kind.
    #[error("there is no fault \"{kind}\": use one of {known}")]
    UnknownKind {
        /// The given name.
        kind: String,
        /// All there are.
        known: String,
    },
    /// A parameter that this kind does not have, or a piece that is none.
    #[error("\"{piece}\" is no parameter of the fault {kind}: {known}")]
    UnknownParameter {
        /// The kind.
        kind: &'static str,
        /// What was found.
        piece: String,
        /// What is possible.
        known: String,
    },
    /// A parameter that must be given.
    #[error("the fault {kind} needs {parameter}=…: {known}")]
    Missing {
        /// The kind.
        kind: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// What is possible.
        known: String,
    },
    /// A value outside its domain.
    #[error("{parameter}={value} of the fault {kind}: must be {domain}")]
    Value {
        /// The kind.
        kind: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// What was given.
        value: String,
        /// What is possible.
        domain: String,
    },
    /// A window that is none.
    #[error(
        "\"@{window}\" is no window: write @START, @START..END or @..END in seconds since the worm began to crawl, START before END, both at least 0"
    )]
    Window {
        /// What was given.
        window: String,
    },
}

/// One fault: what, and when.
#[derive(Clone)]
pub struct Fault {
    kind: &'static FaultKind,
    values: Vec<f64>, // one for each parameter of the kind
    from_s: Option<f64>,
    until_s: Option<f64>,
    /// Time of the process from which on everything is counted, s, for one that was switched on while the worm ran.
    switched_on_s: Option<f64>,
}

impl std::fmt::Debug for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}{:?} from {:?} until {:?}",
            self.kind.name, self.values, self.from_s, self.until_s
        )
    }
}

impl Fault {
    /// Whether it holds, `process_s` after the start of the process and `crawl_s` after the worm began to crawl.
    pub fn holds(&self, process_s: f64, crawl_s: Option<f64>) -> bool {
        let began_s = self.since_s(process_s, crawl_s);
        began_s.is_some_and(|since_s| since_s >= 0.0) && !self.is_over(process_s, crawl_s)
    }

    /// Whether it will not hold any more, `process_s` after the start of the process and `crawl_s` after the worm began to crawl.
    pub fn is_over(&self, process_s: f64, crawl_s: Option<f64>) -> bool {
        let began_s = self.since_s(process_s, crawl_s);
        let (_, crawl_s) = self.clock(process_s, crawl_s);
        let spent = self
            .kind
            .lasts
            .zip(began_s)
            .is_some_and(|(parameter, since_s)| since_s >= self.values[parameter]);
        let over = self
            .until_s
            .zip(crawl_s)
            .is_some_and(|(until_s, crawl_s)| crawl_s >= until_s);
        spent || over
    }

    /// Time since it began, s; negative before.
    fn since_s(&self, process_s: f64, crawl_s: Option<f64>) -> Option<f64> {
        let (process_s, crawl_s) = self.clock(process_s, crawl_s);
        match self.from_s {
            None => Some(process_s),
            Some(from_s) => crawl_s.map(|crawl_s| crawl_s - from_s),
        }
    }

    /// The times from which on its start and its window are counted.
    fn clock(&self, process_s: f64, crawl_s: Option<f64>) -> (f64, Option<f64>) {
        match self.switched_on_s {
            Some(switched_on_s) => (process_s - switched_on_s, Some(process_s - switched_on_s)),
            None => (process_s, crawl_s),
        }
    }

    /// The same fault, switched on while the worm runs, `process_s` after the start of the process.
    pub fn switched_on(self, process_s: f64) -> Self {
        Self {
            switched_on_s: Some(process_s),
            ..self
        }
    }

    /// Changes what it changes.
    pub fn apply(&self, conditions: &mut Conditions) {
        (self.kind.apply)(conditions, &self.values);
    }

    /// The greatest cell that it names; 0 when it names none.
    pub fn greatest_cell(&self) -> usize {
        let named = self
            .kind
            .parameters
            .iter()
            .zip(&self.values)
            .filter(|(parameter, _)| matches!(parameter.domain, Domain::Cell));
        named.map(|(_, &value)| value as usize).max().unwrap_or(0)
    }

    /// Name of the kind.
    pub fn name(&self) -> &'static str {
        self.kind.name
    }

    /// The names of all kinds.
    pub fn kinds() -> impl Iterator<Item = &'static str> {
        KINDS.iter().map(|kind| kind.name)
    }

    /// The grammar and every kind, for the help text.
    pub fn help() -> String {
        let mut help = String::from(
            "Faults: KIND[:param=value[,param=value...]][@START[..END]], START and END in seconds since the worm began to\n\
             crawl (first goal velocity other than zero); without a window the fault holds from the start.\n",
        );
        for kind in KINDS {
            let usage = kind.usage();
            let _infallible = writeln!(help, "  {usage:<38} {}", kind.meaning);
        }
        help
    }
}

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let (what, window) = match text.split_once('@') {
            Some((what, window)) => (what, Some(window)),
            None => (text, None),
        };
        let (name, pieces) = what.split_once(':').unwrap_or((what, ""));
        let kind = KINDS
            .iter()
            .find(|kind| kind.name == name)
            .ok_or_else(|| FaultError::UnknownKind {
                kind: name.to_owned(),
                known: Self::kinds().collect::<Vec<_>>().join(", "),
            })?;
        let mut given = vec![None; kind.parameters.len()];
        for piece in pieces.split(',').filter(|piece| !piece.is_empty()) {
            let named = piece.split_once('=').and_then(|(name, value)| {
                let index = kind.parameters.iter().position(|parameter| parameter.name == name)?;
                Some((index, value))
            });
            let (index, value) = named.ok_or_else(|| FaultError::UnknownParameter {
                kind: kind.name,
                piece: piece.to_owned(),
                known: kind.known_parameters(),
            })?;
            let parameter = &kind.parameters[index];
            given[index] = Some(parameter.domain.parse(value).ok_or_else(|| FaultError::Value {
                kind: kind.name,
                parameter: parameter.name,
                value: value.to_owned(),
                domain: parameter.domain.to_string(),
            })?);
        }
        let values = kind.parameters.iter().zip(given).map(|(parameter, given)| {
            given.or(parameter.default).ok_or_else(|| FaultError::Missing {
                kind: kind.name,
                parameter: parameter.name,
                known: kind.known_parameters(),
            })
        });
        let (from_s, until_s) = window.map_or(Ok((None, None)), parse_window)?;
        Ok(Self {
            kind,
            values: values.collect::<Result<_, _>>()?,
            from_s,
            until_s,
            switched_on_s: None,
        })
    }
}

/// As one would write it; without the moment at which it was switched on.
impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.kind.name)?;
        for (index, (parameter, &value)) in self.kind.parameters.iter().zip(&self.values).enumerate() {
            let separator = if index == 0 { ':' } else { ',' };
            write!(f, "{separator}{}={}", parameter.name, parameter.domain.text(value))?;
        }
        match (self.from_s, self.until_s) {
            (None, None) => Ok(()),
            (Some(from_s), None) => write!(f, "@{from_s}"),
            (from_s, Some(until_s)) => {
                f.write_str("@")?;
                if let Some(from_s) = from_s {
                    write!(f, "{from_s}")?;
                }
                write!(f, "..{until_s}")
            }
        }
    }
}

/// `START`, `START..END`, `START..` or `..END`.
fn parse_window(window: &str) -> Result<(Option<f64>, Option<f64>), FaultError> {
    let refuse = || FaultError::Window {
        window: window.to_owned(),
    };
    let seconds = |text: &str| match text {
        "" => Ok(None),
        text => match text.parse::<f64>() {
            Ok(seconds) if seconds >= 0.0 && seconds.is_finite() => Ok(Some(seconds)),
            _ => Err(refuse()),
        },
    };
    let (from, until) = window.split_once("..").unwrap_or((window, ""));
    match (seconds(from)?, seconds(until)?) {
        (None, None) => Err(refuse()),
        (Some(from), Some(until)) if from >= until => Err(refuse()),
        bounds => Ok(bounds),
    }
}

#[cfg(test)]
mod tests;

//! The configuration that a log carries: the one that was given, or else that of the worm which runs.

use super::log_head::LogHead;
use crate::topics::{Instance, RunningConfiguration};
use std::path::Path;
use worm_estimator::config::Config;
use worm_log::{Note, Origin};

/// Looks for the configuration of a worm, until it is known or the worm was heard without it.
#[derive(Debug)]
pub(crate) struct CarriedConfiguration {
    instance: Instance,
    /// The one that was given.
    given: Option<Config>,
    is_settled: bool,
}

/// What was found out about the configuration of a log.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Finding {
    /// It is this.
    Configuration {
        /// The text of its file.
        text: String,
        /// The cells of its worm, where this version can read it.
        cells: Option<usize>,
    },
    /// Something that a reader of the log should know.
    Note(Note),
}

impl CarriedConfiguration {
    /// For a log of this worm; `given` is the configuration, where one was given.
    pub(crate) fn new(instance: &Instance, given: Option<&Config>) -> Self {
        Self {
            instance: instance.clone(),
            given: given.cloned(),
            is_settled: false,
        }
    }

    /// What is to be said in the log. `is_heard`: messages of the worm have come, so its controller has left what it leaves.
    pub(crate) fn look(&mut self, is_heard: bool) -> Option<Finding> {
        if self.is_settled {
            return None;
        }
        let running = RunningConfiguration::of(&self.instance);
        self.is_settled = running.is_some() || is_heard;
        let finding = match (running, &self.given) {
            (None, None) if is_heard => Finding::Note(Note::of(
                "the configuration of the worm is not known: its controller did not say, and the recorder was given none; the worm of the \
                 paper is assumed where --config names no other",
            )),
            (None, _) | (Some(RunningConfiguration::Paper), None) => return None,
            (Some(RunningConfiguration::Text(text)), None) => Finding::Configuration {
                cells: read(&text).map(|config| config.worm.cells),
                text,
            },
            (Some(running), Some(given)) => {
                if is_same(&running, given) {
                    return None;
                }
                Finding::Note(Note::of(
                    "the configuration in this log was given to the recorder, and the worm ran with another",
                ))
            }
        };
        if let Finding::Note(note) = &finding {
            tracing::warn!("{}: record with the --config of the worm", note.text);
        }
        Some(finding)
    }
}

/// Whether the worm runs with this configuration, whatever differs in what no analysis needs: name, place and who looks on.
fn is_same(running: &RunningConfiguration, given: &Config) -> bool {
    let running = match running {
        RunningConfiguration::Paper => Some(Config::default()),
        RunningConfiguration::Text(text) => read(text),
    };
    running.is_some_and(|mut running| {
        running.worm.name.clone_from(&given.worm.name);
        running.port.clone_from(&given.port);
        (running.black_box, running.topics, running.realtime) =
            (given.black_box.clone(), given.topics.clone(), given.realtime.clone());
        running == *given
    })
}

fn read(text: &str) -> Option<Config> {
    Config::from_toml(text, Path::new("the configuration of the running worm")).ok()
}

impl Finding {
    /// Puts it into what stands at the beginning of a log.
    pub(crate) fn note_in(&self, origin: &mut Origin, notes: &mut Vec<Note>) {
        match self {
            Self::Configuration { text, cells } => {
                origin.config = Some(text.clone());
                origin.cells = cells.unwrap_or(origin.cells);
            }
            Self::Note(note) => notes.push(note.clone()),
        }
    }
}

impl LogHead {
    /// Takes in what was found out about the configuration.
    pub(super) fn take_in(&mut self, finding: &Finding) {
        finding.note_in(&mut self.origin, &mut self.notes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics::{Controller, RoleLock, SharedConfiguration};

    const FIVE_CELLS: &str = "[worm]\ncells = 5\nstep_order = [1, 2, 3, 4, 5]\n";

    fn note(finding: Option<Finding>) -> String {
        match finding {
            Some(Finding::Note(note)) => note.text,
            other => panic!("{other:?} is no note"),
        }
    }

    #[test]
    fn a_log_by_name_carries_the_configuration_of_the_worm_that_runs_and_says_where_it_is_not_known() {
        let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let instance = Instance::new(root.path(), "carried").expect("an instance");
        let by_name = || CarriedConfiguration::new(&instance, None);
        let mut early = by_name();
        assert_eq!(early.look(false), None, "nothing runs yet");

        let role = RoleLock::<Controller>::take(&instance).expect("nobody else has it");
        let shared = SharedConfiguration::leave(&role, Some(FIVE_CELLS)).expect("it can be written");
        let running = Some(Finding::Configuration {
            text: FIVE_CELLS.to_owned(),
            cells: Some(5),
        });
        assert_eq!(by_name().look(false), running);
        assert_eq!(early.look(true), running, "one that was there before the worm");
        assert_eq!(early.look(true), None, "it is said once");

        let mut given = Config::from_toml(FIVE_CELLS, Path::new("given")).expect("valid");
        given.worm.name = "carried".to_owned();
        assert_eq!(CarriedConfiguration::new(&instance, Some(&given)).look(true), None);
        let another = CarriedConfiguration::new(&instance, Some(&Config::default())).look(false);
        assert!(note(another).contains("ran with another"));

        drop(shared);
        assert_eq!(by_name().look(false), None, "the controller may be about to say it");
        assert!(note(by_name().look(true)).contains("is not known"));
        let shared = SharedConfiguration::leave(&role, None).expect("it can be written");
        assert_eq!(by_name().look(true), None, "the worm of the paper");
        drop(shared);
    }
}

//! What the folder of a black box does not show: boxes that could not be written yet, and what stands at the running worm meanwhile.

use super::folder::Folder;
use crate::topics::{BlackBox, Controller, Estimator, Hub, Instance, RoleLock, Subscriber, Topic};
use crate::why::timeline::fault_name;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;
use worm_estimator::message::{AlarmKind, BlackBoxStatus, Estimate, Mode, RecordingProblem, RecordingState, State};

/// How long a running worm is listened to: a black box reports once a second.
const LISTENING: Duration = Duration::from_millis(1500);
/// Time between two looks.
const LOOK: Duration = Duration::from_millis(10);

/// What stands at a worm that runs here.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Standing {
    worm: String,
    /// The latched fault, as `alarm motor-stall`.
    fault: Option<String>,
    /// The alarms that stand, but for those about recordings.
    raised: Vec<&'static str>,
    keeping: Keeping,
}

/// What the black box of a worm does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Keeping {
    /// None runs.
    NoneRuns,
    /// It writes, or does not say.
    Writes,
    /// It goes on in memory.
    InMemory(RecordingProblem),
}

impl Standing {
    /// Asks the topics; none where nothing of the worm runs here, or this user cannot ask.
    pub(crate) fn ask(config: &Config) -> Option<Self> {
        let instance = Instance::of(config).ok()?;
        let controls = RoleLock::<Controller>::holder(&instance).is_some();
        let estimates = RoleLock::<Estimator>::holder(&instance).is_some();
        let keeps = RoleLock::<BlackBox>::holder(&instance).is_some();
        if !controls && !keeps {
            // To look for it makes its folder.
            instance.remove_folder_if_empty();
            return None;
        }
        let hub = Hub::open(&instance).ok()?;
        let begun = Instant::now();
        let state: Option<State> = newest(&hub, controls, begun);
        let estimate: Option<Estimate> = newest(&hub, estimates, begun);
        let status: Option<BlackBoxStatus> = newest(&hub, keeps, begun);
        let fault = state.filter(|state| state.mode == Mode::Fault.code());
        let mask = estimate.map_or(0, |estimate| estimate.raised_mask);
        let is_raised = |kind: &&AlarmKind| **kind != AlarmKind::RecordingStopped && mask >> kind.code() & 1 == 1;
        Some(Self {
            worm: instance.worm().to_owned(),
            fault: fault.map(|state| fault_name(&state)),
            raised: AlarmKind::ALL
                .iter()
                .filter(is_raised)
                .map(|kind| kind.name())
                .collect(),
            keeping: match status {
                Some(status) if status.state == RecordingState::Stopped.code() => {
                    Keeping::InMemory(RecordingProblem::try_from(status.problem).unwrap_or(RecordingProblem::None))
                }
                _ if keeps => Keeping::Writes,
                _ => Keeping::NoneRuns,
            },
        })
    }

    /// The fault and the alarms that stand, in words; none where none does.
    fn trouble(&self) -> Option<String> {
        let alarms = match self.raised.as_slice() {
            [] => None,
            [alarm] => Some(format!("the alarm {alarm} stands")),
            alarms => Some(format!("the alarms {} stand", alarms.join(", "))),
        };
        let fault = self.fault.as_ref().map(|fault| format!("the fault {fault} is latched"));
        let both: Vec<String> = fault.into_iter().chain(alarms).collect();
        (!both.is_empty()).then(|| format!("{}: {}", self.worm, both.join(", ")))
    }
}

/// The newest message of a topic that somebody publishes; none when none comes in time.
fn newest<T: Topic>(hub: &Hub, is_published: bool, begun: Instant) -> Option<T> {
    if !is_published {
        return None;
    }
    let mut subscriber: Subscriber<T> = hub.subscriber().ok()?;
    loop {
        match subscriber.latest() {
            Ok(Some(found)) => return Some(*found),
            Ok(None) if begun.elapsed() < LISTENING => std::thread::sleep(LOOK),
            _ => return None,
        }
    }
}

/// What is missing in a folder that shows some boxes, one remark each.
pub(crate) fn remarks(folder: &Folder, standing: Option<&Standing>) -> Vec<String> {
    let mut remarks = Vec::new();
    let unwritten = folder.unwritten();
    if !unwritten.is_empty() {
        remarks.push(format!(
            "{} could not be written yet: while the black box runs, it has it in memory and writes it once there is room",
            unwritten.join(", ")
        ));
    }
    if let Some(Standing {
        worm,
        keeping: Keeping::InMemory(problem),
        ..
    }) = standing
    {
        remarks.push(format!(
            "the black box of {worm} cannot write ({problem}): what is newer waits in its memory: make room in the folder or permit writing, \
             and it is written within seconds"
        ));
    }
    remarks
}

/// Why a folder shows no box.
pub(crate) fn why_no_box(folder: &Folder, standing: Option<&Standing>) -> String {
    let remarks = remarks(folder, standing);
    let trouble = standing.and_then(Standing::trouble);
    let mut parts: Vec<String> = trouble.iter().cloned().chain(remarks).collect();
    match standing.map(|standing| standing.keeping) {
        Some(Keeping::NoneRuns) if trouble.is_some() => parts.push(
            "no black box of it runs that would have kept this: `wormd record --black-box DIR` starts one".to_owned(),
        ),
        Some(Keeping::Writes) if trouble.is_some() => parts.push(
            "its black box runs, and either began after this or writes to another folder, which --folder names"
                .to_owned(),
        ),
        _ => {}
    }
    if parts.is_empty() {
        parts.push("no alarm or fault was kept here".to_owned());
    }
    format!("there is no box yet: {}", parts.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CALM: &str = "no alarm or fault was kept here";

    #[test]
    fn what_stands_or_waits_is_said_and_never_that_there_is_nothing() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = Folder::new(place.path());
        let standing = |fault: Option<&str>, raised: &[&'static str], keeping| Standing {
            worm: "w".to_owned(),
            fault: fault.map(str::to_owned),
            raised: raised.to_vec(),
            keeping,
        };
        let stalled = Some("alarm motor-stall");
        let full = Keeping::InMemory(RecordingProblem::DiskFull);
        for (standing, wanted) in [
            (None, [CALM, "no box yet"]),
            (Some(standing(None, &[], Keeping::Writes)), [CALM, "no box yet"]),
            (
                Some(standing(stalled, &[], full)),
                [
                    "w: the fault alarm motor-stall is latched; ",
                    "cannot write (disk-full)",
                ],
            ),
            (
                Some(standing(None, &["sliding-down", "no-progress"], Keeping::NoneRuns)),
                ["the alarms sliding-down, no-progress stand", "no black box of it runs"],
            ),
            (
                Some(standing(stalled, &["motor-stall"], Keeping::Writes)),
                ["is latched, the alarm motor-stall stands", "began after this"],
            ),
        ] {
            let text = why_no_box(&folder, standing.as_ref());
            assert!(wanted.iter().all(|part| text.contains(part)), "{standing:?}: {text}");
            assert_eq!(text.contains(CALM), wanted[0] == CALM, "{text}");
        }
        let name = "box-000003-20261124T201533Z-motor-stall.mcap.part";
        std::fs::write(place.path().join(name), b"").expect("room");
        let text = why_no_box(&folder, None);
        assert!(text.contains(&format!("{name} could not be written yet")), "{text}");
        assert!(!text.contains(CALM), "{text}");
        assert_eq!(folder.boxes().expect("readable").len(), 0);
    }
}

//! The worm of a robot elsewhere, which `wormd fleet` offers here, on its way into a log.
//!
//! Its topics are not in this computer's memory. What comes are the frames of its relay, 20 a second; [`intake`] makes messages of
//! them, and the writing is that of every recording. While nothing comes nothing is recorded, and the log says so.

mod intake;
mod once;

use super::file_series::FileOptions;
use super::log_file::creation_failure;
use super::log_writer::LogWriter;
use super::progress::Progress;
use super::{Recording, summary, take_full_files_as_errors};
use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::relay::client::{Received, RelayLink};
use crate::relay::wire::Line;
use crate::topics::{Controller, Instance, Relay, RoleLock};
use intake::{Intake, Step};
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};
use worm_log::{Channel, Note};

/// How long a relay of this computer may take to greet.
const GREETING: Duration = Duration::from_secs(2);
/// So long without a frame is worth a line in the log of the process.
const SILENCE: Duration = Duration::from_secs(2);
/// A last word older than this is noted at the end.
const GAP: Duration = Duration::from_secs(1);

/// A worm that a network offers here.
pub(crate) struct NetworkWorm {
    link: RelayLink,
    /// What was read of it already.
    lines: Vec<Line>,
}

impl NetworkWorm {
    /// The worm of this name, if it does not run here and is offered from elsewhere. `arguments` select it.
    ///
    /// # Errors
    /// [`Failure::Unusable`] when it cannot be watched with this version, or by this user.
    pub(crate) fn find(instance: &Instance, arguments: Vec<OsString>) -> Result<Option<Self>, Failure> {
        let is_offered =
            RoleLock::<Controller>::holder(instance).is_none() && RoleLock::<Relay>::holder(instance).is_some();
        if !is_offered {
            return Ok(None);
        }
        let mut link = RelayLink::new(instance, arguments, "wormd record".to_owned());
        // Nobody need be there who looks at the worm.
        link.set_attending(false);
        let mut lines = Vec::new();
        let begun = Instant::now();
        while begun.elapsed() < GREETING {
            for received in link.poll() {
                match received {
                    Received::Line(Line::Refused { reason }) => return Err(Failure::unusable(reason)),
                    Received::Line(line) => lines.push(line),
                    Received::Lost(reason) => tracing::debug!("{reason}"),
                    Received::Log(_) => {}
                }
            }
            if let Some(Line::Hello(hello)) = lines.first() {
                return Ok(hello.robot.is_some().then_some(Self { link, lines }));
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        // A relay of this computer greets at once; who takes connections and says nothing has not heard of the robot yet.
        Ok(link.is_connected().then_some(Self { link, lines }))
    }

    /// The robot, where it is known.
    pub(crate) fn robot(&self) -> Option<&str> {
        match self.lines.first() {
            Some(Line::Hello(hello)) => hello.robot.as_deref(),
            _ => None,
        }
    }
}

/// Such a worm on its way into a log.
pub(crate) struct NetworkRecorder {
    link: RelayLink,
    lines: Vec<Line>,
    intake: Intake,
    out: PathBuf,
    force: bool,
    options: FileOptions,
    progress: Arc<Progress>,
    /// None before the first frame, which says whose log it is.
    writer: Option<LogWriter>,
    /// When the newest frame came.
    heard: Option<Instant>,
    is_silence_told: bool,
}

impl NetworkRecorder {
    /// Will record these topics, and the commands. `own_config` is the text of a configuration for a worm whose relay knows none.
    ///
    /// # Errors
    /// [`Failure::Unusable`] when the file exists and `force` is not set.
    pub(crate) fn open(
        worm: NetworkWorm,
        own_config: Option<String>,
        topics: &[Channel],
        out: &Path,
        force: bool,
        options: FileOptions,
    ) -> Result<Self, Failure> {
        if !force && out.try_exists().unwrap_or(false) {
            return Err(creation_failure(out, &io::ErrorKind::AlreadyExists.into()));
        }
        take_full_files_as_errors()?;
        Ok(Self {
            link: worm.link,
            lines: worm.lines,
            intake: Intake::new(topics, own_config),
            out: out.to_owned(),
            force,
            options,
            progress: Arc::default(),
            writer: None,
            heard: None,
            is_silence_told: false,
        })
    }

    fn take(&mut self, line: Line) -> Result<usize, Failure> {
        if matches!(line, Line::Frame(_)) {
            self.heard = Some(Instant::now());
            self.is_silence_told = false;
        }
        let mut messages = 0;
        for step in self.intake.take(line, monotonic_ns(), SystemTime::now()) {
            match (step, &self.writer) {
                (Step::Begin(head), Some(writer)) => {
                    head.notes.iter().for_each(|note| tracing::warn!("{}", note.text));
                    writer.go_on_with(*head)?;
                }
                (Step::Begin(head), None) => {
                    if head.origin.config.is_none() {
                        tracing::warn!(
                            "the robot's relay knows no configuration, so the log has none: name it in the robot's bridge.toml, or give \
                             --config here"
                        );
                    }
                    let (out, progress) = (&self.out, &self.progress);
                    let writer = LogWriter::open(out, self.force, self.options, *head, progress)?;
                    self.writer = Some(writer);
                }
                (Step::Write(batch), Some(writer)) => {
                    messages += batch.len();
                    writer.write(*batch)?;
                }
                (Step::Note(note), Some(writer)) => {
                    tracing::warn!("{}", note.text);
                    writer.write_note(note)?;
                }
                // Nothing comes before the first file.
                (Step::Write(_) | Step::Note(_), None) => {}
                (Step::End(reason), _) => return Err(Failure::failed(reason)),
            }
        }
        Ok(messages)
    }

    fn tell_silence(&mut self) {
        if self.is_silence_told || self.heard.is_none_or(|heard| heard.elapsed() < SILENCE) {
            return;
        }
        self.is_silence_told = true;
        let reason = match self.link.is_connected() {
            true => "the robot or the network is silent",
            false => "`wormd fleet` does not offer the worm",
        };
        tracing::warn!("nothing came for {SILENCE:?}: {reason}; the recording goes on when it is back");
    }

    /// Finishes the log and returns a summary of what is in it; none where nothing ever came, so that there is no log.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the file could not be completed; what was written until then can be read.
    pub(crate) fn close(self) -> Result<Option<String>, Failure> {
        let Some(writer) = self.writer else {
            return Ok(None);
        };
        let frames = self.intake.frames_lost();
        let mut notes = Vec::new();
        if let Some(silent) = self.heard.map(|heard| heard.elapsed()).filter(|silent| *silent >= GAP) {
            notes.push(format!(
                "the recording went on for {:.1} s after this, and nothing came over the network",
                silent.as_secs_f64()
            ));
        }
        if frames > 0 {
            notes.push(format!(
                "{frames} frames were lost on the way, over the whole recording"
            ));
        }
        // A writer that has stopped says why when it is closed.
        let written: Result<(), Failure> = notes.iter().try_for_each(|text| writer.write_note(Note::of(text)));
        let counts = writer.close()?;
        written?;
        let summary = summary(&counts, |channel| self.intake.lost(channel));
        Ok(Some(format!("{summary}; {frames} frames lost")))
    }
}

impl Recording for NetworkRecorder {
    fn poll(&mut self) -> Result<usize, Failure> {
        let mut messages = 0;
        for line in std::mem::take(&mut self.lines) {
            messages += self.take(line)?;
        }
        for received in self.link.poll() {
            match received {
                Received::Line(line) => messages += self.take(line)?,
                Received::Lost(reason) => tracing::warn!("{reason}: it is tried again"),
                Received::Log(line) => tracing::debug!("relay: {line}"),
            }
        }
        self.tell_silence();
        if let Some(writer) = &self.writer {
            writer.check()?;
        }
        Ok(messages)
    }
}

//! Progress of commands that take longer than a second: a bar in a terminal, lines for a program that calls the command.

use super::print;
use crossbeam::channel::{Sender, bounded};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::fmt::Display;
use std::thread::JoinHandle;
use std::time::Duration;

/// Delay before the bar is shown.
const SHOW_AFTER: Duration = Duration::from_secs(1);
/// How often the bar is redrawn without progress, so that its clock keeps running.
const REFRESH: Duration = Duration::from_millis(250);
/// Parts of the bar.
const PARTS: u64 = 1000;
/// Environment variable of programs that want lines instead of a bar, by the value [`LINES`].
const VARIABLE: &str = "WORMD_PROGRESS";
const LINES: &str = "lines";

/// A progress bar on standard error, if that is a terminal and the work takes longer than a second. It is removed on drop.
///
/// With `WORMD_PROGRESS=lines` in the environment there are lines instead, one for each percent and each stage, wherever standard
/// error goes: `progress: 0.42 fit`.
#[derive(Debug)]
pub(super) struct Progress {
    bar: ProgressBar,
    /// What the last line said, in percent; none where there are no lines.
    line: Option<u64>,
    end: Option<Sender<()>>,
    /// Shows the bar after the delay, even if the first stage reports nothing for long.
    delayed_start: Option<JoinHandle<()>>,
}

impl Progress {
    /// Nothing is shown yet.
    pub fn begin() -> Self {
        let bar = ProgressBar::with_draw_target(Some(PARTS), ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}, {elapsed}") {
            bar.set_style(style);
        }
        if std::env::var_os(VARIABLE).is_some_and(|form| form == LINES) {
            return Self {
                bar,
                line: Some(0),
                end: None,
                delayed_start: None,
            };
        }
        let (end, ended) = bounded::<()>(0);
        let shown = bar.clone();
        let delayed_start = std::thread::Builder::new().name("bar".to_owned()).spawn(move || {
            // Dropping the sender ends the wait; nothing is ever sent.
            if ended.recv_timeout(SHOW_AFTER).is_err_and(|error| error.is_timeout()) {
                shown.set_draw_target(ProgressDrawTarget::stderr());
                shown.enable_steady_tick(REFRESH);
            }
        });
        Self {
            bar,
            line: None,
            end: Some(end),
            delayed_start: delayed_start.ok(), // Without a thread there is no bar, and the work goes on.
        }
    }

    /// Sets the current stage, and the completed fraction of the whole.
    pub fn tell(&mut self, stage: &str, fraction: f64) {
        let is_new_stage = self.bar.message() != stage;
        if is_new_stage {
            self.bar.set_message(stage.to_owned());
        }
        let fraction = fraction.clamp(0.0, 1.0);
        self.bar.set_position((fraction * PARTS as f64) as u64);
        let percent = (fraction * 100.0) as u64;
        if let Some(said) = &mut self.line
            && (is_new_stage || percent != *said)
        {
            *said = percent;
            print::log_line(format_args!("progress: {fraction:.2} {stage}"));
        }
    }

    /// Writes a line to standard error, above the bar where there is one.
    pub fn say(&self, text: impl Display) {
        self.bar.suspend(|| print::log_line(text));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(delayed_start) = self.delayed_start.take() {
            // The thread cannot panic; and without it there would only be no bar.
            let _ = delayed_start.join();
        }
        self.bar.finish_and_clear();
    }
}

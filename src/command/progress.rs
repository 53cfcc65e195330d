//! A bar for what takes longer than a second.

use crossbeam::channel::{Sender, bounded};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::thread::JoinHandle;
use std::time::Duration;

/// How long to wait before a bar is worth showing.
const PATIENCE: Duration = Duration::from_secs(1);
/// How often the bar is drawn anew where nothing is told, so that its time is seen to go on.
const REFRESH: Duration = Duration::from_millis(250);
/// Parts of the bar.
const PARTS: u64 = 1000;

/// Shows on standard error how far something is, if that is a terminal and it takes longer than a second. The bar goes when
/// this is dropped.
#[derive(Debug)]
pub(super) struct Progress {
    bar: ProgressBar,
    end: Option<Sender<()>>,
    /// Shows the bar once patience has run out, even where a stage is too long to tell anything.
    shower: Option<JoinHandle<()>>,
}

impl Progress {
    /// Nothing is shown yet.
    pub fn begin() -> Self {
        let bar = ProgressBar::with_draw_target(Some(PARTS), ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}, {elapsed}") {
            bar.set_style(style);
        }
        let (end, ended) = bounded::<()>(0);
        let shown = bar.clone();
        let shower = std::thread::Builder::new().name("bar".to_owned()).spawn(move || {
            // Dropping the sender ends the wait; nothing is ever sent.
            if ended.recv_timeout(PATIENCE).is_err_and(|error| error.is_timeout()) {
                shown.set_draw_target(ProgressDrawTarget::stderr());
                shown.enable_steady_tick(REFRESH);
            }
        });
        Self {
            bar,
            end: Some(end),
            shower: shower.ok(), // Without a thread there is no bar, and the work goes on.
        }
    }

    /// Says what is being done, and which share of everything is done.
    pub fn tell(&mut self, stage: &str, fraction: f64) {
        if self.bar.message() != stage {
            self.bar.set_message(stage.to_owned());
        }
        self.bar.set_position((fraction.clamp(0.0, 1.0) * PARTS as f64) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(shower) = self.shower.take() {
            // The thread cannot panic, and nobody would miss its bar.
            let _ = shower.join();
        }
        self.bar.finish_and_clear();
    }
}

//! Notices that the lock file of a role is gone.
//!
//! Somebody may remove the topics' folder: logind does at logout. From then on no command comes through the topics any more, and a
//! second controller could start beside this one. So this one stops the worm.

use crate::failure::Failure;
use crate::topics::LockPlace;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// How often the file is looked for.
const POLL: Duration = Duration::from_millis(500);

/// A thread that looks for a lock file.
#[derive(Debug)]
pub(crate) struct LockWatch {
    lost: Arc<OnceLock<String>>,
}

impl LockWatch {
    /// Sets `end` once the file is not at its place any more.
    ///
    /// # Errors
    /// [`Failure::Failed`] when there is no thread to be had.
    pub(crate) fn start(place: LockPlace, end: &Arc<AtomicBool>) -> Result<Self, Failure> {
        let lost = Arc::new(OnceLock::new());
        let (tell, end) = (Arc::clone(&lost), Arc::clone(end));
        std::thread::Builder::new()
            .name("lock".to_owned())
            .spawn(move || {
                while place.is_kept() {
                    std::thread::sleep(POLL);
                }
                // Told once, by this thread alone.
                let _ = tell.set(format!(
                    "{} was removed while this worm ran, so the worm was stopped; if that was at a logout, `loginctl enable-linger` \
                     or RemoveIPC=no keeps it (see `wormd check`)",
                    place.path().display()
                ));
                end.store(true, Ordering::Relaxed);
            })
            .map_err(|error| Failure::failed(format!("no thread can be started: {error}")))?;
        Ok(Self { lost })
    }

    /// What was lost, if anything.
    pub(crate) fn lost(&self) -> Option<&str> {
        self.lost.get().map(String::as_str)
    }
}

//! Starting in spite of what killed processes left behind.

use super::instance::Instance;
use super::lock::{LockError, LockFile, LockKind};
use super::open::{self, Refused};
use super::role;
use super::services::Services;
use super::stale_resources::{self, Peer};
use std::fmt;
use std::io;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

/// A start that failed.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// A lock file cannot be used.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// Another process has been starting for too long.
    #[error(
        "the topics of {worm}: another process has been starting for {waited:?}: {}",
        Remedy(peers)
    )]
    Busy {
        /// The worm.
        worm: String,
        /// How long this one waited.
        waited: Duration,
        /// The processes that use the topics.
        peers: Vec<Peer>,
    },
    /// A step hung or failed, and there are peers whose memory must not be wiped.
    #[error("the topics of {worm} did not open, {reason}: {}", Remedy(peers))]
    Blocked {
        /// The worm.
        worm: String,
        /// The step that failed, and why.
        reason: String,
        /// The processes to stop.
        peers: Vec<Peer>,
    },
    /// What killed processes left behind cannot be removed.
    #[error("{folder}: {source}: remove what killed processes left behind, or run as the user who started them")]
    Wipe {
        /// The instance's folder.
        folder: String,
        /// Why.
        source: io::Error,
    },
}

struct Remedy<'a>(&'a [Peer]);

impl fmt::Display for Remedy<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return f.write_str("stop every process that uses this worm's topics, and start again");
        }
        f.write_str("stop ")?;
        for (index, peer) in self.0.iter().enumerate() {
            write!(f, "{}{peer}", if index == 0 { "" } else { ", " })?;
        }
        f.write_str(", and start again")
    }
}

/// This process uses the worm's topics. While it does, no other process wipes them.
///
/// Every port and the hub hold it, declared after their iceoryx2 parts, so that those are gone before it is.
#[derive(Debug)]
pub(super) struct Presence {
    instance: Instance,
    lock: LockFile,
}

impl Presence {
    pub(super) fn instance(&self) -> &Instance {
        &self.instance
    }
}

impl Drop for Presence {
    /// The last process removes what is left: empty folders, and what killed peers had.
    fn drop(&mut self) {
        let Ok(Some(start)) = LockFile::try_lock(&self.instance, "start", LockKind::Exclusive) else {
            return;
        };
        if !self.lock.try_change(LockKind::Exclusive) {
            return;
        }
        if stale_resources::is_there(&self.instance)
            && stale_resources::peers(&self.instance).is_empty()
            && let Err(error) = stale_resources::wipe(&self.instance)
        {
            tracing::debug!("{}: {error}", self.instance.folder().display());
        }
        role::remove_abandoned(&self.instance);
        self.lock.remove();
        start.remove();
        self.instance.remove_folder_if_empty();
    }
}

/// Opens the services of the instance; each attempt may take `limit`, and waiting for another's start as long.
pub(super) fn open(instance: &Instance, limit: Duration) -> Result<(Services, Presence), StartError> {
    let start = wait_for_start_lock(instance, limit)?;
    let (mut lock, mut alone) = enter(instance, limit)?;
    let mut retried = false;
    loop {
        alone = alone && (!stale_resources::is_there(instance) || wipe_if_unused(instance)?);
        if !alone {
            match stale_resources::remove_stillborn(instance) {
                Ok(0) => {}
                Ok(count) => tracing::info!("removed {count} incomplete segments of killed processes"),
                Err(error) => tracing::debug!("looking for incomplete segments: {error}"),
            }
        }
        let reason = match within(limit, instance) {
            Ok(services) => {
                lock.try_change(LockKind::Shared);
                drop(start);
                let instance = instance.clone();
                return Ok((services, Presence { instance, lock }));
            }
            Err(reason) => reason,
        };
        // Peers may have left meanwhile; once alone, this process wipes what was in the way.
        alone = alone || lock.try_change(LockKind::Exclusive);
        if retried || !alone {
            return Err(StartError::Blocked {
                worm: instance.worm().to_owned(),
                reason,
                peers: stale_resources::peers(instance),
            });
        }
        tracing::warn!(
            "the topics of {} did not open, {reason}: trying once more",
            instance.worm()
        );
        retried = true;
    }
}

/// Starts go one after another, so that none sees another's incomplete files.
fn wait_for_start_lock(instance: &Instance, limit: Duration) -> Result<LockFile, StartError> {
    wait_for_lock(instance, "start", limit, |name| {
        LockFile::try_lock(instance, name, LockKind::Exclusive)
    })
}

/// Marks this process as present; the second value says whether it is the only one.
fn enter(instance: &Instance, limit: Duration) -> Result<(LockFile, bool), StartError> {
    wait_for_lock(instance, "presence", limit, |name| {
        if let Some(lock) = LockFile::try_lock(instance, name, LockKind::Exclusive)? {
            return Ok(Some((lock, true)));
        }
        Ok(LockFile::try_lock(instance, name, LockKind::Shared)?.map(|lock| (lock, false)))
    })
}

/// Tries to take a lock until the limit has passed; the error then names the processes that hold it.
fn wait_for_lock<T>(
    instance: &Instance,
    name: &str,
    limit: Duration,
    attempt: impl Fn(&str) -> Result<Option<T>, LockError>,
) -> Result<T, StartError> {
    let begun = Instant::now();
    loop {
        if let Some(lock) = attempt(name)? {
            return Ok(lock);
        }
        if begun.elapsed() > limit {
            return Err(StartError::Busy {
                worm: instance.worm().to_owned(),
                waited: limit,
                peers: stale_resources::who_has_open(&instance.lock_path(name)),
            });
        }
        thread::sleep(Duration::from_millis(1));
    }
}

/// Wipes the instance unless a process that ignores our locks uses it; returns whether it did.
fn wipe_if_unused(instance: &Instance) -> Result<bool, StartError> {
    let peers = stale_resources::peers(instance);
    if let Some(peer) = peers.first() {
        tracing::debug!("{peer} reads {}: nothing is wiped", instance.worm());
        return Ok(false);
    }
    stale_resources::wipe(instance).map_err(|source| StartError::Wipe {
        folder: instance.folder().display().to_string(),
        source,
    })?;
    tracing::info!(
        "removed what killed processes had left behind of the topics of {}",
        instance.worm()
    );
    Ok(true)
}

/// Opens the services in a thread of their own, because iceoryx2 can wait forever for a file that no process will complete.
///
/// The services may change threads; ports, which may not, are created later. A thread that hangs is abandoned: it sleeps, and ends
/// when the file that it waits for is removed.
fn within(limit: Duration, instance: &Instance) -> Result<Services, String> {
    let (sender, receiver) = mpsc::channel();
    let instance = instance.clone();
    thread::Builder::new()
        .name("topics-start".to_owned())
        .spawn(move || {
            // After the limit there is no receiver any more, and the services are dropped here.
            let _ = sender.send(open::open(&instance));
        })
        .map_err(|error| format!("no thread could be started ({error})"))?;
    match receiver.recv_timeout(limit) {
        Ok(Ok(services)) => Ok(services),
        Ok(Err(Refused { step, reason })) => Err(format!("{step}: {reason}")),
        Err(mpsc::RecvTimeoutError::Timeout) => Err(format!("no answer within {limit:?}")),
        Err(mpsc::RecvTimeoutError::Disconnected) => Err("iceoryx2 gave up with a panic".to_owned()),
    }
}

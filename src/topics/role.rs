//! Roles that only one process of a worm can have.

use super::fleet_list::{self, OfferedFrom};
use super::instance::Instance;
use super::lock::{LockError, LockFile, LockKind, LockPlace};
use super::lock_holder;
use std::io;
use std::marker::PhantomData;
use std::time::{Duration, Instant};

/// How long a holder that has just locked may take to write its pid.
const PID_PATIENCE: Duration = Duration::from_secs(1);

/// A role that one process of a worm has at a time.
pub trait Role: sealed::Sealed {
    /// Name as in the lock file and in messages.
    const NAME: &'static str;
}

mod sealed {
    pub trait Sealed {}
}

macro_rules! roles {
    ($($(#[$meta:meta])* $role:ident = $name:literal,)+) => {
        $($(#[$meta])* #[derive(Debug)] pub enum $role {}
        impl sealed::Sealed for $role {}
        impl Role for $role { const NAME: &'static str = $name; })+

        /// Names of all roles.
        const NAMES: &[&str] = &[$($name),+];
    };
}

roles! {
    /// The process that commands the actuator.
    Controller = "controller",
    /// The process that estimates and raises alarms.
    Estimator = "estimator",
    /// The process that records the topics and reports how that goes: the first, if there are several.
    Recorder = "recorder",
    /// The process that keeps the moments around alarms and faults.
    BlackBox = "black-box",
    /// The process that starts and ends the others: `wormd up`.
    Supervisor = "supervisor",
    /// The process that serves the watchers.
    Relay = "relay",
    /// The process that makes a trip.
    Trip = "trip",
    /// The process that serves laptops over a network: `wormd bridge`.
    Bridge = "bridge",
}

/// Another process has the role.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{worm} already has a {role}, process {pid}: stop it first (kill {pid}), or give this worm another worm.name")]
pub struct AlreadyRunning {
    /// The process.
    pub pid: u32,
    /// The role.
    pub role: &'static str,
    /// The worm.
    pub worm: String,
}

/// A role that could not be taken.
#[derive(Debug, thiserror::Error)]
pub enum RoleError {
    /// Another process has it.
    #[error(transparent)]
    AlreadyRunning(#[from] AlreadyRunning),
    /// A fleet process offers the worm of a robot under this name.
    #[error(transparent)]
    Offered(#[from] OfferedFrom),
    /// The lock file cannot be used.
    #[error(transparent)]
    Lock(#[from] LockError),
}

/// The roles that make a worm one of this computer. While a robot's worm is offered under its name, its watchers would drive and hold that
/// one in its place.
const OF_LOCAL_WORMS: [&str; 3] = [Controller::NAME, Estimator::NAME, Supervisor::NAME];

/// Proof that this process has the role `R` of a worm; the role is free again when it is dropped or the process ends.
#[derive(Debug)]
pub struct RoleLock<R: Role> {
    file: LockFile,
    instance: Instance,
    _role: PhantomData<R>,
}

impl<R: Role> RoleLock<R> {
    /// Takes the role, without waiting for it.
    ///
    /// # Errors
    /// [`AlreadyRunning`] with the process that has it; [`OfferedFrom`] when the worm would run here, and that of a robot is offered under
    /// its name; [`LockError`] when the lock file cannot be used.
    pub fn take(instance: &Instance) -> Result<Self, RoleError> {
        Self::take_with_note(instance, "")
    }

    /// As [`RoleLock::take`], and leaves a line for whoever finds the role taken: [`RoleLock::note`].
    ///
    /// # Errors
    /// As [`RoleLock::take`].
    pub(crate) fn take_with_note(instance: &Instance, note: &str) -> Result<Self, RoleError> {
        let path = instance.lock_path(R::NAME);
        let begun = Instant::now();
        loop {
            if let Some(mut file) = LockFile::try_lock(instance, R::NAME, LockKind::Exclusive)? {
                let pid = std::process::id();
                file.write(&if note.is_empty() {
                    format!("{pid}\n")
                } else {
                    format!("{pid}\n{note}\n")
                })?;
                let role = Self {
                    file,
                    instance: instance.clone(),
                    _role: PhantomData,
                };
                // The offer looks for this lock after it has been listed: one of the two sees the other.
                if OF_LOCAL_WORMS.contains(&R::NAME)
                    && let Some(holder) = RoleLock::<Relay>::holder(instance)
                    && let Some(offered) = fleet_list::offered_by(holder, instance)
                {
                    return Err(offered.into());
                }
                return Ok(role);
            }
            if let Some(pid) = Self::holder(instance) {
                return Err(AlreadyRunning {
                    pid,
                    role: R::NAME,
                    worm: instance.worm().to_owned(),
                }
                .into());
            }
            // Its holder is between locking and writing, or just leaving: look again.
            if begun.elapsed() > PID_PATIENCE {
                let source = io::Error::other("locked by a process that cannot be seen from here");
                return Err(LockError { file: path, source }.into());
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// The process that has the role now, if any. Does not disturb one that is about to take it.
    pub fn holder(instance: &Instance) -> Option<u32> {
        lock_holder::holder(&instance.lock_path(R::NAME))
    }

    /// The line that the role's holder has left.
    #[cfg(feature = "bridge")]
    pub(crate) fn note(instance: &Instance) -> Option<String> {
        lock_holder::note(&instance.lock_path(R::NAME))
    }

    pub(super) fn instance(&self) -> &Instance {
        &self.instance
    }

    /// Where the role's lock file is, as long as nobody removes it.
    ///
    /// # Errors
    /// When the system does not say.
    pub(crate) fn place(&self) -> io::Result<LockPlace> {
        self.file.place()
    }
}

impl<R: Role> Drop for RoleLock<R> {
    fn drop(&mut self) {
        self.file.remove();
        self.instance.remove_folder_if_empty();
    }
}

/// Removes the lock files of roles whose holders were killed.
pub(super) fn remove_abandoned(instance: &Instance) {
    for name in NAMES {
        // A lock that a process holds is not abandoned. (Locking creates a missing file.)
        if instance.lock_path(name).exists()
            && let Ok(Some(file)) = LockFile::try_lock(instance, name, LockKind::Exclusive)
        {
            if *name == Controller::NAME {
                // There is none where the controller ended in order.
                let _ = std::fs::remove_file(instance.configuration_path());
            }
            file.remove();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics::kernel_locks;

    #[test]
    fn the_holder_is_found_by_the_kernels_locks_alone() {
        let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let instance = Instance::new(root.path(), "locks").expect("an instance");
        let path = instance.lock_path(Controller::NAME);
        let holder = || lock_holder::holder_by(&path, kernel_locks::holds);
        assert_eq!(holder(), None);
        let controller = RoleLock::<Controller>::take(&instance).expect("nobody else has it");
        assert_eq!(holder(), Some(std::process::id()));
        assert_eq!(RoleLock::<Controller>::holder(&instance), holder());
        drop(controller);
        assert_eq!(holder(), None);
        // What a killed holder leaves behind.
        instance.open_folder().expect("it is made again");
        std::fs::write(&path, format!("{}\n", std::process::id())).expect("it can be written");
        assert_eq!(holder(), None);
    }
}

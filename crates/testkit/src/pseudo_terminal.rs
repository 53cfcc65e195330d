//! A pseudo-terminal that no child process keeps alive.

use std::os::fd::OwnedFd;
use std::path::PathBuf;

use nix::fcntl::{OFlag, open};
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use nix::sys::stat::Mode;

/// Both ends of a pseudo-terminal, and the path of the near one.
#[derive(Debug)]
pub struct PseudoTerminal {
    pub far: OwnedFd,
    pub near: OwnedFd,
    pub path: PathBuf,
}

impl PseudoTerminal {
    /// A new one.
    ///
    /// Both ends are closed in child processes from the first moment on. Tests of one binary run side by side, and a process that
    /// another test starts would otherwise hold the far end for as long as it runs: the line would outlive its own test's hang-up.
    ///
    /// # Panics
    ///
    /// When the operating system has none to give.
    #[must_use]
    pub fn open() -> Self {
        let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_CLOEXEC;
        let far = posix_openpt(flags).expect("a pseudo-terminal");
        grantpt(&far).expect("access to its near end");
        unlockpt(&far).expect("an unlocked near end");
        let path = PathBuf::from(ptsname_r(&far).expect("a name"));
        let near = open(&path, flags, Mode::empty()).expect("its near end");
        Self {
            far: far.into(),
            near,
            path,
        }
    }
}

//! Who holds a lock, as the kernel lists it in `/proc/locks`.
//!
//! Everybody may read that list, while what a process has open is for those who may trace it: of a process with file capabilities
//! (`setcap`), not even its own user may.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Whether process `pid` holds a lock of the whole file (`flock`).
pub(super) fn holds(pid: u32, file: &Path) -> bool {
    let Ok(metadata) = file.symlink_metadata() else {
        return false;
    };
    let Ok(table) = fs::read_to_string("/proc/locks") else {
        return false;
    };
    let held = FileLock {
        pid,
        device: (libc::major(metadata.dev()), libc::minor(metadata.dev())),
        inode: metadata.ino(),
    };
    table.lines().filter_map(FileLock::from_line).any(|lock| lock == held)
}

/// A lock that a process holds by `flock`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FileLock {
    pid: u32,
    /// Major and minor number.
    device: (u32, u32),
    inode: u64,
}

impl FileLock {
    /// From a line like `1: FLOCK  ADVISORY  WRITE 708 00:13:4711 0 EOF`: number, kind, mode, access, pid, `major:minor:inode` with
    /// hexadecimal device numbers, range. Nothing for another kind of lock, and for one that is only waited for (`1: -> FLOCK`).
    fn from_line(line: &str) -> Option<Self> {
        let mut words = line.split_whitespace().skip(1);
        if words.next()? != "FLOCK" {
            return None;
        }
        let mut words = words.skip(2);
        let pid = words.next()?.parse().ok()?; // 0 or less for a process that cannot be seen from here
        let mut place = words.next()?.split(':');
        let mut device = || u32::from_str_radix(place.next()?, 16).ok();
        let device = (device()?, device()?);
        let inode = place.next()?.parse().ok()?;
        Some(Self { pid, device, inode })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nix::fcntl::{Flock, FlockArg};
    use std::fs::File;

    #[test]
    fn lines_of_the_kernel_are_read() {
        let lock = FileLock {
            pid: 4898,
            device: (0xfe, 0x1a),
            inode: 7_012_400,
        };
        for (line, read) in [
            ("1: FLOCK  ADVISORY  WRITE 4898 fe:1a:7012400 0 EOF", Some(lock)),
            ("12: FLOCK  ADVISORY  READ 4898 fe:1a:7012400 0 EOF", Some(lock)),
            ("1: -> FLOCK  ADVISORY  WRITE 4898 fe:1a:7012400 0 EOF", None),
            ("3: POSIX  ADVISORY  WRITE 4898 fe:1a:7012400 0 EOF", None),
            ("4: OFDLCK ADVISORY  WRITE -1 fe:1a:7012400 0 EOF", None),
            ("5: FLOCK  ADVISORY  WRITE -1 fe:1a:7012400 0 EOF", None),
            ("6: FLOCK  ADVISORY  WRITE 4898 <none>:0 0 EOF", None),
            ("7: FLOCK", None),
            ("", None),
        ] {
            assert_eq!(FileLock::from_line(line), read, "{line}");
        }
    }

    #[test]
    fn a_lock_is_found_as_long_as_it_is_held() {
        let folder = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
        let (path, other) = (folder.path().join("a.lock"), folder.path().join("b.lock"));
        let file = File::create(&path).expect("a file");
        File::create(&other).expect("a file");
        let pid = std::process::id();
        assert!(!holds(pid, &path), "open, but not locked");
        let flock = Flock::lock(file, FlockArg::LockExclusiveNonblock).expect("nobody else has it");
        assert!(holds(pid, &path));
        assert!(!holds(pid + 1, &path) && !holds(pid, &other));
        drop(flock);
        assert!(!holds(pid, &path));
        assert!(!holds(pid, &folder.path().join("missing.lock")));
    }
}

//! Whether a process stands still.

use std::fs;

/// Whether a process is stopped, by a signal or a debugger: the third field of `/proc/PID/stat`, proc(5). False where that cannot be read.
pub(crate) fn is_suspended(pid: u32) -> bool {
    let text = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // The second field, the name in parentheses, may contain anything.
    let state = text
        .rsplit_once(')')
        .and_then(|(_, rest)| rest.split_whitespace().next());
    matches!(state, Some("T" | "t"))
}

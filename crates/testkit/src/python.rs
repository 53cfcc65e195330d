//! The Python interpreter of the tests that need one.

use std::process::{Command, Stdio};

/// The interpreter that `WORMD_PYTHON` names (default `python3`), if it can run `probe`, say `import numpy`. Where it cannot, the test
/// says that it was skipped.
pub fn python(probe: &str) -> Option<Command> {
    let interpreter = std::env::var("WORMD_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let works = Command::new(&interpreter)
        .args(["-c", probe])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if !works {
        println!("SKIPPED: {interpreter} cannot run `{probe}`; set WORMD_PYTHON to one that can");
        return None;
    }
    Some(Command::new(interpreter))
}

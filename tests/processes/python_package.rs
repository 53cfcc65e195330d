//! The Python package's own tests, and the notebook, beside real worms.
//!
//! `WORMD_PYTHON` names an interpreter with the packages of `tests/clients.txt` and `python/requirements-dev.txt` (default `python3`);
//! without one the test says so and passes.

use std::process::{Command, Stdio};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/python");

#[test]
fn its_own_tests_pass() {
    let interpreter = std::env::var("WORMD_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let probe = "import iceoryx2, matplotlib, nbclient, ipykernel, pandas, pyarrow, pytest";
    let works = Command::new(&interpreter)
        .args(["-c", probe])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if !works {
        println!("SKIPPED: {interpreter} cannot run `{probe}`; set WORMD_PYTHON to one that can");
        return;
    }
    let output = Command::new(interpreter)
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "--durations=5"])
        .current_dir(FOLDER)
        // The kernel of a notebook works in another folder.
        .env("PYTHONPATH", concat!(env!("CARGO_MANIFEST_DIR"), "/python/src"))
        .env("WORMD", env!("CARGO_BIN_EXE_wormd"))
        .output()
        .expect("python");
    let printed = String::from_utf8_lossy(&output.stdout);
    println!("{printed}");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

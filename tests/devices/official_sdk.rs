//! The maker's own SDK against the real `wormd virtual-worm` process: `official_sdk.py` says what is tried.
//!
//! Needs a Python with the SDK: `python3 -m venv venv && venv/bin/pip install dynamixel-sdk`, then run the tests with
//! `WORMD_PYTHON=venv/bin/python` (an absolute path is safest). Without the variable `python3` is tried. Where there is no SDK
//! the test says so and passes.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// Ends the process when the test ends, whichever way.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _gone = self.0.kill();
        let _reaped = self.0.wait();
    }
}

fn virtual_worm(link: &Path, more: &[&str]) -> Process {
    let mut child = Command::new(env!("CARGO_BIN_EXE_wormd"))
        .args(["virtual-worm", "--link"])
        .arg(link)
        .args(more)
        .stdout(Stdio::piped())
        .spawn()
        .expect("wormd starts");
    let mut line = String::new();
    let output = child.stdout.take().expect("a pipe");
    BufReader::new(output).read_line(&mut line).expect("a line");
    assert_eq!(line.trim_end(), link.to_str().expect("UTF-8"));
    Process(child)
}

fn terminate(process: &mut Process) {
    let pid = nix::unistd::Pid::from_raw(process.0.id() as i32);
    nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGTERM).expect("a signal");
    let status = process.0.wait().expect("it ends");
    assert!(status.success(), "{status}");
}

#[test]
fn the_official_sdk_is_satisfied() {
    let Some(mut python) = testkit::python::python("import dynamixel_sdk") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("worm");
    let mut process = virtual_worm(&link, &[]);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/official_sdk.py");
    let output = python.arg(script).arg(&link).output().expect("Python runs");
    print!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    terminate(&mut process);
    assert!(link.symlink_metadata().is_err(), "the link goes with the process");
}

#[test]
fn ledger_is_written_at_the_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("worm");
    let file = folder.path().join("ledger.json");
    let mut process = virtual_worm(&link, &["--ledger", file.to_str().expect("UTF-8"), "--seed", "7"]);
    terminate(&mut process);
    let text = std::fs::read_to_string(&file).expect("a ledger");
    let report: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(report["total"]["electrical_j"], 0.0);
    assert_eq!(report["crawl_began_s"], serde_json::Value::Null);
}

#[test]
fn only_a_link_is_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("worm");
    std::os::unix::fs::symlink("/nowhere", &link).expect("a stale link");
    let mut process = virtual_worm(&link, &[]);
    assert_ne!(std::fs::read_link(&link).expect("a link"), Path::new("/nowhere"));
    terminate(&mut process);
    std::fs::write(&link, "precious").expect("a file");
    let output = Command::new(env!("CARGO_BIN_EXE_wormd"))
        .args(["virtual-worm", "--link"])
        .arg(&link)
        .output()
        .expect("wormd runs");
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(
        message.contains("there is a file or folder that is no link"),
        "{message}"
    );
    assert_eq!(std::fs::read_to_string(&link).expect("still there"), "precious");
}

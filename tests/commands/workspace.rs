//! Files for one test of a command, and the binary itself.

use std::path::PathBuf;
use std::process::{Command, Output};

/// Runs `wormd` to its end.
pub fn wormd<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_wormd"))
        .args(arguments)
        .output()
        .expect("the binary runs")
}

/// What it said on standard error.
pub fn said(output: &Output) -> std::borrow::Cow<'_, str> {
    String::from_utf8_lossy(&output.stderr)
}

/// Files of one test.
pub struct Workspace(tempfile::TempDir);

impl Workspace {
    pub fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, text).expect("a temporary file can be written");
        path
    }

    /// `wormd simulate` into a file.
    pub fn simulate(&self, name: &str, slope_deg: &str, more: &[&str]) -> PathBuf {
        let path = self.path(name);
        let mut arguments = vec!["simulate", "--slope", slope_deg, "--out"];
        let out = path.to_string_lossy().into_owned();
        arguments.push(&out);
        arguments.extend(more);
        let output = wormd(&arguments);
        assert!(output.status.success(), "{}", said(&output));
        path
    }
}

//! The Python package's own tests, and the notebook, beside real worms.
//!
//! `WORMD_PYTHON` names an interpreter with the packages of `tests/clients.txt` and `python/requirements-dev.txt` (default `python3`);
//! without one the test says so and passes.

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/python");

#[test]
fn its_own_tests_pass() {
    let probe = "import iceoryx2, matplotlib, nbclient, ipykernel, pandas, pyarrow, pytest";
    let Some(mut python) = testkit::python::python(probe) else {
        return;
    };
    let output = python
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

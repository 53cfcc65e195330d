//! Faults of a running virtual worm, switched by `wormd fault`.

use super::PATIENCE;
use super::process::wait_for;
use super::worm::Worm;
use worm_estimator::message::{CommandKind, CommandOutcome, Fault, Mode};

fn fault(worm: &Worm, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = worm.wormd(&[&["fault"], arguments].concat()).output();
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn is(worm: &Worm, mode: Mode) -> bool {
    worm.state().is_some_and(|state| state.mode == mode.code())
}

#[test]
fn a_fault_is_switched_on_listed_and_cleared_while_the_worm_crawls() {
    let worm = Worm::new("faulted");
    let up = worm.wormd(&["up", "--plain", "--allow-faults"]).start_silent();
    wait_for("a crawling worm", PATIENCE, || is(&worm, Mode::Crawling));
    let (code, text, error) = fault(&worm, &["--list"]);
    assert_eq!(code, Some(0), "{error}");
    assert!(text.ends_with(": no faults\n"), "{text}");
    let (code, _, error) = fault(&worm, &["jam:cell=9"]);
    assert_eq!(code, Some(1), "{error}");
    assert!(error.contains("names cell 9, but the worm has 4 cells"), "{error}");
    let (code, text, error) = fault(&worm, &["silence:device=servo"]);
    assert_eq!(code, Some(0), "{error}");
    assert!(text.contains(": silence:device=servo ("), "{text}");
    wait_for("the fault", PATIENCE, || {
        is(&worm, Mode::Fault) && worm.state().is_some_and(|state| state.fault == Fault::LinkLost.code())
    });
    let (_, text, _) = fault(&worm, &["--list"]);
    assert!(text.ends_with(": silence:device=servo (on)\n"), "{text}");
    let (code, text, _) = fault(&worm, &["--clear", "silence"]);
    assert_eq!(code, Some(0));
    assert!(text.ends_with(": 1 faults cleared\n"), "{text}");
    wait_for("a reset", PATIENCE, || {
        worm.order(CommandKind::Reset) == CommandOutcome::Accepted || is(&worm, Mode::Armed)
    });
    wait_for("an armed worm", PATIENCE, || is(&worm, Mode::Armed));
    up.end();
}

#[test]
fn faults_are_refused_where_they_are_not_allowed() {
    let worm = Worm::new("unfaulted");
    let up = worm.wormd(&["up", "--plain"]).start_silent();
    wait_for("a crawling worm", PATIENCE, || is(&worm, Mode::Crawling));
    let (code, _, error) = fault(&worm, &["stall"]);
    assert_eq!(code, Some(1), "{error}");
    assert!(error.contains("start it with --allow-faults"), "{error}");
    assert!(is(&worm, Mode::Crawling));
    up.end();
}

//! `wormd dashboard` from outside: real processes, requests as bytes, and a real headless Chromium where there is one.

mod boxes;
mod crowd;
mod fleet;
mod frozen;
mod held_up;
mod http;
#[path = "../processes/process.rs"]
#[allow(
    dead_code,
    reason = "the harness of another test binary, of which this one uses a part"
)]
mod process;
mod watched;
mod without_tracker;
#[path = "../processes/worm.rs"]
#[allow(
    dead_code,
    reason = "the harness of another test binary, of which this one uses a part"
)]
mod worm;

use http::{Browser, request};
use nix::sys::signal::Signal;
use process::wait_for;
use serde_json::{Value, json};
use std::io::Write;
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use watched::{Watched, events, start};
use worm::Worm;

const TOKEN: &str = "a-token-for-tests-0123";
const BEARER: &str = "Authorization: Bearer a-token-for-tests-0123";
const ANN: &str = "X-Wormd-Client: ann";
const BEN: &str = "X-Wormd-Client: ben";
const PATIENCE: Duration = Duration::from_secs(30);

#[test]
fn one_drives_with_the_token_and_anyone_may_halt() {
    let watched = Watched::start("d-rules");
    for command in ["crawl", "stop", "reset", "arm", "take_over", "acknowledge"] {
        let refused = watched.post(command, &[]);
        assert_eq!(refused.status, 401, "{refused:?}");
        assert!(
            refused.head.to_lowercase().contains("www-authenticate: bearer"),
            "{refused:?}"
        );
        assert_eq!(
            watched
                .post(command, &["Authorization: Bearer a-token-for-tests-0124"])
                .status,
            401
        );
    }
    assert_eq!(watched.post("dance", &[BEARER]).status, 404);
    for body in ["[0.1]", "{\"cycles_per_s\":0}", "{\"cycles_per_s\":-0.0}"] {
        let refused = request(watched.address, "POST", "/api/command/crawl", &[BEARER, ANN], body);
        assert_eq!(refused.status, 400, "{body}: {refused:?}");
    }
    let asked_wrongly = watched.get("/api/command/hold");
    assert_eq!(asked_wrongly.status, 405, "{asked_wrongly:?}");
    assert!(asked_wrongly.json()["error"].is_string() && asked_wrongly.head.to_lowercase().contains("allow: post"));
    watched.arm(ANN);
    assert_eq!(watched.post("crawl", &[BEARER, ANN, "X-Wormd-Name: ann"]).status, 200);
    let second = watched.post("crawl", &[BEARER, BEN]);
    assert_eq!(second.status, 409, "{second:?}");
    assert!(
        second.json()["refusal"].as_str().is_some_and(|why| why.contains("ann")),
        "{second:?}"
    );
    // Nobody renews it.
    watched.wait_for_mode("holding");
    assert_eq!(watched.post("crawl", &[BEARER, ANN]).status, 200);
    assert_eq!(watched.post("take_over", &[BEARER, BEN]).status, 200);
    assert_eq!(watched.post("crawl", &[BEARER, ANN]).status, 409);
    let held = watched.post("hold", &["User-Agent: curl/8", "X-Wormd-Name: passer-by"]);
    assert_eq!(held.status, 200, "{held:?}");
    watched.wait_for_mode("holding");
    // They come with the next frame.
    for part in ["took over", "passer-by, curl (user", "hold accepted"] {
        wait_for(part, PATIENCE, || {
            events(&watched).iter().any(|text| text.contains(part))
        });
    }

    // Strangers.
    for (header, status) in [
        ("Host: evil.example", 403),
        ("Origin: http://evil.example", 403),
        ("Origin: null", 403),
        ("Sec-Fetch-Site: cross-site", 403),
        ("X-Harmless: yes", 200),
    ] {
        assert_eq!(
            request(watched.address, "GET", "/api/state", &[header], "").status,
            status,
            "{header}"
        );
        assert_eq!(watched.post("hold", &[header]).status == 403, status == 403, "{header}");
    }
    // What a proxy in between took for the Host may be the other one.
    let own = format!("Host: {}", watched.address);
    for second in ["Host: evil.example", own.as_str()] {
        assert_eq!(
            request(watched.address, "GET", "/api/state", &[&own, second], "").status,
            403,
            "{second}"
        );
    }
    let page = watched.get("/");
    for part in [
        "default-src 'none'",
        "x-content-type-options: nosniff",
        "frame-ancestors 'none'",
    ] {
        assert!(
            page.head.to_lowercase().contains(part),
            "{part:?} is not in {}",
            page.head
        );
    }
    assert!(
        watched
            .get("/api/state")
            .head
            .to_lowercase()
            .contains("cache-control: no-store")
    );
    let large = request(
        watched.address,
        "POST",
        "/api/command/crawl",
        &[BEARER],
        &"x".repeat(5000),
    );
    assert_eq!(large.status, 413, "{large:?}");
    let large = "x".repeat(300_000);
    let held = request(watched.address, "POST", "/api/command/hold", &[], &large);
    assert!(
        [200, 422].contains(&held.status),
        "the controller has answered: {held:?}"
    );
    // Worms of other tests may be on their way out.
    let held = request(watched.address, "POST", "/api/fleet/hold", &[], &large).json();
    let own = held["worms"]
        .as_array()
        .into_iter()
        .flatten()
        .find(|worm| worm["name"] == *watched.worm.name());
    assert!(
        own.is_some_and(|worm| worm["verdict"] != "no-answer"),
        "the controller has answered: {held}"
    );
    for path in [
        "/reports/../Cargo.toml",
        "/assets/../../Cargo.toml",
        "/assets/%2e%2e/Cargo.toml",
        "/etc/passwd",
    ] {
        assert_eq!(watched.get(path).status, 404, "{path}");
    }
}

#[test]
fn metrics_pass_promtool_and_a_dead_worm_does_not_look_alive() {
    let watched = Watched::start("d-prom");
    let has = |text: &str, name: &str| text.lines().any(|line| line.starts_with(name));
    // Percentiles come once a second.
    wait_for("percentiles", PATIENCE, || {
        watched.get("/metrics").body.contains("wormd_wake_lateness_seconds")
    });
    let metrics = watched.get("/metrics").body;
    assert!(
        has(&metrics, "wormd_up{worm=\"d-prom") && metrics.contains("wormd_position_meters"),
        "{metrics}"
    );
    check_by_promtool(&metrics);
    // What the Grafana dashboard shows is there, but what needs a battery, a recorder or a finished cycle.
    let grafana = include_str!("../../config/grafana/wormd.json");
    let parsed: Value = serde_json::from_str(grafana).expect("is JSON");
    assert!(parsed["panels"].as_array().is_some_and(|panels| panels.len() > 6));
    let later = [
        "wormd_cycle",
        "wormd_range",
        "wormd_battery",
        "wormd_time_left",
        "wormd_recording",
    ];
    for name in grafana
        .split(|it: char| !it.is_ascii_alphanumeric() && it != '_')
        .filter(|word| word.starts_with("wormd_"))
    {
        assert!(
            later.iter().any(|prefix| name.starts_with(prefix)) || has(&metrics, name),
            "{name}"
        );
    }
    watched.controller.signal(Signal::SIGSTOP);
    watched.wait_for_health("stale");
    let up = format!("wormd_up{{worm=\"{}\"}} 0", watched.worm.name());
    wait_for("old values are left out", PATIENCE, || {
        let metrics = watched.get("/metrics").body;
        metrics.contains(&up)
            && !metrics.contains("wormd_position_meters")
            && metrics.contains("wormd_source_age_seconds")
    });
    watched.controller.signal(Signal::SIGCONT);
}

fn check_by_promtool(metrics: &str) {
    let promtool = Command::new("promtool")
        .args(["check", "metrics"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let Ok(mut promtool) = promtool else {
        println!("SKIPPED: no promtool (Debian: prometheus)");
        return;
    };
    let mut stdin = promtool.stdin.take().expect("is piped");
    stdin.write_all(metrics.as_bytes()).expect("it reads");
    drop(stdin);
    let output = promtool.wait_with_output().expect("it ends");
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
}

#[test]
fn a_reader_that_does_not_read_is_cut_off_and_delays_nobody() {
    let watched = Watched::start("d-slow");
    let mut stalled = TcpStream::connect(watched.address).expect("listens");
    let ask = format!("GET /api/events HTTP/1.1\r\nHost: {}\r\n\r\n", watched.address);
    stalled.write_all(ask.as_bytes()).expect("reads");
    wait_for("it is a page", PATIENCE, || {
        watched.get("/api/health").json()["pages"] == 1
    });
    let begun = Instant::now();
    wait_for("it is cut off", Duration::from_secs(120), || {
        assert_eq!(watched.get("/api/state").status, 200);
        std::thread::sleep(Duration::from_millis(200));
        watched.get("/api/health").json()["pages"] == 0
    });
    println!("cut off after {:?}", begun.elapsed());
}

#[test]
fn in_a_browser_nothing_moves_by_itself_and_old_values_are_grey() {
    let Some(browser) = Browser::start(1280, 900) else {
        return;
    };
    let watched = Watched::start("d-page");
    let url = format!("http://{}/", watched.address);
    browser.open(&url);
    browser.wait_for("document.querySelectorAll('#worm .cell').length === 4");
    browser.wait_for("!document.body.classList.contains('stale')");
    assert!(
        events(&watched).is_empty(),
        "loading commands nothing: {:?}",
        events(&watched)
    );

    // Whoever is about to log in can still make it hold, by what a click at the button really hits.
    browser.run("document.getElementById('log-in').click()");
    browser.run(
        "const box = document.getElementById('login-hold').getBoundingClientRect();
         document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2).click()",
    );
    browser.wait_for("/^hold: /.test(document.getElementById('login-message').textContent)");
    assert_eq!(browser.run("return document.activeElement.id"), "who");
    browser.run("document.getElementById('login-cancel').click()");

    // Logged in by the address, which forgets the token.
    browser.open("about:blank");
    browser.open(&format!("{url}#token={TOKEN}"));
    browser.wait_for("!document.getElementById('drive').hidden");
    assert_eq!(browser.run("return location.hash"), "");
    assert!(
        events(&watched).iter().all(|text| text.contains("hold")),
        "logging in commands nothing"
    );
    browser.run("document.getElementById('arm').click()");
    watched.wait_for_mode("armed");
    let position = "return Number(document.querySelector('#worm .cell').dataset.positionMm)";
    let before = browser.run(position).as_f64().expect("a number");
    let crawl = || {
        wait_for("it crawls", PATIENCE, || {
            browser.run("document.getElementById('crawl').click()");
            std::thread::sleep(Duration::from_millis(300));
            watched.mode() == "crawling"
        });
    };
    crawl();
    wait_for("positions move", PATIENCE, || {
        (browser.run(position).as_f64().expect("a number") - before).abs() > 2.0
    });
    assert_eq!(watched.post("crawl", &[BEARER, BEN]).status, 409, "the page drives");
    // Headless Chromium shows all its pages: it is told that this one is hidden.
    let hide = |is_hidden: bool| {
        browser.run(&format!(
            "Object.defineProperty(document, 'hidden', {{ configurable: true, value: {is_hidden} }});
             document.dispatchEvent(new Event('visibilitychange'))"
        ));
    };
    hide(true);
    watched.wait_for_mode("holding");
    hide(false);
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(watched.mode(), "holding", "coming back moves nothing");
    assert_eq!(
        browser.run("return sessionStorage.length > 0"),
        true,
        "and is still logged in"
    );

    // Anyone may halt, by the button.
    crawl();
    browser.run("document.getElementById('log-out').click(); document.getElementById('hold').click()");
    watched.wait_for_mode("holding");

    watched.controller.signal(Signal::SIGSTOP);
    browser.wait_for("document.body.classList.contains('stale')");
    browser.wait_for("/no state for/.test(document.getElementById('banner').textContent)");
    browser.wait_for("Number(getComputedStyle(document.getElementById('values')).opacity) < 0.6");
    watched.controller.signal(Signal::SIGCONT);
    browser.wait_for("!document.body.classList.contains('stale')");
    let address = watched.address;
    drop(watched);
    // Nor does a page of a server that is gone look alive.
    assert!(TcpStream::connect(address).is_err());
    browser.wait_for("/nothing heard of the dashboard server/.test(document.getElementById('banner').textContent)");
}

#[test]
fn on_a_phone_a_stall_is_shown_with_what_to_do() {
    let Some(browser) = Browser::start(500, 844) else {
        return;
    };
    let watched = Watched::start("d-phone");
    let phone = json!({"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": true});
    browser.control("Emulation.setDeviceMetricsOverride", phone);
    for scheme in ["light", "dark"] {
        let features = json!({"features": [{"name": "prefers-color-scheme", "value": scheme}]});
        browser.control("Emulation.setEmulatedMedia", features);
        browser.open(&format!("http://{}/", watched.address));
        browser.wait_for("document.querySelectorAll('#worm .cell').length === 4");
        assert_eq!(
            browser.run("return document.documentElement.scrollWidth"),
            390,
            "{scheme}"
        );
        browser.run("scrollTo(0, 1e6)");
        let hold = browser.run("const box = document.getElementById('hold').getBoundingClientRect(); return [box.top, box.bottom, box.width]");
        let of = |index: usize| hold[index].as_f64().expect("a number");
        assert!(of(0) > 0.0 && of(1) <= 844.0 && of(2) > 300.0, "{scheme}: {hold}");
    }
    let unnamed = browser.run(
        "return [...document.querySelectorAll('button, input, svg[role=img], [role=region]')].filter((it) => \
         !it.hidden && !(it.ariaLabel || it.textContent.trim() || it.labels?.length || it.getAttribute('aria-labelledby'))).map((it) => it.outerHTML)",
    );
    assert_eq!(unnamed, json!([]), "everything has a name");

    watched.arm(ANN);
    assert_eq!(watched.post("crawl", &[BEARER, ANN]).status, 200);
    let stalled = watched
        .worm
        .wormd(&["fault", "stall"])
        .into_command()
        .args(["--link", &watched.worm.port()])
        .output();
    let stalled = stalled.expect("the binary starts");
    assert!(stalled.status.success(), "{stalled:?}");
    wait_for("an alarm", PATIENCE, || {
        request(watched.address, "POST", "/api/alive", &[BEARER, ANN], "");
        browser.run("return document.getElementById('alarm-banner').textContent.includes('motor-stall')") == true
    });
    browser.wait_for("/Do: .*wormd command reset/.test(document.getElementById('alarm-banner').textContent)");
    browser.wait_for("/motor-stall/.test(document.title)");
    // There may be a box of it.
    let looked = "performance.getEntriesByType('resource').filter((it) => it.name.endsWith('/api/boxes')).length > 1";
    browser.wait_for(looked);
    browser.wait_for("/^[\\d.]+ s old$/.test(document.getElementById('boxes-age').textContent)");
    let title = browser.run(
        "return import('/assets/panels.js').then((panels) => {
             const raised = [{ kind: 'motor-stall' }];
             panels.drawTitle({ worm: { name: 'worm1' }, frame: { raised, state: { acknowledged_mask: 0 } } }, 'no state');
             return document.title;
         })",
    );
    assert_eq!(
        title, "(old) ⚠ motor-stall – worm1",
        "old, also where an alarm is raised"
    );
    assert_eq!(watched.post("acknowledge", &[BEARER, ANN]).status, 200);
    browser.wait_for("document.getElementById('alarm-banner').hidden");
    // The record of a command may come a frame after the state that it led to.
    wait_for("the event", PATIENCE, || {
        events(&watched)
            .iter()
            .any(|text| text.contains("acknowledge accepted"))
    });
}

#[test]
fn who_reads_only_the_first_line_of_its_output_does_not_end_it() {
    let worm = Worm::on_a_steady_computer("d-line");
    let (mut dashboard, address) = start(worm.wormd(&["dashboard", "--listen", "127.0.0.1:0"]).into_command());
    assert_eq!(
        request(address, "POST", "/api/command/crawl", &[], "").status,
        401,
        "a token was made"
    );
    assert_eq!(dashboard.end(), Some(0), "it ends in order");
}

#[test]
fn what_cannot_be_used_ends_with_exit_status_2() {
    let folder = tempfile::tempdir().expect("a folder");
    let short = folder.path().join("token");
    std::fs::write(&short, "short\n").expect("can be written");
    let short = short.to_string_lossy().into_owned();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let taken = taken.local_addr().expect("is bound").to_string();
    let worm = Worm::on_a_steady_computer("d-args");
    for (arguments, part) in [
        (vec!["--listen", &taken], "is in use"),
        (vec!["--listen", "nonsense"], "is no address with a port"),
        (vec!["--listen", "0.0.0.0:0"], "give a token"),
        (vec!["--token-file", "/nonexistent/token"], "/nonexistent/token"),
        (vec!["--token-file", &short], "a token has 16 to 256"),
        (vec!["--reports", "/nonexistent/reports"], "/nonexistent/reports"),
        (vec!["--black-box", "/nonexistent/boxes"], "/nonexistent/boxes"),
    ] {
        let output = worm.wormd(&[&["dashboard"], arguments.as_slice()].concat()).output();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(part), "{arguments:?}: {said}");
    }
    assert_eq!(worm.stale_resources(), Vec::<String>::new());
}

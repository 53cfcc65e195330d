//! The page about all worms.

use super::PATIENCE;
use super::http::{Browser, request};
use super::process::{Process, wait_for};
use super::watched::{slow_worm, start};
use super::worm::Worm;
use nix::sys::signal::Signal;
use serde_json::json;

/// A worm in a folder for all worms, at rest.
struct Neighbour {
    controller: Process,
    _estimator: Process,
    _virtual_worm: Process,
    worm: Worm,
}

impl Neighbour {
    fn start(name: &str, root: &std::path::Path) -> Self {
        let worm = slow_worm(name, root);
        let port = worm.port();
        let virtual_worm = worm.virtual_worm(&[]);
        let estimator = worm.wormd(&["estimate"]).start();
        let controller = worm.wormd(&["control", "--port", &port]).start();
        Self {
            controller,
            _estimator: estimator,
            _virtual_worm: virtual_worm,
            worm,
        }
    }

    /// Tries to make it crawl, whatever has stopped it on a busy computer.
    fn try_to_crawl(&self) {
        for arguments in [&["reset"][..], &["arm"], &["crawl", "--for", "100"]] {
            let arguments = [&["command"], arguments].concat();
            // A reset that is not needed is refused.
            let _ = self.worm.wormd(&arguments).output();
        }
    }
}

#[test]
fn all_worms_are_on_one_page_and_one_button_holds_them() {
    // One button that holds all worms of a computer must not reach those of other tests.
    let root = tempfile::tempdir_in("/dev/shm").expect("a folder in /dev/shm");
    let (one, two) = (
        Neighbour::start("d-one", root.path()),
        Neighbour::start("d-two", root.path()),
    );
    let arguments = ["dashboard", "--listen", "127.0.0.1:0"];
    let (_dashboard, address) = start(one.worm.wormd(&arguments).into_command());
    let worms = || request(address, "GET", "/api/fleet", &[], "").json()["worms"].clone();
    let is_in = |mode: &str| {
        let worms = worms();
        let worms = worms.as_array().expect("a list");
        worms.len() == 2 && worms.iter().all(|worm| worm["mode"] == mode)
    };
    let crawl = || {
        wait_for("both crawl", PATIENCE, || {
            [&one, &two].iter().for_each(|worm| worm.try_to_crawl());
            is_in("crawling")
        });
    };
    crawl();
    let held = request(address, "POST", "/api/fleet/hold", &["User-Agent: curl/8"], "");
    assert_eq!(held.status, 200, "{held:?}");
    for held in held.json()["worms"].as_array().expect("a list") {
        assert_eq!(held["verdict"], "accepted", "{held}");
    }
    wait_for("both hold", PATIENCE, || is_in("holding"));
    let stranger = request(address, "POST", "/api/fleet/hold", &["Origin: http://evil.example"], "");
    assert_eq!(stranger.status, 403);

    if let Some(browser) = Browser::start(500, 844) {
        let phone = json!({"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": true});
        browser.control("Emulation.setDeviceMetricsOverride", phone);
        crawl();
        browser.open(&format!("http://{address}/fleet"));
        browser.wait_for("document.querySelectorAll('.card:not(.stale) [data-mode=crawling]').length === 2");
        assert_eq!(browser.run("return document.documentElement.scrollWidth"), 390);
        assert!(is_in("crawling"), "loading commands nothing");
        browser.run("document.getElementById('hold').click()");
        wait_for("both hold", PATIENCE, || is_in("holding"));
        browser.wait_for("/hold accepted by 2 of 2/.test(document.getElementById('message').textContent)");
        one.controller.signal(Signal::SIGSTOP);
        let card = format!(".card[data-worm={}]", one.worm.name());
        browser.wait_for(&format!("document.querySelector('{card}').classList.contains('stale')"));
        browser.wait_for("/1 silent/.test(document.getElementById('summary').textContent)");
        one.controller.signal(Signal::SIGCONT);
        browser.wait_for(&format!(
            "!document.querySelector('{card}').classList.contains('stale')"
        ));

        // What a killed `wormd fleet` has left, with more robots than there is room for words.
        let standing = json!({"was_heard": false, "problem": null, "worms": {}});
        let robots: serde_json::Map<_, _> = (1..=20).map(|it| (format!("robot{it}"), standing.clone())).collect();
        let list = json!({"pid": 1, "config": "/etc/wormd/fleet.toml", "robots": robots});
        std::fs::write(root.path().join("fleet-1-1.json"), list.to_string()).expect("can be written");
        browser.wait_for("document.querySelectorAll('.card').length === 22");
        browser.run("document.getElementById('hold').click()");
        browser.wait_for("/NOT held.*robot20/.test(document.getElementById('message').textContent)");
        let place = "const it = document.getElementById('hold').getBoundingClientRect(); return it.top >= 0 && it.bottom <= innerHeight";
        assert_eq!(browser.run(place), true, "the button stays on the screen");
        let driver = "return /driver/.test(document.querySelector('.card[data-worm=robot1]').textContent)";
        assert_eq!(
            browser.run(driver),
            false,
            "nobody knows who drives a robot that is not reached"
        );
    }
}

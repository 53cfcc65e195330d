//! A line between page and dashboard that carries nothing for a while, and then all at once: nothing is done late, and a hold is the last word.

use super::http::{Browser, request};
use super::watched::{Watched, first_id};
use super::{ANN, BEARER, PATIENCE, TOKEN, wait_for};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A way to a server that can be held up: what is sent meanwhile waits, as TCP lets it wait.
struct Line {
    address: SocketAddr,
    is_held_up: Arc<AtomicBool>,
}

impl Line {
    fn to(server: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let address = listener.local_addr().expect("is bound");
        let is_held_up = Arc::new(AtomicBool::new(false));
        let is_waiting = Arc::clone(&is_held_up);
        std::thread::spawn(move || {
            for client in listener.incoming().flatten() {
                let Ok(server) = TcpStream::connect(server) else { return };
                let copies = client.try_clone().and_then(|copy| Ok((copy, server.try_clone()?)));
                let Ok((client_too, server_too)) = copies else { return };
                for (from, to) in [(client, server), (server_too, client_too)] {
                    let is_waiting = Arc::clone(&is_waiting);
                    std::thread::spawn(move || carry(from, to, &is_waiting));
                }
            }
        });
        Self { address, is_held_up }
    }

    fn hold_up(&self, is_held_up: bool) {
        self.is_held_up.store(is_held_up, Ordering::SeqCst);
    }
}

fn carry(mut from: TcpStream, mut to: TcpStream, is_held_up: &AtomicBool) {
    let mut bytes = [0; 16_384];
    while let Ok(count @ 1..) = from.read(&mut bytes) {
        while is_held_up.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(5));
        }
        if to.write_all(&bytes[..count]).is_err() {
            break;
        }
    }
    // The other direction ends as well.
    let _ = to.shutdown(std::net::Shutdown::Both);
}

#[test]
fn a_command_is_as_old_as_its_button_and_a_hold_voids_what_was_asked_before_it() {
    let watched = Watched::start("d-asked");
    watched.arm(ANN);
    let asked = |command: &str, ms: u64| {
        let header = format!("X-Wormd-Asked: {ms}+0");
        watched.post(command, &[BEARER, ANN, &header])
    };
    let now_ms = || first_id(watched.address);
    let late = asked("crawl", now_ms() - 3000);
    assert_eq!((late.status, &late.json()["verdict"]), (504, &"stale".into()));
    assert!(late.body.contains("asked for 3 s ago"), "{late:?}");
    watched.worm.assert_does_not_crawl();

    let held_ms = now_ms();
    assert_eq!(asked("hold", held_ms).status, 200);
    let before = asked("crawl", held_ms - 50);
    assert_eq!((before.status, &before.json()["verdict"]), (504, &"stale".into()));
    assert!(before.body.contains("a hold was asked for after it"), "{before:?}");
    watched.worm.assert_does_not_crawl();
    assert_eq!(asked("crawl", now_ms()).status, 200);
    assert_eq!(watched.post("hold", &["X-Wormd-Asked: nonsense"]).status, 200);
    let nonsense = watched.post("crawl", &[BEARER, ANN, "X-Wormd-Asked: nonsense"]);
    assert_eq!(nonsense.status, 400, "{nonsense:?}");
}

#[test]
fn what_was_pressed_while_the_line_was_down_is_not_done_when_it_is_back() {
    let Some(browser) = Browser::start(900, 800) else {
        return;
    };
    let watched = Watched::start("d-line");
    let line = Line::to(watched.address);
    browser.open(&format!("http://{}/#token={TOKEN}", line.address));
    let page_is_fresh =
        "!document.getElementById('crawl').disabled && document.getElementById('drive').checkVisibility()";
    let press = |button: &str| browser.run(&format!("document.getElementById('{button}').click()"));
    browser.wait_for(page_is_fresh);
    // Not before: a browser that starts may take the computer from a worm for so long that it loses its servo.
    press("arm");
    watched.wait_for_mode("armed");
    browser.wait_for(page_is_fresh);
    let rest = || {
        assert_eq!(
            request(watched.address, "POST", "/api/command/hold", &[], "").status,
            200
        );
        watched.wait_for_mode("holding");
    };
    press("crawl");
    watched.wait_for_mode("crawling");
    rest();

    for (what, then_hold, pause_ms) in [("crawl, then hold", true, 300), ("crawl alone", false, 2500)] {
        browser.wait_for(page_is_fresh);
        line.hold_up(true);
        press("crawl");
        if then_hold {
            press("hold");
        }
        std::thread::sleep(Duration::from_millis(pause_ms));
        let is_disabled = browser.run("return document.getElementById('crawl').disabled");
        line.hold_up(false);
        assert_eq!(is_disabled, !then_hold, "{what}");
        // Both have their answers when the next is heard.
        browser.wait_for(page_is_fresh);
        wait_for("an answer", PATIENCE, || {
            browser.run("return document.getElementById('message').textContent !== ''") == true
        });
        watched.worm.assert_does_not_crawl();
        assert_eq!(watched.mode(), "holding", "{what}");
    }
}

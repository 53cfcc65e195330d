//! Many connections of one address, as all users behind a tunnel or a proxy are: none of them keeps the others from HOLD.

use super::PATIENCE;
use super::http::request;
use super::watched::Watched;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};

/// More than are taken of one address.
const CROWD: usize = 80;

fn connect(address: SocketAddr, text: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).expect("listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("can be set");
    stream.write_all(text.as_bytes()).expect("reads");
    stream
}

/// What comes next.
fn piece(stream: &mut TcpStream) -> String {
    let mut bytes = [0; 4096];
    let count = stream.read(&mut bytes).expect("something comes");
    assert!(count > 0, "it goes on");
    String::from_utf8_lossy(&bytes[..count]).into_owned()
}

/// The head of an answer, and the beginning of its body.
fn beginning(stream: &mut TcpStream) -> String {
    let mut text = piece(stream);
    while text.split_once("\r\n\r\n").is_none_or(|(_, body)| body.is_empty()) {
        text += &piece(stream);
    }
    text
}

#[test]
fn a_crowd_at_one_address_keeps_nobody_from_hold() {
    let watched = Watched::start("d-crowd");
    let address = watched.address;
    let is_served = |by: &str| {
        for (method, path) in [
            ("POST", "/api/command/hold"),
            ("GET", "/metrics"),
            ("GET", "/api/state"),
        ] {
            let reply = request(address, method, path, &[], "");
            // A worm without torque holds already, which the controller says.
            assert!([200, 422].contains(&reply.status), "beside {by}: {path}: {reply:?}");
        }
    };

    let ask = format!("GET /api/events HTTP/1.1\r\nHost: {address}\r\n\r\n");
    // One after the other, as browsers come.
    let opened = (0..CROWD).map(|_| {
        let mut page = connect(address, &ask);
        (beginning(&mut page), page)
    });
    let (answers, mut pages): (Vec<String>, Vec<TcpStream>) = opened.unzip();
    let (taken, refused): (Vec<&String>, Vec<&String>) =
        answers.iter().partition(|answer| answer.starts_with("HTTP/1.1 200"));
    assert_eq!(taken.len(), 48, "{answers:?}");
    for answer in refused {
        assert!(answer.starts_with("HTTP/1.1 503"), "{answer}");
        assert!(
            answer.contains("{\"error\":\"48 pages of 127.0.0.1 are open"),
            "{answer}"
        );
    }
    is_served("streams");

    let half_a_head = format!("POST /api/command/hold HTTP/1.1\r\nHost: {address}\r\n");
    let _half_sent: Vec<TcpStream> = (0..CROWD).map(|_| connect(address, &half_a_head)).collect();
    is_served("half-sent heads");
    let half_a_body = format!("{half_a_head}Content-Length: 100\r\n\r\n{{").replace("hold", "crawl");
    let _half_sent: Vec<TcpStream> = (0..CROWD).map(|_| connect(address, &half_a_body)).collect();
    is_served("half-sent bodies");

    assert_eq!(
        watched.get("/api/health").json()["pages"],
        48,
        "no page was closed for it"
    );
    piece(&mut pages[0]);
}

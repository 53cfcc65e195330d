//! Who commands, and when: what the relay's record calls a page, and how old its request is.

use percent_encoding::percent_decode_str;
use std::net::IpAddr;

/// Longest name that somebody may give himself, characters: the controller's record keeps 32 bytes in all.
const MAX_NAME: usize = 20;
/// Longest key of a page, bytes.
const MAX_KEY: usize = 64;

/// Browsers and tools, the more special first: each one claims to be those below it.
const AGENTS: [(&str, &str); 7] = [
    ("Edg", "Edge"),
    ("Firefox/", "Firefox"),
    ("Chrome/", "Chrome"),
    ("Safari/", "Safari"),
    ("curl/", "curl"),
    ("Wget/", "wget"),
    ("ython", "Python"),
];

/// Where it runs, the more special first.
const SYSTEMS: [(&str, &str); 6] = [
    ("Android", "Android"),
    ("iPhone", "iPhone"),
    ("iPad", "iPad"),
    ("Windows", "Windows"),
    ("Mac OS", "macOS"),
    ("Linux", "Linux"),
];

/// Who sent a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Caller {
    /// Tells pages apart: two with one key are one driver.
    pub(super) key: String,
    /// For people.
    pub(super) name: String,
    /// When it was asked for.
    pub(super) asked: Asked,
}

/// When somebody asked for something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Asked {
    /// As the page says it, ns of `CLOCK_MONOTONIC` of this computer.
    Then(u64),
    /// Nobody says it: at the latest when the request was read.
    Before(u64),
}

impl Asked {
    /// By what a page says: the newest event's number, and for how many milliseconds it has had that, as `NUMBER+HELD`.
    ///
    /// The number is the time of the event, ms of `CLOCK_MONOTONIC`, so what a request says is a little too early, by the way of the event to
    /// the page.
    ///
    /// # Errors
    /// In words, for a text that is none of these.
    pub(super) fn read(text: Option<&str>, now_ns: u64) -> Result<Self, String> {
        let Some(text) = text else {
            return Ok(Self::Before(now_ns));
        };
        let sum = text.split_once('+').and_then(|(number, held)| {
            let [number_ms, held_ms] = [number, held].map(|part| part.trim().parse::<u64>().ok());
            number_ms?.checked_add(held_ms?)?.checked_mul(1_000_000)
        });
        sum.map(Self::Then).ok_or_else(|| {
            "X-Wormd-Asked is the id of the newest event and the milliseconds since it came, as in 8123+40".to_owned()
        })
    }

    /// The time, ns.
    pub(super) fn at_ns(self) -> u64 {
        match self {
            Self::Then(ns) | Self::Before(ns) => ns,
        }
    }
}

impl Caller {
    /// By the address and what a request says of itself: `X-Wormd-Client` (a page's key), `X-Wormd-Name` (percent-encoded), `User-Agent`.
    pub(super) fn new(
        address: IpAddr,
        key: Option<&str>,
        name: Option<&str>,
        agent: Option<&str>,
        asked: Asked,
    ) -> Self {
        let agent = agent_text(agent.unwrap_or_default());
        let given: String = percent_decode_str(name.unwrap_or_default())
            .decode_utf8_lossy()
            .chars()
            .filter(|it| !it.is_control())
            .take(MAX_NAME)
            .collect();
        let address = address.to_canonical();
        let place = if address.is_loopback() {
            String::new()
        } else {
            format!(" {address}")
        };
        let name = match given.trim() {
            "" => format!("{agent}{place}"),
            given => format!("{given}, {agent}{place}"),
        };
        let key = match key.filter(|key| !key.is_empty() && key.len() <= MAX_KEY) {
            Some(key) => format!("{address} {key}"),
            // Whoever gives no key is one for each address and program.
            None => format!("{address} by {name}"),
        };
        Self { key, name, asked }
    }
}

/// A `User-Agent` in a word or two.
fn agent_text(agent: &str) -> String {
    let first =
        |table: &[(&str, &'static str)]| table.iter().find(|(part, _)| agent.contains(part)).map(|found| found.1);
    match (first(&AGENTS), first(&SYSTEMS)) {
        (Some(program), Some(system)) => format!("{program}/{system}"),
        (Some(program), None) => program.to_owned(),
        (None, _) => "a browser".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_caller_is_named_by_person_program_and_place() {
        let here: IpAddr = [127, 0, 0, 1].into();
        let there: IpAddr = [10, 0, 0, 7].into();
        let phone = "Mozilla/5.0 (Linux; Android 10; K) AppleWebKit/537.36 (KHTML, like Gecko) Chrome/149.0.0.0 Mobile Safari/537.36";
        let name = |address, name, agent| Caller::new(address, Some("k"), name, agent, Asked::Before(0)).name;
        assert_eq!(name(there, None, Some(phone)), "Chrome/Android 10.0.0.7");
        assert_eq!(name(here, Some("J%C3%B6rg"), Some(phone)), "Jörg, Chrome/Android");
        assert_eq!(name(here, Some("%0a%1b[31m"), Some("curl/8.5.0")), "[31m, curl");
        assert_eq!(name(here, None, None), "a browser");
        let mapped: IpAddr = std::net::Ipv4Addr::new(10, 0, 0, 7).to_ipv6_mapped().into();
        assert_eq!(name(mapped, None, Some("curl/8")), "curl 10.0.0.7");
        let key = |key, agent| Caller::new(here, key, None, Some(agent), Asked::Before(0)).key;
        assert_ne!(key(Some("a"), "curl/8"), key(Some("b"), "curl/8"));
        assert_eq!(key(None, "curl/8"), key(Some(""), "curl/8"));
        assert_ne!(key(None, "curl/8"), key(None, "python-requests"));
    }

    #[test]
    fn when_a_page_asked_is_what_it_says_or_now() {
        let (now_ns, ms) = (9_000_000_000, 1_000_000);
        for (text, asked) in [
            (None, Ok(Asked::Before(now_ns))),
            (Some("8123+40"), Ok(Asked::Then(8163 * ms))),
            (Some(" 8123 + 0 "), Ok(Asked::Then(8123 * ms))),
            (Some("8123"), Err(())),
            (Some("+40"), Err(())),
            (Some("8123+-4"), Err(())),
            (Some("8123+4.5"), Err(())),
            (Some("18446744073709551615+1"), Err(())),
            (Some("18446744073709+0"), Ok(Asked::Then(18_446_744_073_709 * ms))),
            (Some("18446744073710+0"), Err(())),
        ] {
            let read = Asked::read(text, now_ns).map_err(|why| assert!(why.contains("8123+40"), "{why}"));
            assert_eq!(read, asked, "{text:?}");
        }
    }
}

//! Zenoh, and all that is set of it: TLS both ways, no scouting, and rules that tie each key to one certificate.
//!
//! A laptop sends on `wormd/1/up/CERTIFICATE/SESSION` and gets on `wormd/1/down/CERTIFICATE/SESSION`, where CERTIFICATE is the common
//! name of its certificate. The rules permit to each certificate its own keys and nothing else, in both directions and at both ends, so a
//! key says who has sent a message, and nobody hears what is meant for another.

use super::credentials::Credentials;
use crossbeam::channel::{Receiver, Sender, bounded};
use serde_json::{Value, json};
use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};

/// Messages that may wait to be read; no more are under way at a time than this.
const QUEUE: usize = 1024;
/// Largest message that is taken from the network, bytes.
const MAX_MESSAGE: usize = 256 << 10;
/// A link that says nothing for so long is over, ms.
const LEASE_MS: u64 = 3000;
/// What the kernel keeps of what is not sent yet, bytes: after an outage it comes first, and is old.
const SEND_BUFFER: usize = 64 << 10;
/// Batches that may wait for the kernel, as many as Zenoh takes, and how long a message waits for a place among them, µs. What may be under way
/// without being confirmed finds room in them: on a link that loses nothing nothing is lost.
const BATCHES: usize = 16;
const PLACE_WAIT_US: i64 = 5000;
/// How long a connection may take for its handshake, ms. Zenoh takes nobody for 100 ms after each one that fails: with its own 10 s, a hundred
/// connections that say nothing and come again keep out everybody.
const HANDSHAKE_MS: u64 = 120_000;
/// Most links at a time.
const MAX_LINKS: usize = 64;

/// Which way a message goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Way {
    /// From a laptop to a robot.
    Up,
    /// From a robot to a laptop.
    Down,
}

impl Way {
    fn name(self) -> &'static str {
        match self {
            Self::Up => "up",
            Self::Down => "down",
        }
    }

    fn back(self) -> Self {
        match self {
            Self::Up => Self::Down,
            Self::Down => Self::Up,
        }
    }
}

/// A laptop's process: certificate and session.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Party {
    /// Common name of its certificate.
    pub(crate) certificate: String,
    /// Tells its processes apart.
    pub(crate) session: String,
}

impl Party {
    fn key(&self, way: Way) -> String {
        format!("wormd/1/{}/{}/{}", way.name(), self.certificate, self.session)
    }

    fn of(key: &str) -> Option<Self> {
        let mut parts = key.split('/').skip(3);
        Some(Self {
            certificate: parts.next()?.to_owned(),
            session: parts.next()?.to_owned(),
        })
    }
}

/// A message, and from or for whom.
pub(crate) type Message = (Party, Vec<u8>);

/// An end of the network.
pub(crate) struct Network {
    session: zenoh::Session,
    /// The way on which this end sends.
    way: Way,
    messages: Receiver<Message>,
    woken: UnixStream,
    _subscribers: Vec<Subscriber<()>>,
}

/// What an end needs.
pub(crate) struct End<'a> {
    /// What it proves itself by.
    pub(crate) credentials: &'a Credentials,
    /// The certificates that may be at the other end.
    pub(crate) others: &'a [String],
    /// Whose keys are used: those of the laptops.
    pub(crate) laptops: &'a [String],
    /// Where it listens.
    pub(crate) listen: &'a [String],
    /// Where it connects.
    pub(crate) connect: &'a [String],
    /// The way on which it sends.
    pub(crate) way: Way,
    /// The only session whose messages are of interest; none for all.
    pub(crate) session: Option<&'a str>,
}

impl Network {
    /// Opens an end. A connection is tried again and again; it need not be there yet.
    ///
    /// # Errors
    /// In words, when Zenoh takes the configuration not, or an address cannot be listened at.
    pub(crate) fn open(end: &End<'_>) -> Result<Self, String> {
        let text = configuration(end).to_string();
        let config = zenoh::Config::from_json5(&text).map_err(|error| format!("Zenoh's configuration: {error}"))?;
        let session = zenoh::open(config).wait().map_err(|error| error.to_string())?;
        let (sender, messages) = bounded(QUEUE);
        let (woken, wake) = UnixStream::pair().map_err(|error| error.to_string())?;
        for stream in [&woken, &wake] {
            stream.set_nonblocking(true).map_err(|error| error.to_string())?;
        }
        let wake = Arc::new(wake);
        let mut subscribers = Vec::new();
        for laptop in end.laptops {
            let key = format!(
                "wormd/1/{}/{laptop}/{}",
                end.way.back().name(),
                end.session.unwrap_or("*")
            );
            let take = receiver(sender.clone(), Arc::clone(&wake));
            let subscriber = session.declare_subscriber(&key).callback(take).wait();
            subscribers.push(subscriber.map_err(|error| format!("{key}: {error}"))?);
        }
        Ok(Self {
            session,
            way: end.way,
            messages,
            woken,
            _subscribers: subscribers,
        })
    }

    /// Sends a message, unless the network takes nothing now: then it is gone. Waits a few milliseconds at most.
    pub(crate) fn send(&self, party: &Party, message: Vec<u8>) {
        let put = self
            .session
            .put(party.key(self.way), ZBytes::from(message))
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::InteractiveHigh)
            // Each express message takes a batch of its own: many pieces at once would not find room.
            .express(self.way == Way::Up);
        if let Err(error) = put.wait() {
            tracing::debug!("not sent: {error}");
        }
    }

    /// What has come.
    pub(crate) fn messages(&self) -> impl Iterator<Item = Message> + '_ {
        // Nothing to read is no error.
        let _ = (&self.woken).read(&mut [0; 256]);
        self.messages.try_iter()
    }

    /// Can be read when something has come.
    pub(crate) fn woken(&self) -> &UnixStream {
        &self.woken
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        if let Err(error) = self.session.close().wait() {
            tracing::debug!("the network: {error}");
        }
    }
}

/// Takes messages in a thread of Zenoh's, which never waits.
fn receiver(sender: Sender<Message>, wake: Arc<UnixStream>) -> impl Fn(zenoh::sample::Sample) + Send + Sync {
    move |sample| {
        let Some(party) = Party::of(sample.key_expr().as_str()) else {
            return;
        };
        // Where too much waits, it is dropped, and found to be missing.
        let _ = sender.try_send((party, sample.payload().to_bytes().into_owned()));
        match (&*wake).write(&[0]) {
            Ok(_) => {}
            // It is awake.
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => tracing::debug!("the reader is gone: {error}"),
        }
    }
}

/// All that is set of Zenoh. What is not named here is off, or does not listen.
fn configuration(end: &End<'_>) -> Value {
    let Credentials {
        certificate,
        key,
        authority,
        ..
    } = end.credentials;
    let patient = |address: &String| format!("{address}#tls_handshake_timeout_ms={HANDSHAKE_MS}");
    let listen: Vec<_> = end.listen.iter().map(patient).collect();
    json!({
        "mode": "peer",
        "listen": { "endpoints": listen, "exit_on_failure": true, "timeout_ms": 0 },
        "connect": {
            "endpoints": end.connect,
            "exit_on_failure": false,
            "timeout_ms": -1,
            "retry": { "period_init_ms": 250, "period_max_ms": 2000, "period_increase_factor": 2 },
        },
        "open": { "return_conditions": { "connect_scouted": false, "declares": false } },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        "adminspace": { "enabled": false },
        "transport": {
            "unicast": { "max_sessions": MAX_LINKS, "accept_pending": 16, "open_timeout": 5000, "accept_timeout": 5000 },
            "link": {
                "protocols": ["tls"],
                "tx": {
                    "lease": LEASE_MS,
                    "keep_alive": 4,
                    "queue": {
                        "size": { "interactive_high": BATCHES },
                        "congestion_control": { "drop": { "wait_before_drop": PLACE_WAIT_US } },
                    },
                },
                "rx": { "max_message_size": MAX_MESSAGE },
                "tls": {
                    "root_ca_certificate": authority,
                    "enable_mtls": true,
                    "listen_private_key": key,
                    "listen_certificate": certificate,
                    "connect_private_key": key,
                    "connect_certificate": certificate,
                    "verify_name_on_connect": true,
                    "close_link_on_expiration": false,
                    "so_sndbuf": SEND_BUFFER,
                },
            },
        },
        "access_control": access(end),
    })
}

/// Who may do what, at this end.
fn access(end: &End<'_>) -> Value {
    let mut rules = Vec::new();
    let mut subjects = Vec::new();
    let mut policies = Vec::new();
    // A robot knows its laptops apart; a laptop has one robot.
    for other in end.others {
        let own: Vec<&String> = match end.way {
            Way::Down => vec![other],
            Way::Up => end.laptops.iter().collect(),
        };
        let keys = |way: Way| -> Vec<String> {
            own.iter()
                .map(|laptop| format!("wormd/1/{}/{laptop}/*", way.name()))
                .collect()
        };
        let mut rule = |id: String, flow: &str, message: &str, way: Way| {
            rules.push(json!({
                "id": id, "permission": "allow", "flows": [flow], "messages": [message], "key_exprs": keys(way),
            }));
            id
        };
        let ids = [
            rule(format!("{other}-gives"), "ingress", "put", end.way.back()),
            rule(format!("{other}-wants"), "ingress", "declare_subscriber", end.way),
            rule(format!("{other}-gets"), "egress", "put", end.way),
            rule(
                format!("{other}-is-asked"),
                "egress",
                "declare_subscriber",
                end.way.back(),
            ),
        ];
        subjects.push(json!({ "id": other, "cert_common_names": [other], "link_protocols": ["tls"] }));
        policies.push(json!({ "rules": ids, "subjects": [other] }));
    }
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::{Path, PathBuf};
    use std::time::{Duration, Instant};

    #[test]
    fn zenoh_takes_the_configuration_and_it_is_closed() {
        let credentials = Credentials {
            certificate: PathBuf::from("robot1.pem"),
            key: PathBuf::from("robot1.key"),
            authority: PathBuf::from("ca.pem"),
            name: "robot1".to_owned(),
        };
        let names = ["anna".to_owned(), "hall".to_owned()];
        let end = End {
            credentials: &credentials,
            others: &names,
            laptops: &names,
            listen: &["tls/0.0.0.0:7447".to_owned()],
            connect: &[],
            way: Way::Down,
            session: None,
        };
        let value = configuration(&end);
        let config = zenoh::Config::from_json5(&value.to_string()).expect("is taken");
        let read =
            |key: &str| -> Value { serde_json::from_str(&config.get_json(key).expect("is set")).expect("is JSON") };
        assert_eq!(read("scouting/multicast/enabled"), json!(false));
        assert_eq!(read("scouting/gossip/enabled"), json!(false));
        assert_eq!(read("transport/link/tls/enable_mtls"), json!(true));
        assert_eq!(read("transport/link/protocols"), json!(["tls"]));
        let access = read("access_control");
        assert_eq!(
            (&access["enabled"], &access["default_permission"]),
            (&json!(true), &json!("deny"))
        );
        assert_eq!(access["rules"].as_array().map(Vec::len), Some(8));
        for rule in access["rules"].as_array().expect("rules") {
            // Each rule is about the keys of one certificate.
            let name = rule["id"].as_str().and_then(|id| id.split('-').next()).expect("a name");
            for key in rule["key_exprs"].as_array().expect("keys") {
                let party = Party::of(key.as_str().expect("a key")).expect("a party's key");
                assert_eq!(party.certificate, name);
            }
        }
    }

    /// An end with a certificate of its own in `keys`.
    fn open(keys: &Path, name: &str, other: &str, way: Way, port: u16) -> Network {
        let file = |suffix: &str| keys.join(format!("{name}{suffix}"));
        let credentials = Credentials {
            certificate: file(".pem"),
            key: file(".key"),
            authority: keys.join("ca.pem"),
            name: name.to_owned(),
        };
        let address = [format!("tls/127.0.0.1:{port}")];
        let (listen, connect): (&[String], &[String]) = match way {
            Way::Down => (&address, &[]),
            Way::Up => (&[], &address),
        };
        let end = End {
            credentials: &credentials,
            others: &[other.to_owned()],
            laptops: &["anna".to_owned()],
            listen,
            connect,
            way,
            session: None,
        };
        Network::open(&end).expect("opens")
    }

    #[test]
    fn on_a_link_that_loses_nothing_all_that_may_be_under_way_comes() {
        const WINDOW: usize = 96 << 10;
        let folder = tempfile::tempdir().expect("a folder");
        let make_keys = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/bridge/make-keys");
        for arguments in ["keys authority", "keys robot robot1 127.0.0.1", "keys laptop anna"] {
            let mut command = std::process::Command::new(&make_keys);
            let output = command.args(arguments.split(' ')).current_dir(folder.path()).output();
            assert!(output.expect("the script runs").status.success(), "{arguments}");
        }
        let keys = folder.path().join("keys");
        let free = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let port = free.local_addr().expect("is bound").port();
        drop(free);
        let robot = open(&keys, "robot1", "anna", Way::Down, port);
        let laptop = open(&keys, "anna", "robot1", Way::Up, port);
        let party = Party {
            certificate: "anna".to_owned(),
            session: "1".to_owned(),
        };
        let begun = Instant::now();
        let patience = Duration::from_secs(20);
        // Until both know of each other.
        while laptop.messages().count() == 0 {
            assert!(begun.elapsed() < patience, "no link");
            robot.send(&party, b"first".to_vec());
            std::thread::sleep(Duration::from_millis(50));
        }
        std::thread::sleep(Duration::from_millis(200));
        laptop.messages().for_each(drop);
        // Pieces of a history, then of many small frames.
        for size in [16 << 10, 600] {
            for round in 0..100 {
                let count = WINDOW / size;
                (0..count).for_each(|_| robot.send(&party, vec![7; size]));
                let begun = Instant::now();
                let mut came = 0;
                while came < count {
                    assert!(
                        begun.elapsed() < patience,
                        "{came} of {count} of {size} bytes in round {round}"
                    );
                    came += laptop.messages().count();
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
        }
    }
}

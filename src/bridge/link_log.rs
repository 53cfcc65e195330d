//! Why a link does not come about, as Zenoh says it: in its log, and nowhere else.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use tracing::field::{Field, Visit};
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::layer::{Context, Layer};

/// What was said longer ago than the slowest attempt takes is not of the newest one.
const NEW: Duration = Duration::from_secs(10);
/// Most addresses of which something is kept.
const MAX_ADDRESSES: usize = 256;

static SAID: Mutex<Said> = Mutex::new(Said {
    attempts: BTreeMap::new(),
    refused: None,
});

struct Said {
    /// By address, of connections that this process wants.
    attempts: BTreeMap<String, (Instant, String)>,
    /// Of a connection that another computer wanted.
    refused: Option<String>,
}

/// Takes from the log of this process what Zenoh says of links that do not come about.
#[derive(Debug)]
pub struct LinkLog;

impl LinkLog {
    /// Whether this may be such a message.
    pub fn takes(metadata: &Metadata<'_>) -> bool {
        let (target, level) = (metadata.target(), *metadata.level());
        (target == "zenoh::net::runtime::orchestrator" && level == Level::DEBUG)
            || (target.starts_with("zenoh_link_tls") && level == Level::WARN)
    }
}

impl<S: Subscriber> Layer<S> for LinkLog {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut text = Text(String::new());
        event.record(&mut text);
        take(&text.0);
    }
}

struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
}

fn take(text: &str) {
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((address, rest)) = text
        .strip_prefix("Unable to connect to configured peer ")
        .and_then(|rest| rest.split_once("! "))
    {
        let reason = rest.rsplit_once(". Retry in ").map_or(rest, |(reason, _)| reason);
        // The name or address is known.
        let reason = match reason.strip_prefix("Can not create a new TLS link bound to ") {
            Some(rest) => rest
                .split_once("): ")
                .map_or(rest, |(_, reason)| reason)
                .trim_start_matches('['),
            None => reason,
        };
        let reason = essence(reason);
        if said.attempts.len() < MAX_ADDRESSES || said.attempts.contains_key(address) {
            said.attempts.insert(address.to_owned(), (Instant::now(), reason));
        }
    } else if let Some((reason, _)) = text.split_once(". Hint:") {
        said.refused = Some(essence(reason));
    }
}

/// Without places in Zenoh's own source, and without times, which would make each attempt's reason another one.
pub(crate) fn essence(text: &str) -> String {
    let ends = [" at /", ": verification time "].map(|end| text.find(end));
    let end = ends.into_iter().flatten().min().unwrap_or(text.len());
    text[..end].trim().to_owned()
}

/// Why no connection to an address came about of late.
pub(crate) fn of_attempt(address: &str) -> Option<String> {
    let said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    let (since, reason) = said.attempts.get(address)?;
    (since.elapsed() < NEW).then(|| reason.clone())
}

/// Why another computer's connection was refused, if that happened since this was asked last.
pub(crate) fn take_refused() -> Option<String> {
    SAID.lock().unwrap_or_else(PoisonError::into_inner).refused.take()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing_subscriber::layer::SubscriberExt;

    #[test]
    fn what_zenoh_says_of_a_link_is_found_by_its_address() {
        let subscriber = tracing_subscriber::registry().with(LinkLog);
        tracing::subscriber::with_default(subscriber, || {
            tracing::debug!(
                "Unable to connect to configured peer {}! {}. Retry in {:?}.",
                "tls/robot1:7447",
                "Can not create a new TLS link bound to IpAddress(V4(Ipv4Addr([127, 0, 0, 1]))): invalid peer certificate: BadSignature at \
                 /root/.cargo/x/unicast.rs:378.",
                Duration::from_secs(1)
            );
            tracing::warn!(
                "{}. Hint: increase the system open file limit.",
                "invalid peer certificate: certificate expired: verification time 2 (UNIX), but certificate is not valid after 1"
            );
            tracing::warn!("something else");
        });
        assert_eq!(
            of_attempt("tls/robot1:7447").as_deref(),
            Some("invalid peer certificate: BadSignature")
        );
        assert_eq!(of_attempt("tls/robot2:7447"), None);
        let refused = "invalid peer certificate: certificate expired";
        assert_eq!(take_refused().as_deref(), Some(refused));
        assert_eq!(take_refused(), None);
    }
}

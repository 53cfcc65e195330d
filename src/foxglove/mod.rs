//! The topics of a worm live in Foxglove: a subscriber like the recorder, whose log is a WebSocket.
//!
//! It gives and takes nothing: no parameters, no services, no messages of clients. The protocol and its server are Foxglove's own; each
//! client has a queue there, of which the oldest messages are dropped, so a slow one delays nobody. Times of messages are wall-clock
//! times, as viewers of live data expect; the messages' own fields keep `CLOCK_MONOTONIC`.
//!
//! - [`channels`]: a batch of messages into the channels of the clients.
//! - [`server`]: the WebSocket server on a thread of its own.

mod channels;
mod server;

use crate::failure::Failure;
use crate::realtime::monotonic_ns;
use crate::recorder::{POLL_INTERVAL, RecordedTopics, Thinner};
use crate::topics::{Hub, Instance};
use channels::Channels;
use server::Server;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use worm_log::Channel;

/// A worm whose silence lasts longer is said to be silent, ns.
const SILENCE_NS: u64 = 1_000_000_000;

/// The topics of a worm on their way to Foxglove.
pub(crate) struct LiveStream {
    // The ports before the hub that they are of.
    topics: RecordedTopics,
    _hub: Hub,
    thinner: Option<Thinner>,
    channels: Channels,
    server: Server,
}

impl LiveStream {
    /// Subscribes to `topics` and listens. With `rate_hz`, ticks and estimates are thinned to it.
    ///
    /// # Errors
    /// [`Failure::Unusable`] for an address that cannot be used; [`Failure::Failed`] when the topics fail.
    pub(crate) fn open(
        instance: &Instance,
        topics: &[Channel],
        address: SocketAddr,
        rate_hz: Option<f64>,
    ) -> Result<Self, Failure> {
        let hub = Hub::open(instance).map_err(Failure::failed)?;
        let subscribed = RecordedTopics::open(&hub, topics)?;
        let context = foxglove::Context::new();
        let channels = Channels::open(&context, topics)?;
        let server = Server::start(&context, instance.worm(), address)?;
        Ok(Self {
            topics: subscribed,
            _hub: hub,
            thinner: rate_hz.map(Thinner::new),
            channels,
            server,
        })
    }

    /// Where it listens.
    pub(crate) const fn address(&self) -> SocketAddr {
        self.server.address()
    }

    /// Passes on what comes until `end` is set. Clients learn when the worm is silent, and when it is back.
    ///
    /// # Errors
    /// [`Failure::Failed`] when the topics or the server fail.
    pub(crate) fn run(mut self, end: &AtomicBool) -> Result<(), Failure> {
        let mut heard_ns = monotonic_ns();
        let mut told_silence_s = 0;
        while !end.load(Ordering::Relaxed) {
            std::thread::sleep(POLL_INTERVAL);
            let mut batch = self.topics.read()?;
            let now_ns = monotonic_ns();
            if !batch.states.is_empty() {
                heard_ns = now_ns;
            }
            if let Some(thinner) = &mut self.thinner {
                batch = thinner.thin(&batch);
            }
            self.channels.send(&batch);
            let silence_ns = now_ns.saturating_sub(heard_ns);
            let silence_s = if silence_ns > SILENCE_NS {
                silence_ns / 1_000_000_000
            } else {
                0
            };
            if silence_s != told_silence_s {
                self.server.tell_silence(silence_s);
                told_silence_s = silence_s;
            }
        }
        self.server.stop();
        Ok(())
    }
}

//! Foxglove's WebSocket server on a thread of its own.

use crate::failure::Failure;
use foxglove::websocket::Status;
use foxglove::{Context, WebSocketServer, WebSocketServerHandle};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::{Builder, Runtime};

/// Messages that wait for one client: three seconds of a worm at 1 kHz. Beyond that its oldest ones are dropped.
const BACKLOG: usize = 10_000;

/// How long open connections may take to end.
const FAREWELL: Duration = Duration::from_millis(500);

/// The name of the message that says how long the worm has been silent.
const SILENCE: &str = "silence";

/// A server that listens.
pub(super) struct Server {
    handle: WebSocketServerHandle,
    address: SocketAddr,
    runtime: Runtime,
}

impl Server {
    /// Listens at `address`, and serves the channels of `context`.
    ///
    /// # Errors
    /// [`Failure::Unusable`] for an address that is taken or not this computer's; [`Failure::Failed`] when the system gives no thread.
    pub(super) fn start(context: &Arc<Context>, worm: &str, address: SocketAddr) -> Result<Self, Failure> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("foxglove")
            .enable_all()
            .build()
            .map_err(Failure::failed)?;
        let host = match address {
            SocketAddr::V4(address) => address.ip().to_string(),
            SocketAddr::V6(address) => format!("[{}]", address.ip()),
        };
        let server = WebSocketServer::new()
            .name(format!("wormd: {worm}"))
            .bind(host, address.port())
            .message_backlog_size(BACKLOG)
            .tokio_runtime(runtime.handle())
            .context(context);
        let handle = runtime.block_on(server.start()).map_err(|error| {
            Failure::unusable(format!(
                "{address}: {error}: give an address of this computer and a free port with --listen, port 0 for any that is free"
            ))
        })?;
        let address = SocketAddr::new(address.ip(), handle.port());
        Ok(Self {
            handle,
            address,
            runtime,
        })
    }

    /// Where it listens.
    pub(super) const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Tells every client how long the worm has been silent; at 0 s it is not.
    pub(super) fn tell_silence(&self, silence_s: u64) {
        if silence_s == 0 {
            self.handle.remove_status(vec![SILENCE.to_owned()]);
        } else {
            let text = format!("no state of the worm for {silence_s} s: what is shown is old");
            self.handle.publish_status(Status::warning(text).with_id(SILENCE));
        }
    }

    /// Ends all connections.
    pub(super) fn stop(self) {
        let farewell = self.handle.stop();
        // Who does not answer is cut off.
        let _ = self
            .runtime
            .block_on(async { tokio::time::timeout(FAREWELL, farewell.wait()).await });
        self.runtime.shutdown_timeout(FAREWELL);
    }
}

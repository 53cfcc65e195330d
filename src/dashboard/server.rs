//! The server: takes connections, within limits, until a signal ends it.

use super::Token;
use super::access::Hosts;
use super::app::{App, MAX_PAGES, Peer};
use super::feed::Feed;
use super::fleet::FleetThread;
use super::paced_stream::PacedStream;
use super::relay_thread::{RelayThread, Shared};
use super::routes::router;
use crate::black_box::folder::Folder;
use crate::failure::Failure;
use crate::relay::client::RelayLink;
use crate::relay::wire::Subject;
use crate::topics::Instance;
use axum::Router;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::collections::HashMap;
use std::ffi::OsString;
use std::net::{IpAddr, TcpListener};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::sync::Semaphore;
use worm_estimator::config::Config;

/// Most connections, and most of one address. A browser opens six.
const MAX_CONNECTIONS: usize = 256;
const MAX_OF_ONE: usize = 64;
/// How long the head of a request may take, and how long a connection may wait for its next one.
const HEAD_TIME: Duration = Duration::from_secs(10);
/// Most lines in the head of a request.
const MAX_HEADERS: usize = 64;
/// Largest head of a request, and most that waits to be sent beside the kernel's buffer, bytes.
const MAX_BUFFER: usize = 16 << 10;
/// Pause after a connection that could not be taken.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// What the server is started with.
pub(crate) struct Settings {
    /// Which worm.
    pub(crate) config: Config,
    /// Its namespace.
    pub(crate) instance: Instance,
    /// The same worm as arguments for its relay.
    pub(crate) arguments: Vec<OsString>,
    /// Where it listens.
    pub(crate) listener: TcpListener,
    /// What permits to drive.
    pub(crate) token: Token,
    /// Names by which it may be asked for, besides its addresses.
    pub(crate) hosts: Vec<String>,
    /// Where reports are.
    pub(crate) reports: Option<PathBuf>,
    /// The black box's.
    pub(crate) boxes: Folder,
}

/// Serves until a byte can be read from `end`.
///
/// # Errors
/// [`Failure::Failed`] when the system gives no thread, or no sockets.
pub(crate) fn run(settings: Settings, end: std::os::unix::net::UnixStream) -> Result<(), Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .max_blocking_threads(2)
        .build()
        .map_err(Failure::failed)?;
    let shared = Shared::new(Feed::new(Subject::of(&settings.config)));
    let link = RelayLink::new(&settings.instance, settings.arguments, "dashboard".to_owned());
    let address = settings.listener.local_addr().map_err(Failure::failed)?;
    let app = Arc::new(App {
        relay: RelayThread::start(&settings.instance, link, shared.clone())?,
        fleet: FleetThread::start(&settings.instance, &settings.config.topics.root)?,
        shared,
        token: settings.token,
        hosts: Hosts::new(address.ip(), settings.hosts),
        reports: settings.reports,
        boxes: settings.boxes,
        pages: Arc::new(Semaphore::new(MAX_PAGES)),
    });
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(settings.listener).map_err(Failure::failed)?;
        end.set_nonblocking(true).map_err(Failure::failed)?;
        let end = tokio::net::UnixStream::from_std(end).map_err(Failure::failed)?;
        let serve = std::pin::pin!(accept(listener, router(app)));
        let ended = std::pin::pin!(end.readable());
        futures_util::future::select(serve, ended).await;
        Ok(())
    })
}

/// Connections of each address.
#[derive(Debug, Default)]
struct Places(Mutex<HashMap<IpAddr, usize>>);

/// The place of one connection.
struct Place {
    places: Arc<Places>,
    address: IpAddr,
}

impl Places {
    /// A place for a connection; none when there are too many.
    fn take(self: &Arc<Self>, address: IpAddr) -> Option<Place> {
        let mut counts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let all: usize = counts.values().sum();
        let count = counts.entry(address).or_default();
        if all >= MAX_CONNECTIONS || *count >= MAX_OF_ONE {
            return None;
        }
        *count += 1;
        Some(Place {
            places: Arc::clone(self),
            address,
        })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut counts = self.places.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(count) = counts.get_mut(&self.address) {
            *count -= 1;
            if *count == 0 {
                counts.remove(&self.address);
            }
        }
    }
}

async fn accept(listener: tokio::net::TcpListener, router: Router) {
    let places = Arc::new(Places::default());
    loop {
        match listener.accept().await {
            Ok((stream, peer)) => {
                // One too many is closed at once: its browser tries again.
                if let Some(place) = places.take(peer.ip()) {
                    tokio::spawn(serve(stream, Peer(peer.ip()), router.clone(), place));
                }
            }
            Err(error) => {
                // No more files, perhaps. Those who are connected are still served.
                tracing::debug!("no connection can be taken: {error}");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

async fn serve(stream: TcpStream, peer: Peer, router: Router, _place: Place) {
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!("a connection that waits to fill its packets: {error}");
    }
    let inner = TowerToHyperService::new(router);
    let service = service_fn(move |mut request: hyper::Request<hyper::body::Incoming>| {
        request.extensions_mut().insert(peer);
        inner.call(request)
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIME)
        .max_headers(MAX_HEADERS)
        .max_buf_size(MAX_BUFFER)
        .serve_connection(TokioIo::new(PacedStream::new(stream)), service);
    if let Err(error) = connection.await {
        tracing::debug!("a connection ended: {error}");
    }
}

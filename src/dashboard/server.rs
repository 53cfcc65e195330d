//! The server: takes connections, within limits, until a signal ends it.

use super::Token;
use super::access::Hosts;
use super::app::{App, Peer};
use super::feed::Feed;
use super::fleet::FleetThread;
use super::paced_stream::PacedStream;
use super::places::{Place, Places, Stage};
use super::relay_thread::{RelayThread, Shared};
use super::routes::router;
use super::strangers::Strangers;
use crate::black_box::place::Place as BoxPlace;
use crate::failure::Failure;
use crate::relay::client::RelayLink;
use crate::relay::wire::Subject;
use crate::topics::Instance;
use axum::Router;
use axum::body::Bytes;
use futures_util::future::{Either, select};
use hyper::body::{Body, Frame, SizeHint};
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::convert::Infallible;
use std::ffi::OsString;
use std::net::TcpListener;
use std::path::PathBuf;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::net::TcpStream;
use worm_estimator::config::Config;

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
    pub(crate) boxes: BoxPlace,
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
    let places = Arc::new(Places::default());
    let app = Arc::new(App {
        relay: RelayThread::start(&settings.instance, link, shared.clone())?,
        fleet: FleetThread::start(&settings.instance, &settings.config.topics.root)?,
        shared,
        token: settings.token,
        strangers: Strangers::new(settings.instance.worm()),
        hosts: Hosts::new(address.ip(), settings.hosts),
        reports: settings.reports,
        boxes: settings.boxes,
        places: Arc::clone(&places),
    });
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(settings.listener).map_err(Failure::failed)?;
        end.set_nonblocking(true).map_err(Failure::failed)?;
        let end = tokio::net::UnixStream::from_std(end).map_err(Failure::failed)?;
        let serve = std::pin::pin!(accept(listener, places, router(app)));
        let ended = std::pin::pin!(end.readable());
        select(serve, ended).await;
        Ok(())
    })
}

/// The body of an answer: when it is sent, its connection waits for the next request.
struct Sent {
    body: axum::body::Body,
    place: Arc<Place>,
}

impl Body for Sent {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

impl Drop for Sent {
    fn drop(&mut self) {
        self.place.enter(Stage::Waiting);
    }
}

async fn accept(listener: tokio::net::TcpListener, places: Arc<Places>, router: Router) {
    loop {
        match listener.accept().await {
            Ok((stream, peer)) => {
                if let Some(place) = places.take(peer.ip()) {
                    tokio::spawn(serve(stream, Peer(peer.ip()), router.clone(), Arc::new(place)));
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

async fn serve(stream: TcpStream, peer: Peer, router: Router, place: Arc<Place>) {
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!("a connection that waits to fill its packets: {error}");
    }
    let inner = TowerToHyperService::new(router);
    let of_requests = Arc::clone(&place);
    let service = service_fn(move |mut request: hyper::Request<hyper::body::Incoming>| {
        let place = Arc::clone(&of_requests);
        place.enter(Stage::Asked);
        request.extensions_mut().insert(peer);
        request.extensions_mut().insert(Arc::clone(&place));
        let answer = inner.call(request);
        async move {
            let answer = answer.await?;
            place.enter(Stage::Answered);
            Ok::<_, Infallible>(answer.map(|body| Sent { body, place }))
        }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIME)
        .max_headers(MAX_HEADERS)
        .max_buf_size(MAX_BUFFER)
        .serve_connection(TokioIo::new(PacedStream::new(stream)), service);
    match select(std::pin::pin!(connection), std::pin::pin!(place.closed())).await {
        Either::Left((Ok(()), _)) => {}
        Either::Left((Err(error), _)) => tracing::debug!("a connection ended: {error}"),
        Either::Right(_) => tracing::debug!("a connection of {} was closed for another", peer.0),
    }
}

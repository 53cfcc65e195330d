//! What can be asked for, and the rules that hold for all of it.

use super::access::Source;
use super::app::App;
use super::assets::{self, Asset};
use super::places::Place;
use super::response::{refused, to_json};
use super::{boxes, commands, events, metrics, reports};
use crate::realtime::monotonic_ns;
use axum::Router;
use axum::body::Body;
use axum::extract::{DefaultBodyLimit, Extension, Path, Request, State};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, ETAG, HOST, HeaderName, IF_NONE_MATCH, ORIGIN,
    REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde_json::json;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::timeout;

/// Largest body of a request, bytes.
const MAX_BODY: usize = 4096;
/// How long an answer may take, apart from a stream of events.
const MAX_TIME: Duration = Duration::from_secs(10);

/// What the page may do: load its own files, and talk to this server.
const POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; \
     frame-ancestors 'none'",
);
/// What a report may do: show itself. Its styles and pictures are inside it; it is of no origin, so no script in it could reach this server.
const REPORT_POLICY: HeaderValue = HeaderValue::from_static(
    "sandbox allow-downloads; default-src 'none'; style-src 'unsafe-inline'; img-src 'self' data:; base-uri 'none'; form-action 'none'; \
     frame-ancestors 'none'",
);
const NO_STORE: HeaderValue = HeaderValue::from_static("no-store");

/// All routes.
pub(super) fn router(app: Arc<App>) -> Router {
    Router::new()
        .route("/", get(async |headers: HeaderMap| asset(&assets::INDEX, &headers)))
        .route(
            "/fleet",
            get(async |headers: HeaderMap| asset(&assets::FLEET, &headers)),
        )
        .route("/assets/{*path}", get(asset_of))
        .route("/api/events", get(event_stream))
        .route("/api/state", get(state))
        .route("/api/health", get(health))
        .route("/api/login", get(commands::login))
        .route("/api/reports", get(list_reports))
        .route("/api/boxes", get(list_boxes))
        .route("/boxes/{name}", get(download_box))
        .route("/api/command/hold", post(commands::hold))
        .route("/api/command/{command}", post(commands::command))
        .route("/api/fleet", get(fleet))
        .route("/api/fleet/hold", post(commands::hold_fleet))
        .route("/api/alive", post(commands::alive))
        .route("/reports/{*path}", get(open_report))
        .route("/metrics", get(metrics_text))
        .fallback(async || {
            refused(
                StatusCode::NOT_FOUND,
                "there is nothing here; docs/dashboard.md says what there is",
            )
        })
        .method_not_allowed_fallback(async || {
            refused(
                StatusCode::METHOD_NOT_ALLOWED,
                "this is not asked for in this way: the header Allow says how",
            )
        })
        .layer(DefaultBodyLimit::max(MAX_BODY))
        .layer(from_fn_with_state(Arc::clone(&app), guard))
        .with_state(app)
}

/// Keeps strangers out, bounds the time, and says what browsers must not do.
async fn guard(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    let refusal = {
        let headers = request.headers();
        let text = |name: HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
        let twice = [HOST, ORIGIN]
            .into_iter()
            .find(|name| headers.get_all(name).iter().nth(1).is_some());
        let twice = twice.map(|name| format!("the request has more than one {name}"));
        twice.or_else(|| {
            app.hosts.refusal(Source {
                host: text(HOST),
                origin: text(ORIGIN),
                site: text(HeaderName::from_static("sec-fetch-site")),
                is_navigation: request.method() == Method::GET
                    && text(HeaderName::from_static("sec-fetch-mode")) == Some("navigate"),
            })
        })
    };
    let mut response = match refusal {
        Some(why) => refused(StatusCode::FORBIDDEN, &why),
        None => timeout(MAX_TIME, next.run(request))
            .await
            .unwrap_or_else(|_| refused(StatusCode::GATEWAY_TIMEOUT, "it takes too long: try again")),
    };
    let headers = response.headers_mut();
    headers.entry(CONTENT_SECURITY_POLICY).or_insert(POLICY);
    headers.entry(CACHE_CONTROL).or_insert(NO_STORE);
    headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(X_FRAME_OPTIONS, HeaderValue::from_static("DENY"));
    headers.insert(REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    let same_origin = HeaderValue::from_static("same-origin");
    headers.insert(
        HeaderName::from_static("cross-origin-resource-policy"),
        same_origin.clone(),
    );
    headers.insert(HeaderName::from_static("cross-origin-opener-policy"), same_origin);
    response
}

async fn asset_of(Path(path): Path<String>, headers: HeaderMap) -> Response {
    match assets::find(&path) {
        Some(found) => asset(found, &headers),
        None => refused(StatusCode::NOT_FOUND, "there is no such file"),
    }
}

/// A file of the page. A browser keeps it, and asks each time whether it is still the same.
fn asset(asset: &Asset, headers: &HeaderMap) -> Response {
    let tag = asset.tag();
    let is_known = headers
        .get(IF_NONE_MATCH)
        .is_some_and(|known| known.as_bytes() == tag.as_bytes());
    let head = [
        (CONTENT_TYPE, asset.content_type.to_owned()),
        (CACHE_CONTROL, "no-cache".to_owned()),
        (ETAG, tag),
    ];
    match is_known {
        true => (StatusCode::NOT_MODIFIED, head).into_response(),
        false => (head, asset.text).into_response(),
    }
}

async fn event_stream(State(app): State<Arc<App>>, Extension(place): Extension<Arc<Place>>) -> Response {
    if let Err(why) = place.begin_stream() {
        return refused(StatusCode::SERVICE_UNAVAILABLE, &why);
    }
    let head = [
        (CONTENT_TYPE, "text/event-stream"),
        // A proxy that collects what is sent would make it old.
        (HeaderName::from_static("x-accel-buffering"), "no"),
    ];
    (head, events::body(&app.shared)).into_response()
}

async fn state(State(app): State<Arc<App>>) -> Response {
    let feed = app.shared.feed();
    match feed.state_json(monotonic_ns()) {
        Some(text) => ([(CONTENT_TYPE, "application/json")], text).into_response(),
        None => {
            let problem = feed.connection().problem.as_deref();
            refused(
                StatusCode::SERVICE_UNAVAILABLE,
                problem.unwrap_or("nothing was heard of the worm yet"),
            )
        }
    }
}

async fn health(State(app): State<Arc<App>>) -> Response {
    let now_ns = monotonic_ns();
    let feed = app.shared.feed();
    let worm = match feed.ages(now_ns).state {
        _ if feed.is_live(now_ns) => "live",
        Some(_) => "stale",
        None => "absent",
    };
    let health = json!({
        "wormd": env!("CARGO_PKG_VERSION"),
        "worm": worm,
        "name": feed.picture.subject.name,
        "state_age_ms": feed.ages(now_ns).state,
        "relay": feed.connection(),
        "pages": app.places.streams(),
    });
    to_json(StatusCode::OK, &health)
}

async fn fleet(State(app): State<Arc<App>>) -> Response {
    to_json(StatusCode::OK, &json!({ "worms": app.fleet.look().await }))
}

async fn metrics_text(State(app): State<Arc<App>>) -> Response {
    let pages = app.places.streams();
    let text = metrics::text(&app.shared.feed(), monotonic_ns(), pages);
    ([(CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text).into_response()
}

async fn list_reports(State(app): State<Arc<App>>) -> Response {
    let Some(root) = app.reports.clone() else {
        return to_json(StatusCode::OK, &json!({ "folder": null, "reports": [] }));
    };
    let folder = root.display().to_string();
    match in_background(move || reports::list(&root)).await {
        Ok(reports) => to_json(StatusCode::OK, &json!({ "folder": folder, "reports": reports })),
        Err(why) => refused(StatusCode::INTERNAL_SERVER_ERROR, &format!("{folder}: {why}")),
    }
}

async fn open_report(State(app): State<Arc<App>>, Path(wanted): Path<String>) -> Response {
    let Some(root) = app.reports.clone() else {
        return refused(StatusCode::NOT_FOUND, "the dashboard was started without --reports");
    };
    match in_background(move || reports::open(&root, &wanted)).await {
        Ok(Some(file)) => {
            let mut response = ([(CONTENT_TYPE, file.content_type)], Body::from(file.bytes)).into_response();
            response.headers_mut().insert(CONTENT_SECURITY_POLICY, REPORT_POLICY);
            response
        }
        Ok(None) => refused(StatusCode::NOT_FOUND, "there is no such report"),
        Err(why) => refused(StatusCode::INTERNAL_SERVER_ERROR, &why),
    }
}

async fn list_boxes(State(app): State<Arc<App>>) -> Response {
    let place = app.boxes.clone();
    let list = move || {
        let folder = place.folder();
        let boxes = match folder.path().exists() {
            true => folder.boxes().map_err(std::io::Error::other)?,
            // Where no black box has ever been there is no folder, which is no error of the page.
            false => Vec::new(),
        };
        Ok((folder.path().display().to_string(), boxes))
    };
    match in_background(list).await {
        Ok((folder, boxes)) => to_json(StatusCode::OK, &json!({ "folder": folder, "boxes": boxes })),
        Err(why) => refused(StatusCode::INTERNAL_SERVER_ERROR, &why),
    }
}

async fn download_box(State(app): State<Arc<App>>, Path(wanted): Path<String>, headers: HeaderMap) -> Response {
    let place = app.boxes.clone();
    match in_background(move || boxes::open(&place.folder(), &wanted)).await {
        Ok(Some(file)) => file.answer(&headers),
        Ok(None) => refused(
            StatusCode::NOT_FOUND,
            "there is no such box, or it is still being written",
        ),
        Err(why) => refused(StatusCode::INTERNAL_SERVER_ERROR, &why),
    }
}

/// Disks may be slow: the pages do not wait for them.
async fn in_background<T: Send + 'static>(
    work: impl FnOnce() -> std::io::Result<T> + Send + 'static,
) -> Result<T, String> {
    match tokio::task::spawn_blocking(work).await {
        Ok(outcome) => outcome.map_err(|error| error.to_string()),
        Err(error) => Err(error.to_string()),
    }
}

//! Commands of pages. Anyone may make the worm hold, with no more than a request; all else needs the token, and most of it the wheel.

use super::access::bearer;
use super::app::{App, Peer};
use super::caller::{Asked, Caller};
use super::fleet_view::Held;
use super::response::{refused, to_json};
use crate::realtime::monotonic_ns;
use crate::relay::wire::{Answer, Request};
use crate::trip::wire::Ask;
use axum::body::{Body, Bytes};
use axum::extract::{Extension, Path, State};
use axum::http::header::{AUTHORIZATION, USER_AGENT, WWW_AUTHENTICATE};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use serde::Deserialize;
use std::sync::Arc;
use std::time::Duration;

/// Tells the pages of one browser apart.
const CLIENT: &str = "x-wormd-client";
/// The name of who uses the page, percent-encoded.
const NAME: &str = "x-wormd-name";
/// When the page asked for it, see [`Asked::read`].
const ASKED: &str = "x-wormd-asked";

/// How much of a body that nobody needs is read, bytes, and for how long.
const MAX_FORGOTTEN: usize = 1 << 20;
const FORGET_TIME: Duration = Duration::from_millis(200);

/// The commands that there are.
const COMMANDS: &str =
    "hold, crawl, stop, reset, arm, drive, take_over, acknowledge, trip_pause, trip_resume, trip_return";

/// What may be in the body of a command.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Details {
    /// For `crawl`: gait cycles per second, negative for backward.
    cycles_per_s: Option<f64>,
    /// For `acknowledge`: which alarms; without it all.
    #[serde(default)]
    alarms: Vec<String>,
}

/// `POST /api/command/hold`. Whatever else is in the request: nothing keeps anybody from this.
pub(super) async fn hold(
    State(app): State<Arc<App>>,
    Extension(peer): Extension<Peer>,
    headers: HeaderMap,
    body: Body,
) -> Response {
    let answer = app.relay.anyone(caller(peer, &headers), Request::Hold).await;
    forget(body).await;
    answered(answer)
}

/// Reads and drops a body, within limits: an answer beside bytes that nobody has read may not arrive.
async fn forget(body: Body) {
    let mut pieces = body.into_data_stream();
    let mut room = MAX_FORGOTTEN;
    let read = async {
        while let Some(Ok(piece)) = pieces.next().await {
            match room.checked_sub(piece.len()) {
                Some(left) => room = left,
                None => break,
            }
        }
    };
    // What has not come by then is not waited for.
    let _ = tokio::time::timeout(FORGET_TIME, read).await;
}

/// `POST /api/command/{command}`, other than `hold`.
pub(super) async fn command(
    State(app): State<Arc<App>>,
    Extension(peer): Extension<Peer>,
    Path(command): Path<String>,
    headers: HeaderMap,
    body: Bytes,
) -> Response {
    let caller = caller(peer, &headers);
    if let Err(why) = authorised(&app, &headers) {
        app.strangers.note(&caller, &command, why);
        return unauthorised(why);
    }
    if let Err(why) = asked(&headers) {
        return refused(StatusCode::BAD_REQUEST, &why);
    }
    let details = if body.is_empty() {
        Details::default()
    } else {
        match details_of(&body) {
            Ok(details) => details,
            Err(error) => {
                let why = format!("the body is no JSON object with cycles_per_s or alarms: {error}");
                return refused(StatusCode::BAD_REQUEST, &why);
            }
        }
    };
    // As everywhere else: a crawl that stands still would be taken for one.
    if command == "crawl" && details.cycles_per_s == Some(0.0) {
        let why = "cycles_per_s 0 is no speed: give gait cycles per second other than 0; hold stands still";
        return refused(StatusCode::BAD_REQUEST, why);
    }
    let Some(request) = request(&command, details) else {
        return refused(
            StatusCode::NOT_FOUND,
            &format!("there is no such command: there are {COMMANDS}"),
        );
    };
    // The connection looks meanwhile whether its client is still there. Where that has gone, the request ends here.
    tokio::task::yield_now().await;
    let answer = match request {
        Request::Acknowledge { .. } => app.relay.anyone(caller, request).await,
        _ => app.relay.drive(caller, request).await,
    };
    answered(answer)
}

/// `POST /api/fleet/hold`: all worms hold. As for one of them, nothing is needed for it.
pub(super) async fn hold_fleet(
    State(app): State<Arc<App>>,
    Extension(peer): Extension<Peer>,
    headers: HeaderMap,
    body: Body,
) -> Response {
    let held = app.fleet.hold(caller(peer, &headers)).await;
    forget(body).await;
    let status = match held.iter().all(Held::is_answered) {
        true => StatusCode::OK,
        false => StatusCode::SERVICE_UNAVAILABLE,
    };
    to_json(status, &serde_json::json!({ "worms": held }))
}

/// `POST /api/alive`: the page that drives is there.
pub(super) async fn alive(
    State(app): State<Arc<App>>,
    Extension(peer): Extension<Peer>,
    headers: HeaderMap,
) -> Response {
    if let Err(why) = authorised(&app, &headers) {
        return unauthorised(why);
    }
    if let Err(why) = asked(&headers) {
        return refused(StatusCode::BAD_REQUEST, &why);
    }
    match app.relay.alive(caller(peer, &headers)).await {
        true => StatusCode::NO_CONTENT.into_response(),
        false => refused(StatusCode::CONFLICT, "this page does not drive: give a command first"),
    }
}

/// `GET /api/login`: whether the token is right. Changes nothing.
pub(super) async fn login(
    State(app): State<Arc<App>>,
    Extension(peer): Extension<Peer>,
    headers: HeaderMap,
) -> Response {
    match authorised(&app, &headers) {
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(why) => {
            app.strangers.note(&caller(peer, &headers), "login", why);
            unauthorised(why)
        }
    }
}

/// A list would be taken for the fields in their order.
fn details_of(body: &[u8]) -> Result<Details, serde_json::Error> {
    let object: serde_json::Map<String, serde_json::Value> = serde_json::from_slice(body)?;
    serde_json::from_value(object.into())
}

fn request(command: &str, details: Details) -> Option<Request> {
    Some(match command {
        "crawl" => Request::Crawl {
            cycles_per_s: details.cycles_per_s,
        },
        "stop" => Request::Stop,
        "reset" => Request::Reset,
        "arm" => Request::Arm,
        "drive" => Request::Drive,
        "take_over" | "take-over" => Request::TakeOver,
        "acknowledge" => Request::Acknowledge { alarms: details.alarms },
        "trip_pause" => Request::Trip { action: Ask::Pause },
        "trip_resume" => Request::Trip { action: Ask::Resume },
        "trip_return" => Request::Trip { action: Ask::Return },
        _ => return None,
    })
}

/// Whether the token is there and right; else why not, in words.
fn authorised(app: &App, headers: &HeaderMap) -> Result<(), &'static str> {
    let token = headers
        .get(AUTHORIZATION)
        .and_then(|header| header.to_str().ok())
        .and_then(bearer);
    match token {
        Some(token) if app.token.is(token) => Ok(()),
        Some(_) => Err("the token is wrong: it is the one with which the dashboard was started"),
        None => Err("this needs the token, as Authorization: Bearer TOKEN (hold needs none)"),
    }
}

fn unauthorised(why: &str) -> Response {
    let mut refusal = refused(StatusCode::UNAUTHORIZED, why);
    refusal
        .headers_mut()
        .insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    refusal
}

fn caller(Peer(address): Peer, headers: &HeaderMap) -> Caller {
    let text = |name: &str| text(headers, name);
    // Nothing keeps anybody from a hold, and all else is refused before.
    let asked = asked(headers).unwrap_or_else(|_| Asked::Before(monotonic_ns()));
    Caller::new(address, text(CLIENT), text(NAME), text(USER_AGENT.as_str()), asked)
}

/// When it was asked for.
fn asked(headers: &HeaderMap) -> Result<Asked, String> {
    Asked::read(text(headers, ASKED), monotonic_ns())
}

fn text<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

/// The relay's answer, with the status that fits.
fn answered(answer: Result<Answer, String>) -> Response {
    let answer = match answer {
        Ok(answer) => answer,
        Err(problem) => return refused(StatusCode::SERVICE_UNAVAILABLE, &problem),
    };
    to_json(status_of(&answer), &answer)
}

fn status_of(answer: &Answer) -> StatusCode {
    match answer.verdict.as_str() {
        _ if answer.refusal.is_none() => StatusCode::OK,
        "not-driver" => StatusCode::CONFLICT,
        "unusable" => StatusCode::BAD_REQUEST,
        "busy" => StatusCode::SERVICE_UNAVAILABLE,
        "no-answer" | "stale" => StatusCode::GATEWAY_TIMEOUT,
        // The controller's own: the worm stands in the way of it, and not another driver.
        _ => StatusCode::UNPROCESSABLE_ENTITY,
    }
}

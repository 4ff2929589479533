//! What the page can ask the server, and the limits of every request.

use super::action::Action;
use super::guard::{Guard, seal};
use super::live::Place;
use super::session::Session;
use super::{assets, upload};
use crate::report::page;
use crate::text::error::Kind;
use axum::body::{Body, Bytes};
use axum::extract::{Path, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post, put};
use axum::{Json, Router};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::sync::Arc;
use std::time::Duration;

/// The largest body of a request that is no log.
const LARGEST_BODY: usize = 64 * 1024;
/// So long may such a body take to come.
const SLOWEST_BODY: Duration = Duration::from_secs(10);
/// A page that asks for news is answered after this time at the latest.
const PATIENCE: Duration = Duration::from_secs(25);

/// All routes, behind the guard.
pub(super) fn routes(session: Arc<Session>, guard: Guard) -> Router {
    Router::new()
        .route("/", get(|| async { asset(Path(String::new())).await }))
        .route("/lab/{name}", get(asset))
        .route("/api/state/{seen}", get(state))
        .route("/api/view/{key}", get(view))
        .route("/api/draft", get(draft))
        .route("/api/overview/{log}/{from}/{to}", get(overview))
        .route("/api/do", post(act))
        .route("/api/live", get(live).post(look).delete(leave))
        .route("/api/log/{name}", put(log))
        .route("/api/download/{what}", get(download))
        .fallback(|| async { refusal(StatusCode::NOT_FOUND, "there is nothing here") })
        .with_state(session)
        .layer(from_fn_with_state(guard, guarded))
}

async fn guarded(State(guard): State<Guard>, request: Request, next: Next) -> Response {
    let mut response = match guard.check(request.uri().path(), request.headers()) {
        Ok(()) => next.run(request).await,
        Err((code, sentence)) => refusal(code, sentence),
    };
    seal(response.headers_mut());
    response
}

fn refusal(code: StatusCode, sentence: &str) -> Response {
    (code, Json(json!({ "sentence": sentence }))).into_response()
}

/// What was asked for, or an error: its sentence, and whose fault it is.
fn answer(result: crate::Result<impl Serialize>) -> Response {
    let error = match result {
        Ok(answer) => return Json(answer).into_response(),
        Err(error) => error,
    };
    let code = match error.kind {
        Kind::Usage => StatusCode::CONFLICT,
        Kind::Data => StatusCode::UNPROCESSABLE_ENTITY,
        Kind::Failed | Kind::Found => StatusCode::INTERNAL_SERVER_ERROR,
    };
    refusal(code, &error.sentence)
}

/// The answer of what takes a while, made in a thread of its own; `lost` is said where that ends.
async fn apart<T: Serialize + Send + 'static>(
    make: impl FnOnce() -> crate::Result<T> + Send + 'static,
    lost: &str,
) -> Response {
    match tokio::task::spawn_blocking(make).await {
        Ok(made) => answer(made),
        Err(_) => refusal(StatusCode::INTERNAL_SERVER_ERROR, lost),
    }
}

async fn asset(Path(name): Path<String>) -> Response {
    match assets::asset(&name) {
        Some(asset) => typed(asset.kind, asset.text),
        None => refusal(StatusCode::NOT_FOUND, "there is no such file"),
    }
}

fn typed(kind: &'static str, body: impl Into<Body>) -> Response {
    (
        [(header::CONTENT_TYPE, HeaderValue::from_static(kind))],
        body.into(),
    )
        .into_response()
}

/// The state, when it is no longer the one that the page has seen.
async fn state(State(session): State<Arc<Session>>, Path(seen): Path<u64>) -> Response {
    session.newer_than(seen, PATIENCE).await;
    Json(session.told()).into_response()
}

async fn view(State(session): State<Arc<Session>>, Path(key): Path<u64>) -> Response {
    let found = session.state().views.iter().find(|v| v.key == key).cloned();
    match found {
        Some(view) => typed(
            "application/json",
            Bytes::from(view.json.as_bytes().to_vec()),
        ),
        None => refusal(StatusCode::NOT_FOUND, "this page is no longer kept"),
    }
}

/// Some rows of a long log, thinned.
async fn overview(
    State(session): State<Arc<Session>>,
    Path((log, from, to)): Path<(usize, usize, usize)>,
) -> Response {
    let Some(long) = session.state().long.clone() else {
        return refusal(StatusCode::NOT_FOUND, "no long log is open");
    };
    let thinned = move || long.thinned(log, from, to);
    apart(thinned, "the log could not be read; read it again").await
}

async fn draft(State(session): State<Arc<Session>>) -> Response {
    // It may have become a study since the page heard of it.
    Json(session.state().draft.as_deref()).into_response()
}

/// What a request asks for in JSON, or how it is refused.
async fn asked<T: DeserializeOwned>(
    headers: &HeaderMap,
    body: Body,
) -> Result<T, (StatusCode, String)> {
    let json = headers.get(header::CONTENT_TYPE).map(HeaderValue::as_bytes);
    let refused = |code, why: &str| Err((code, why.to_string()));
    if json != Some(b"application/json") {
        let code = StatusCode::UNSUPPORTED_MEDIA_TYPE;
        return refused(code, "an action is application/json");
    }
    let whole = axum::body::to_bytes(body, LARGEST_BODY);
    let body = match tokio::time::timeout(SLOWEST_BODY, whole).await {
        Err(_) => return refused(StatusCode::REQUEST_TIMEOUT, "the action came too slowly"),
        Ok(Err(_)) => return refused(StatusCode::PAYLOAD_TOO_LARGE, "the action is too large"),
        Ok(Ok(body)) => body,
    };
    serde_json::from_slice(&body)
        .map_err(|e| (StatusCode::BAD_REQUEST, format!("this is no action: {e}")))
}

async fn act(State(session): State<Arc<Session>>, headers: HeaderMap, body: Body) -> Response {
    let action: Action = match asked(&headers, body).await {
        Ok(action) => action,
        Err((code, why)) => return refusal(code, &why),
    };
    answer(session.act(action).map(|()| json!({})))
}

/// Looks at a device.
async fn look(State(session): State<Arc<Session>>, headers: HeaderMap, body: Body) -> Response {
    let place: Place = match asked(&headers, body).await {
        Ok(place) => place,
        Err((code, why)) => return refusal(code, &why),
    };
    let live = Arc::clone(&session.live);
    let connected = move || live.connect(place).map(|()| json!({}));
    apart(connected, "the line could not be opened; try it again").await
}

async fn leave(State(session): State<Arc<Session>>) -> Response {
    session.live.leave();
    Json(json!({})).into_response()
}

/// What the device that is looked at says, as server-sent events.
async fn live(State(session): State<Arc<Session>>) -> Response {
    typed("text/event-stream", Body::new(session.live.events()))
}

async fn log(
    State(session): State<Arc<Session>>,
    Path(name): Path<String>,
    body: Body,
) -> Response {
    let taken = match session.takes_logs() {
        Ok(folder) => upload::take(&folder, &name, body).await,
        Err(e) => Err(e),
    };
    answer(taken.map(|name| {
        session.add_log(name);
        json!({})
    }))
}

/// A file for the user to keep.
async fn download(State(session): State<Arc<Session>>, Path(what): Path<String>) -> Response {
    let (folder, current, blob, view) = {
        let state = session.state();
        let current = state.current.map(|at| state.models[at].clone());
        (
            state.folder.clone(),
            current,
            state.blob.clone(),
            state.view().cloned(),
        )
    };
    let stem = current.as_ref().map_or_else(String::new, |m| m.stem());
    let file = |path: &str, ending: &str| {
        let bytes = std::fs::read(folder.path.join(path)).ok()?;
        Some((format!("{stem}.{ending}"), bytes))
    };
    let found = match what.as_str() {
        "report" => view
            .and_then(|v| report(&v.json))
            .map(|page| ("report.html".into(), page)),
        "model" => current.and_then(|m| file(&m.file, "json")),
        "blob" => blob.and_then(|(blob, _)| file(&blob, "bin")),
        _ => None,
    };
    let Some((name, bytes)) = found else {
        return refusal(
            StatusCode::NOT_FOUND,
            "there is nothing to download under this name",
        );
    };
    let attached = format!("attachment; filename=\"{}\"", name.replace(['"', '\\'], ""));
    let mut response = typed("application/octet-stream", bytes);
    if let Ok(value) = HeaderValue::from_str(&attached) {
        response
            .headers_mut()
            .insert(header::CONTENT_DISPOSITION, value);
    }
    response
}

/// What is drawn now, as the file that `--report` writes.
fn report(contents: &str) -> Option<Vec<u8>> {
    #[derive(Deserialize)]
    struct Heading {
        title: String,
        answer: String,
    }
    let heading: Heading = serde_json::from_str(contents).ok()?;
    Some(page::document(&heading.title, &heading.answer, contents).into_bytes())
}

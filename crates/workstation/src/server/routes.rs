//! The table of routes. All of it passes the guard; all data bear `no-store`.

use crate::edit::Way;
use crate::navigation::follow;
use crate::server::app::App;
use crate::server::doors::Guest;
use crate::server::guard::{Refusal, RequestOrigin, admit, needs_key};
use crate::server::link;
use crate::{Error, open};
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::{ConnectInfo, DefaultBodyLimit, Path, Query, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use include_dir::{Dir, include_dir};
use serde::Deserialize;
use serde_json::json;
use supine_flow::NodeId;

static PAGE: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/page");
/// A request says no more than this, bytes.
const MOST: usize = 1 << 16;
/// Strokes of a brush are long, bytes.
const MOST_EDIT: usize = 1 << 22;
/// The page loads nothing but its own files, and stands in no other.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

pub(crate) fn router(app: App) -> Router {
    Router::new()
        .route("/api/state", get(state))
        .route("/api/link", get(link::link))
        .route("/api/list", get(list))
        .route("/api/inspect", post(inspect))
        .route("/api/open", post(open_it))
        .route("/api/edit", post(edit).layer(DefaultBodyLimit::max(MOST_EDIT)))
        .route("/api/carry", post(carry))
        .route("/api/tumour", post(tumour))
        .route("/api/undo", post(undo))
        .route("/api/redo", post(redo))
        .route("/api/save", post(save))
        .route("/api/discard", post(discard))
        .route("/api/run", post(run))
        .route("/api/cancel", post(cancel))
        .route("/api/dismiss", post(dismiss))
        .route("/api/tick", post(tick))
        .route("/api/send", post(send))
        .route("/api/follow", post(follow_it))
        .route("/api/leave", post(leave))
        .route("/api/log", get(log))
        .route("/api/volume/{id}/{key}", get(volume))
        .route("/api/surface/{part}/{key}", get(surface))
        .route("/api/lines/{volume}/{key}/{view}/{slice}", get(lines))
        .route("/api/picture/{id}", get(picture))
        .route("/api/whose/{id}", get(whose))
        .fallback(get(file))
        .layer(DefaultBodyLimit::max(MOST))
        .layer(from_fn_with_state(app.clone(), guard))
        .with_state(app)
}

/// Lets through what may pass, and adds what every answer bears.
async fn guard(State(app): State<App>, request: Request, next: Next) -> Response {
    let admitted = admit(&asked(&request), &app.token);
    let guest = request.extensions().get::<ConnectInfo<Guest>>();
    // What is admitted there bears the key.
    if let (Ok(()), true, Some(ConnectInfo(guest))) =
        (&admitted, needs_key(request.uri().path()), guest)
    {
        guest.let_in();
    }
    let mut answer = match admitted {
        Ok(()) => next.run(request).await,
        Err(Refusal::Token) => {
            refused(StatusCode::UNAUTHORIZED, "the key of this page is not valid")
        }
        Err(_) => refused(StatusCode::FORBIDDEN, "this does not come from the page"),
    };
    for (name, value) in [
        ("content-security-policy", POLICY),
        ("x-content-type-options", "nosniff"),
        ("cross-origin-opener-policy", "same-origin"),
        ("cross-origin-resource-policy", "same-origin"),
        ("referrer-policy", "no-referrer"),
        ("cache-control", "no-store"),
    ] {
        answer.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    answer
}

/// What a request says of where it comes from.
fn asked(request: &Request) -> RequestOrigin<'_> {
    let text = |name: &str| request.headers().get(name).and_then(|value| value.to_str().ok());
    RequestOrigin {
        path: request.uri().path(),
        host: text("host"),
        origin: text("origin"),
        site: text("sec-fetch-site"),
        authorization: text("authorization"),
    }
}

fn refused(status: StatusCode, message: &str) -> Response {
    (status, axum::Json(json!({ "error": { "message": message, "advice": null } }))).into_response()
}

impl IntoResponse for Error {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status()).unwrap_or(StatusCode::BAD_REQUEST);
        refused(status, &self.to_string())
    }
}

/// The answer to what only begins work or changes the state, which the page is told by itself.
type Reply = Result<axum::Json<serde_json::Value>, Error>;

fn told(done: Result<(), Error>) -> Reply {
    done.map(|()| axum::Json(json!({})))
}

fn read<'a, T: Deserialize<'a>>(body: &'a Bytes) -> Result<T, Error> {
    serde_json::from_slice(body).map_err(|e| Error::Request(e.to_string()))
}

async fn state(State(app): State<App>) -> Response {
    let text = app.workspace.watched().borrow().to_string();
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Folder {
    dir: Option<String>,
}

async fn list(
    State(app): State<App>,
    Query(asked): Query<Folder>,
) -> Result<axum::Json<crate::roots::Listing>, Error> {
    app.workspace.list(asked.dir.as_deref()).map(axum::Json)
}

async fn inspect(State(app): State<App>, body: Bytes) -> Reply {
    let asked: Folder = read(&body)?;
    told(app.workspace.inspect(asked.dir.as_deref().unwrap_or("0")))
}

async fn open_it(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.open(&read::<open::OpenRequest>(&body)?))
}

async fn edit(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.edit_sent(read(&body)?))
}

async fn carry(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.carry(&read(&body)?))
}

async fn tumour(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.tumour_of(&read(&body)?))
}

async fn undo(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.history(read(&body)?, Way::Back))
}

async fn redo(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.history(read(&body)?, Way::Forth))
}

async fn save(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.save_as(&read(&body)?))
}

async fn discard(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.discard(&read(&body)?))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Run {
    /// The last stage; without, up to the deformed CT and how sure the tumour's place is.
    until: Option<String>,
    /// Where a whole run is written.
    out: Option<Out>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Out {
    dir: String,
    name: String,
}

async fn run(State(app): State<App>, body: Bytes) -> Reply {
    let Run { until, out } = read(&body)?;
    if let Some(Out { dir, name }) = out {
        return told(app.workspace.run_into(&dir, &name));
    }
    let node = |name: String| {
        let node = NodeId::of_name(&name);
        node.ok_or_else(|| Error::Request(format!("there is no stage {name:?}")))
    };
    told(app.workspace.run(until.map(node).transpose()?))
}

async fn cancel(State(app): State<App>) -> Reply {
    app.workspace.cancel();
    told(Ok(()))
}

async fn dismiss(State(app): State<App>) -> Reply {
    app.workspace.change(|held| held.state.problem = None);
    told(Ok(()))
}

async fn tick(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.tick(&read(&body)?))
}

async fn send(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.send(read(&body)?))
}

async fn follow_it(State(app): State<App>, body: Bytes) -> Reply {
    told(app.workspace.follow(&read::<follow::FollowRequest>(&body)?))
}

async fn leave(State(app): State<App>) -> Reply {
    app.workspace.leave();
    told(Ok(()))
}

async fn log(State(app): State<App>) -> axum::Json<serde_json::Value> {
    axum::Json(json!({ "lines": app.workspace.log() }))
}

/// The answer to a key that holds no longer: the page asked in the moment in which something newer
/// came, which is no failure. It then asks for the state.
fn passed() -> Response {
    StatusCode::NO_CONTENT.into_response()
}

async fn volume(State(app): State<App>, Path((id, key)): Path<(String, String)>) -> Response {
    let Some(voxels) = app.workspace.voxels(&id, &key) else {
        return passed();
    };
    let length = voxels.len();
    let pieces = voxels.pieces().map(Ok::<_, std::convert::Infallible>);
    let body = Body::from_stream(futures_util::stream::iter(pieces));
    let mut headers = HeaderMap::new();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/octet-stream"));
    headers.insert(header::CONTENT_LENGTH, HeaderValue::from(length));
    (headers, body).into_response()
}

async fn surface(State(app): State<App>, Path((part, key)): Path<(String, String)>) -> Response {
    match app.workspace.surface(&part, &key) {
        Some(bytes) => {
            ([(header::CONTENT_TYPE, "application/octet-stream")], bytes).into_response()
        }
        None => passed(),
    }
}

async fn lines(
    State(app): State<App>,
    Path((volume, key, view, slice)): Path<(String, String, String, usize)>,
) -> Result<Response, Error> {
    let work = move || app.workspace.lines(&volume, &key, (&view, slice));
    let lines = tokio::task::spawn_blocking(work).await.map_err(|_| Error::Broken)?;
    Ok(match lines {
        Some(lines) => axum::Json(json!({ "lines": lines })).into_response(),
        None => passed(),
    })
}

async fn picture(State(app): State<App>, Path(id): Path<String>) -> Result<Response, Error> {
    let work = move || app.workspace.picture(&id);
    let png = tokio::task::spawn_blocking(work).await.map_err(|_| Error::Broken)??;
    Ok(([(header::CONTENT_TYPE, "image/png")], png).into_response())
}

async fn whose(State(app): State<App>, Path(id): Path<String>) -> Reply {
    let work = move || app.workspace.whose(&id);
    let line = tokio::task::spawn_blocking(work).await.map_err(|_| Error::Broken)??;
    Ok(axum::Json(json!({ "whose": line })))
}

/// A file of the page itself.
async fn file(request: Request) -> Response {
    let path = request.uri().path().trim_start_matches('/');
    let path = if path.is_empty() { "index.html" } else { path };
    let kind = match path.rsplit_once('.').map(|(_, kind)| kind) {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("svg") => "image/svg+xml",
        _ => "application/octet-stream",
    };
    match PAGE.get_file(path) {
        Some(file) => ([(header::CONTENT_TYPE, kind)], file.contents()).into_response(),
        None => refused(StatusCode::NOT_FOUND, "there is no such page"),
    }
}

//! The table of routes. All of it passes the guard; all data bear `no-store`.

use crate::Error;
use crate::navigation::follow;
use crate::roots::Listing;
use crate::server::app::App;
use crate::server::doors::Guest;
use crate::server::guard::{Refusal, RequestOrigin, admit, needs_key};
use crate::server::link;
use crate::store::case::Change;
use crate::workers::{carry, edit, patient, picture, run, send};
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::{ConnectInfo, DefaultBodyLimit, Path, Query, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{MethodRouter, get, post};
use include_dir::{Dir, include_dir};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
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
    let long = DefaultBodyLimit::max(MOST_EDIT);
    Router::new()
        .route("/api/state", get(state))
        .route("/api/link", get(link::link))
        .route("/api/list", get(list))
        .route("/api/inspect", act(|app, asked: Folder| app.opener.inspect(asked.dir())))
        .route("/api/open", act(|app, asked| app.opener.open(&asked)))
        .route("/api/edit", act(|app, asked| edit::edit(&app.live, asked)).layer(long))
        .route("/api/carry", act(|app, asked| carry::carry(&app.live, &asked)))
        .route("/api/tumour", act(|app, asked| carry::tumour_of(&app.live, &asked)))
        .route(
            "/api/undo",
            act(|app, seen: Seen| edit::change(&app.live, seen.revision, Change::Undo)),
        )
        .route(
            "/api/redo",
            act(|app, seen: Seen| edit::change(&app.live, seen.revision, Change::Redo)),
        )
        .route("/api/save", act(save))
        .route("/api/discard", act(discard))
        .route("/api/run", act(begin_run))
        .route("/api/cancel", plain(|app| app.workspace.look(|store| store.work.cancel())))
        .route("/api/dismiss", plain(|app| app.workspace.change(|store| store.work.dismiss())))
        .route("/api/tick", act(|app, asked| edit::tick(&app.live, asked)))
        .route("/api/send", act(|app, asked| send::send(&app.jobs, &asked)))
        .route("/api/follow", act(begin_following))
        .route("/api/leave", plain(|app| app.following.leave()))
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

/// A route that begins work or changes what is open. The answer is empty, for the page is told of
/// it by itself.
fn act<T: DeserializeOwned + Send + 'static>(
    act: fn(&App, T) -> Result<(), Error>,
) -> MethodRouter<App> {
    post(move |State(app): State<App>, body: Bytes| async move {
        let asked = serde_json::from_slice(&body).map_err(|e| Error::Request(e.to_string()))?;
        act(&app, asked).map(|()| axum::Json(json!({})))
    })
}

/// The same of a request that says nothing.
fn plain(act: fn(&App)) -> MethodRouter<App> {
    post(move |State(app): State<App>| async move {
        act(&app);
        axum::Json(json!({}))
    })
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

impl Folder {
    /// The number of the root where there is none.
    fn dir(&self) -> &str {
        self.dir.as_deref().unwrap_or("0")
    }
}

async fn list(
    State(app): State<App>,
    Query(asked): Query<Folder>,
) -> Result<axum::Json<Listing>, Error> {
    app.workspace.change(|store| store.list(asked.dir())).map(axum::Json)
}

/// The state that a page saw when it asked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Seen {
    revision: u64,
}

/// A name in a folder: of a new case file, or of the folder of a run.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Place {
    dir: String,
    name: String,
}

fn save(app: &App, Place { dir, name }: Place) -> Result<(), Error> {
    if !name.ends_with(".toml") {
        return Err(Error::Request("a case file's name ends with .toml".into()));
    }
    app.workspace.change(|store| store.save_as(&dir, &name))
}

/// Something that is offered.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Discard {
    id: String,
}

fn discard(app: &App, Discard { id }: Discard) -> Result<(), Error> {
    app.workspace.change(|store| store.discard(&id))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Run {
    /// The last stage; without, up to the deformed CT and how sure the tumour's place is.
    until: Option<String>,
    /// Where a whole run is written.
    out: Option<Place>,
}

fn begin_run(app: &App, Run { until, out }: Run) -> Result<(), Error> {
    if let Some(Place { dir, name }) = out {
        return run::run_into(&app.jobs, &dir, &name);
    }
    let node = |name: String| {
        let node = NodeId::of_name(&name);
        node.ok_or_else(|| Error::Request(format!("there is no stage {name:?}")))
    };
    run::run(&app.jobs, until.map(node).transpose()?)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Follow {
    /// `HOST:PORT`.
    address: String,
}

fn begin_following(app: &App, Follow { address }: Follow) -> Result<(), Error> {
    let address = follow::address(&address)?;
    // Looked at until the following has begun: a case that is opened meanwhile leaves it after.
    app.workspace.look(|store| {
        store.case.session()?;
        app.following.follow(address);
        Ok(())
    })
}

async fn log(State(app): State<App>) -> axum::Json<Value> {
    axum::Json(json!({ "lines": app.workspace.look(|store| store.work.log()) }))
}

/// The answer to a key that holds no longer: the page asked in the moment in which something newer
/// came, which is no failure. It then asks for the state.
fn passed() -> Response {
    StatusCode::NO_CONTENT.into_response()
}

async fn volume(State(app): State<App>, Path((id, key)): Path<(String, String)>) -> Response {
    let Some(voxels) = app.workspace.look(|store| store.display.voxels(&id, &key)) else {
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
    match app.workspace.look(|store| store.display.surface(&part, &key)) {
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
    let cuttable = app.workspace.look(|store| store.display.cuttable(&volume, &key));
    let work = move || cuttable.and_then(|cuttable| cuttable.lines(&view, slice));
    let lines = tokio::task::spawn_blocking(work).await.map_err(|_| Error::Broken)?;
    Ok(match lines {
        Some(lines) => axum::Json(json!({ "lines": lines })).into_response(),
        None => passed(),
    })
}

async fn picture(State(app): State<App>, Path(id): Path<String>) -> Result<Response, Error> {
    let work = move || picture::picture(&app.workspace, &id);
    let png = tokio::task::spawn_blocking(work).await.map_err(|_| Error::Broken)??;
    Ok(([(header::CONTENT_TYPE, "image/png")], png).into_response())
}

async fn whose(State(app): State<App>, Path(id): Path<String>) -> Result<axum::Json<Value>, Error> {
    let work = move || patient::patient(&app.workspace, &id);
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

#[cfg(test)]
mod tests {
    use super::PAGE;
    use supine_flow::palette;

    /// A structure has one colour in the report and on the page.
    #[test]
    fn what_the_report_shows_too_has_its_colours() {
        let text = |path: &str| PAGE.get_file(path).and_then(|f| f.contents_utf8()).unwrap();
        let (pen, style) = (text("js/views/pen.js"), text("style.css"));
        for (name, rgb) in [
            ("wall", palette::CHEST_WALL),
            ("skin", palette::SKIN),
            ("region", palette::REGION),
            ("tumour", palette::BEFORE),
            ("simulated", palette::AFTER),
            ("uncertain", palette::UNCERTAIN),
        ] {
            let line = format!("{name}: \"{}\"", palette::hex(rgb));
            assert!(pen.contains(&line), "views/pen.js has another colour than {line}");
        }
        for rgb in [palette::CHEST_WALL, palette::SKIN] {
            assert!(style.contains(&palette::hex(rgb)), "{}", palette::hex(rgb));
        }
    }
}

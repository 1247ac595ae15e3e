//! The socket by which the page is told of each change.

use crate::navigation::follow::Navigation;
use crate::server::app::App;
use crate::server::doors::Guest;
use crate::server::guard::is_same;
use crate::workers::tilt::{Applicator, Frames, PreviewRequest, Table};
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{ConnectInfo, State};
use axum::response::Response;
use serde::Deserialize;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};

/// Between two answers of a navigation: no screen shows more.
const NAVIGATION_EVERY: Duration = Duration::from_micros(33_334);
/// What the page says is short, bytes.
const MOST: usize = 4096;

/// What the page asks for while it is open.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Said {
    /// The live picture of the table.
    Tilt(Table),
    /// The same with an applicator.
    Applicator(Box<Applicator>),
}

#[derive(Deserialize)]
struct First {
    token: String,
}

pub(crate) async fn link(
    State(app): State<App>,
    ConnectInfo(guest): ConnectInfo<Guest>,
    upgrade: WebSocketUpgrade,
) -> Response {
    let upgrade = upgrade.max_message_size(MOST).max_frame_size(MOST);
    upgrade.on_upgrade(move |socket| serve(app, guest, socket))
}

async fn serve(app: App, guest: Guest, mut socket: WebSocket) {
    // Who says nothing is sent away at the door.
    let Some(Ok(Message::Text(text))) = socket.recv().await else { return };
    let known =
        serde_json::from_str(&text).is_ok_and(|first: First| is_same(&first.token, &app.token));
    if !known {
        return;
    }
    guest.let_in();
    app.links.fetch_add(1, Ordering::SeqCst);
    tell(&app, &mut socket).await;
    app.links.fetch_sub(1, Ordering::SeqCst);
}

/// Tells the newest state, the newest of a navigation, and frames of the table, until the page
/// goes. Never more than one is under way: what changes meanwhile is told at once after.
async fn tell(app: &App, socket: &mut WebSocket) {
    let mut states = app.workspace.watched();
    let frames = Frames::new(None);
    let mut pictures = frames.subscribe();
    states.mark_changed();
    let mut navigations = app.following.watched();
    if navigations.borrow().is_on() {
        navigations.mark_changed();
    }
    let mut after = Instant::now();
    loop {
        let message = tokio::select! {
            changed = states.changed() => match changed {
                Ok(()) => {
                    let state = states.borrow_and_update().clone();
                    Some(Message::Text(format!("{{\"state\":{state}}}").into()))
                }
                Err(_) => return,
            },
            _ = pictures.changed() => {
                let frame = pictures.borrow_and_update().clone();
                frame.map(|frame| Message::Binary((*frame).clone().into()))
            }
            newest = newest_after(&mut navigations, after) => match newest {
                Some(navigation) => {
                    after = Instant::now() + NAVIGATION_EVERY;
                    let text = serde_json::to_string(&*navigation).unwrap_or_default();
                    Some(Message::Text(format!("{{\"navigation\":{text}}}").into()))
                }
                None => return,
            },
            said = socket.recv() => match said {
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(Message::Text(text))) => {
                    match serde_json::from_str(&text) {
                        Ok(Said::Tilt(asked)) => app.live.tilt(PreviewRequest::Table(asked), &frames),
                        Ok(Said::Applicator(asked)) => {
                            app.live.tilt(PreviewRequest::Applicator(asked), &frames);
                        }
                        Err(_) => {}
                    }
                    None
                }
                Some(Ok(_)) => None,
            },
        };
        if let Some(message) = message
            && socket.send(message).await.is_err()
        {
            return;
        }
    }
}

/// The newest of a navigation, not before a time; nothing when there will be none.
async fn newest_after(
    navigations: &mut watch::Receiver<Arc<Navigation>>,
    after: Instant,
) -> Option<Arc<Navigation>> {
    sleep_until(after).await;
    navigations.changed().await.ok()?;
    Some(Arc::clone(&navigations.borrow_and_update()))
}

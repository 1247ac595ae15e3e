//! Sending what a run left to an archive.

use crate::Error;
use crate::state::{ResultShown, SentShown};
use crate::workspace::Workspace;
use serde::Deserialize;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use supine_dicom_network::{Call, Node, SendInfo, SendParams, acknowledged};
use supine_flow::Observer;
use supine_flow::commands::{Colour, usable::unusable};
use supine_space::Progress;

/// Longest silence of an archive, and how often it is tried again: as on the command line.
const TIMEOUT: Duration = Duration::from_secs(30);
const RETRIES: u32 = 3;

/// What the page asks for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Send {
    /// `AET@HOST:PORT`.
    to: String,
    /// What the user typed.
    confirm: Option<String>,
}

/// What the user types before a result is sent; nothing where it is green.
pub(crate) fn words(colour: Colour) -> Option<String> {
    match colour {
        Colour::Green => None,
        Colour::Amber => Some("send although amber".into()),
        Colour::Red => Some("send although red".into()),
    }
}

impl Workspace {
    /// Sends the files of the run that is shown.
    ///
    /// # Errors
    /// When no run is shown, the address is none, the words are missing, or work goes on.
    pub(crate) fn send(self: &Arc<Self>, asked: Send) -> Result<(), Error> {
        let Send { to, confirm } = asked;
        let node: Node = to.trim().parse().map_err(Error::Request)?;
        let path = {
            let held = self.held();
            let (Some(ResultShown { confirm: wanted, old: false, .. }), Some(path)) =
                (&held.state.result, &held.result)
            else {
                return Err(Error::NoResult);
            };
            if let Some(words) = wanted.as_ref().filter(|words| confirm.as_ref() != Some(*words)) {
                return Err(Error::Confirm(words.clone()));
            }
            path.clone()
        };
        self.begin("sending", move |workspace, watching| {
            workspace.change(|held| {
                held.state.sent = None;
                let name = crate::names::quoted(&crate::names::name_of(&path));
                held.state.command = format!("supine send {name} --to {node}");
            });
            let before = acknowledged(&path, &node);
            let share = |share: f64| {
                watching.work(share);
                watching.go_on()
            };
            let done = send(&path, &node, Progress::new(&share));
            let (text, ok) = match &done {
                Ok(info) => (told(info), info.broken.is_none() && info.refused.is_empty()),
                Err(error) if error.is_stop() => {
                    let stored = acknowledged(&path, &node).saturating_sub(before);
                    (
                        format!(
                            "cancelled: {stored} objects stored, sending again goes on from there"
                        ),
                        false,
                    )
                }
                Err(error) => (error.to_string(), false),
            };
            let to = node.to_string();
            workspace.change(|held| held.state.sent = Some(SentShown { to, text, ok }));
            done.map(drop)
        })
    }
}

fn send(run: &Path, node: &Node, progress: Progress<'_>) -> Result<SendInfo, Error> {
    let paths = [run.to_path_buf()];
    for found in unusable(&paths)? {
        if found.changed {
            return Err(Error::RunChanged(found.why));
        }
        found.note_override(&node.to_string())?;
    }
    let own = "SUPINE".parse().map_err(Error::Request)?;
    let call = Call { peer: node.clone(), own, tls: None, timeout: TIMEOUT, retries: RETRIES };
    Ok(supine_dicom_network::send(&paths, &call, &SendParams::default(), progress)?)
}

fn told(info: &SendInfo) -> String {
    let mut text = format!("{} objects stored", info.stored);
    if info.present > 0 {
        text += &format!(", {} were there already", info.present);
    }
    if let Some(known) = info.known_in_words() {
        text += &format!(", {known}");
    }
    if let Some(first) = info.warnings.first() {
        text += &format!("; {} with a warning, the first: {first}", info.warnings.len());
    }
    if let Some(first) = info.refused.first() {
        text += &format!("; {} not stored, the first: {}", info.refused.len(), first.reason);
    }
    if let Some(broken) = &info.broken {
        text += &format!("; {broken}: {} left, sending again goes on from there", info.left);
    }
    text
}

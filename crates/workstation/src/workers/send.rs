//! Sending what a run left to an archive.

use crate::Error;
use crate::names::{name_of, quoted};
use crate::store::archives::SentShown;
use crate::workers::jobs::Jobs;
use serde::Deserialize;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use supine_dicom_network::{Call, Node, SendInfo, SendParams, acknowledged};
use supine_flow::Observer;
use supine_flow::commands::usable::unusable;
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

/// Sends the files of the run that is shown.
///
/// # Errors
/// When no run is shown, the address is none, the words are missing, or work goes on.
pub(crate) fn send(jobs: &Arc<Jobs>, asked: &Send) -> Result<(), Error> {
    let node: Node = asked.to.trim().parse().map_err(Error::Request)?;
    let typed = asked.confirm.as_deref();
    let path = jobs.workspace.look(|store| store.results.to_be_sent(typed))?;
    jobs.begin("sending", move |report| {
        report.change(|store| {
            store.archives.set_sent(None);
            let name = quoted(&name_of(&path));
            store.case.set_command(format!("supine send {name} --to {node}"));
        });
        let before = acknowledged(&path, &node);
        let share = |share: f64| {
            report.work(share);
            report.go_on()
        };
        let done = send_run(&path, &node, Progress::new(&share));
        let (text, ok) = match &done {
            Ok(info) => (in_words(info), info.broken.is_none() && info.refused.is_empty()),
            Err(error) if error.is_stop() => {
                let stored = acknowledged(&path, &node).saturating_sub(before);
                let text =
                    format!("cancelled: {stored} objects stored, sending again goes on from there");
                (text, false)
            }
            Err(error) => (error.to_string(), false),
        };
        let sent = SentShown { to: node.to_string(), text, ok };
        report.change(|store| store.archives.set_sent(Some(sent)));
        done.map(drop)
    })
}

fn send_run(run: &Path, node: &Node, progress: Progress<'_>) -> Result<SendInfo, Error> {
    let paths = [run.to_path_buf()];
    for found in unusable(&paths)? {
        if found.changed {
            return Err(Error::RunChanged(found.why));
        }
        found.note_override(&node.to_string())?;
    }
    let (peer, own) = (node.clone(), "SUPINE".parse().map_err(Error::Request)?);
    let call = Call { peer, own, tls: None, timeout: TIMEOUT, retries: RETRIES };
    Ok(supine_dicom_network::send(&paths, &call, &SendParams::default(), progress)?)
}

fn in_words(info: &SendInfo) -> String {
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

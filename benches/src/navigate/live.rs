//! The whole way: from a pose that is sent to the place that is read.

use crate::server::{Hog, Server};
use crate::tissue;
use crate::tracker::{Span, kinds, track, within};
use crate::turnaround::{Turnaround, summary};
use crate::viewer::{Viewer, told};
use anyhow::{Result, bail};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use supine_navigate::Settings;
use supine_navigate::trajectory::Trajectory;

/// A session settles down for so long before its memory is looked at first.
const BEGUN: Duration = Duration::from_secs(5);

/// The mesh of a session.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mesh {
    pub(crate) tetrahedra: usize,
    /// 1 or 2.
    pub(crate) order: u8,
}

/// What goes on beside the tracker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Beside {
    Nothing,
    /// A process that keeps a core busy.
    Hog,
    /// A viewer that is streamed the image.
    Image,
    /// The session is recorded.
    Record(PathBuf),
    /// Nothing, but the applicator presses the tissue instead of being tied to it.
    Pressing,
}

impl Beside {
    pub(crate) fn read(words: &[&str]) -> Result<Self> {
        Ok(match words {
            [] => Self::Nothing,
            ["hog"] => Self::Hog,
            ["image"] => Self::Image,
            ["pressing"] => Self::Pressing,
            ["record", file] => Self::Record(file.into()),
            other => bail!("{other:?} is none of hog, image, pressing and record FILE"),
        })
    }
}

/// Times of a part of the motion, what the session counted, and its memory at the beginning and at
/// the end, MB.
pub(crate) fn measure(
    supine: &Path,
    run: &Path,
    mesh: Mesh,
    span: &Span,
    beside: &Beside,
) -> Result<Value> {
    let settings =
        Settings { tetrahedra: mesh.tetrahedra, order: mesh.order, ..Settings::default() };
    // Before the session begins: a run is open to one at a time.
    let (placed, tetrahedra) = tissue::planned(run, &settings)?;
    let rows = within(&Trajectory::long().entering(&placed), span);
    let mut words: Vec<String> =
        vec!["--tetrahedra".into(), mesh.tetrahedra.to_string(), "--order".into()];
    words.push(mesh.order.to_string());
    if let Beside::Record(file) = beside {
        words.extend(["--record".into(), file.display().to_string()]);
    }
    if *beside == Beside::Pressing {
        words.extend(["--contact".into(), "pressing".into()]);
    }
    let server = Server::start(supine, run, &words)?;
    let turnaround = Turnaround::default();
    let hog = (*beside == Beside::Hog).then(Hog::start).transpose()?;
    let viewer = (*beside == Beside::Image).then(|| Viewer::start(server.address)).transpose()?;
    let over = AtomicBool::new(false);
    let begun_mb = std::thread::scope(|scope| {
        let looking = scope.spawn(|| {
            let until = std::time::Instant::now() + BEGUN;
            while std::time::Instant::now() < until && !over.load(Ordering::SeqCst) {
                std::thread::sleep(Duration::from_millis(50));
            }
            server.memory_mb()
        });
        let tracked = track(server.address, &rows, span, &turnaround);
        over.store(true, Ordering::SeqCst);
        let begun_mb = looking.join().unwrap_or_else(|_| bail!("nobody looked at the memory"));
        tracked.and(begun_mb)
    })?;
    drop(hog);
    let ended_mb = server.memory_mb()?;
    let images = viewer.map(Viewer::end).transpose()?;
    let mut all = summary(turnaround.times_ms());
    all["tetrahedra"] = tetrahedra.into();
    all["rows"] = kinds(&rows);
    all["memory_mb"] = json!([begun_mb, ended_mb]);
    all["session"] = server.end()?;
    if let Some(came) = images {
        let (rate, times_ms) = told(&came, &turnaround);
        all["images"] = summary(times_ms);
        all["images"]["rate"] = rate.into();
    }
    Ok(all)
}

//! What goes on beside the work that was asked for: labels that follow, and the live pictures of
//! the table.

use crate::Error;
use crate::store::work::Problem;
use serde::Serialize;
use supine_flow::Session;
use supine_space::Point;

/// What keeps up with the brush.
#[derive(Debug, Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LiveShown {
    /// `none`, `preparing` or `ready`: whether labels can follow a brush.
    segmenter: Readiness,
    share: Option<f64>,
    /// Labels are being made anew.
    following: bool,
    /// Labels, or what is known of their border, are being made anew.
    busy: bool,
    problem: Option<Problem>,
}

/// A live picture of the table.
#[derive(Debug, Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PreviewShown {
    state: Readiness,
    share: Option<f64>,
    message: Option<String>,
    tetrahedra: Option<usize>,
    /// How far off the tumour is from where the planning mesh has it, mm.
    final_mm: Option<f64>,
}

/// Whether something is ready.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum Readiness {
    #[default]
    None,
    Preparing,
    Ready,
    Failed,
}

/// Where the tumour went in the preview, and on which table.
#[derive(Clone, Copy, Debug)]
struct Previewed {
    angles: [f64; 2],
    tumour: Option<Point>,
}

/// All of it.
#[derive(Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Previews {
    #[serde(skip)]
    previewed: Option<Previewed>,
    live: LiveShown,
    #[serde(rename = "preview_tilt")]
    table: PreviewShown,
    #[serde(rename = "preview_applicator")]
    applicator: PreviewShown,
}

impl Previews {
    pub(crate) fn set_share(&mut self, share: f64) {
        (self.live.share, self.table.share) = (Some(share), Some(share));
    }

    /// Whether labels can follow a brush.
    pub(crate) fn set_segmenter(&mut self, ready: Readiness) {
        self.live.segmenter = ready;
    }

    /// Labels will be made anew.
    pub(crate) fn labels_begin(&mut self) {
        let live = &mut self.live;
        (live.following, live.busy, live.problem) = (true, true, None);
    }

    /// The labels are there, but not yet what is known of their border.
    pub(crate) fn labels_made(&mut self) {
        self.live.following = false;
    }

    /// Work beside has ended: of labels how; `waits`: whether newer ones are wanted.
    pub(crate) fn end(&mut self, labels: Option<Result<(), Error>>, waits: bool) {
        let live = &mut self.live;
        (live.share, live.following, live.busy) = (None, waits, waits);
        // A preview tells of itself; that the CT cannot be made ready is told by the work that
        // needs it.
        if let Some(done) = labels {
            let failed = done.err().filter(|error| !error.is_stop());
            live.problem = failed.as_ref().map(Problem::of);
        }
    }

    /// What could not be made of the case before may be possible now.
    pub(super) fn try_again(&mut self) {
        if self.table.state == Readiness::Failed {
            self.table = PreviewShown::default();
        }
    }

    pub(crate) fn set_table(
        &mut self,
        state: Readiness,
        message: Option<String>,
        tetrahedra: Option<usize>,
    ) {
        let shown = &mut self.table;
        (shown.state, shown.message, shown.tetrahedra) = (state, message, tetrahedra);
        shown.share = None;
    }

    pub(crate) fn set_applicator(&mut self, state: Readiness, message: Option<String>) {
        let shown = &mut self.applicator;
        (shown.state, shown.message) = (state, message);
    }

    pub(crate) fn has_applicator(&self) -> bool {
        self.applicator.state == Readiness::Ready
    }

    /// The table was tilted: where the tumour went.
    pub(crate) fn tilted(&mut self, session: &Session, angles: [f64; 2], tumour: Option<Point>) {
        self.previewed = Some(Previewed { angles, tumour });
        self.compare(session);
    }

    pub(super) fn compare(&mut self, session: &Session) {
        self.table.final_mm = self.off_mm(session);
    }

    /// How far off the preview has the tumour from where the planning mesh has it; nothing while
    /// either is not there, or both are of different tables.
    fn off_mm(&self, session: &Session) -> Option<f64> {
        let previewed = self.previewed?;
        let table = session.case().table?;
        let same = previewed.angles == [table.ap_deg, table.lat_deg];
        let (movement, _) = session.peek_tumour().filter(|_| same)?;
        Some((Point::from(movement.after_mm) - previewed.tumour?).norm())
    }
}

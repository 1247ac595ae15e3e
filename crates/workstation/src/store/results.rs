//! What was found: figures, uncertain places, how far the tumour moves, and what a run left.

use crate::Error;
use crate::names::name_of;
use serde::Serialize;
use std::path::{Path, PathBuf};
use supine_flow::commands::Colour;
use supine_flow::spec::Edit;
use supine_flow::{NodeId, Session, Summary, UncertainPatch, headline, too_wide};

/// An uncertain place of the chest wall.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PatchShown {
    centre_mm: [f64; 3],
    area_cm2: f64,
    error_mm: f64,
    name: String,
}

/// How far the tumour moves, mm, never without how sure that is.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct TumourShown {
    distance_mm: f64,
    /// Interval of that distance, and how far off its place may be; nothing where they could not be
    /// found.
    length_mm: Option<[f64; 2]>,
    within_mm: Option<f64>,
    /// Why no verdict on it can be green, if so.
    reason: Option<String>,
    /// Probability of both.
    level: Option<f64>,
}

/// A figure of a stage.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct FigureShown {
    #[serde(flatten)]
    of: supine_flow::Figure,
    /// Whether it is of what was given before.
    old: bool,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ResultShown {
    /// The folder's name.
    name: String,
    /// Whether it is of the case before a change.
    old: bool,
    /// Whether warnings were ticked since: its report does not tell that.
    lacks_ticks: bool,
    verdict: Colour,
    /// What stands first in the report.
    headline: String,
    reasons: Vec<String>,
    /// Files and folders, relative to it.
    outputs: Vec<String>,
    /// What the check of the written files found.
    verified: Option<VerifiedShown>,
    /// What the user types before any of it is sent, where it is not green.
    confirm: Option<&'static str>,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct VerifiedShown {
    ok: bool,
    text: String,
}

/// The folder of a run.
struct Run {
    path: PathBuf,
    /// The case that it is of; none where that was changed during the run.
    case: Option<String>,
}

/// What was found of the case that is open.
#[derive(Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Results {
    #[serde(skip)]
    run: Option<Run>,
    patches: Vec<PatchShown>,
    /// Whether they are of what was given before.
    patches_old: bool,
    /// How far the tumour moves; nothing that is of what was given before.
    tumour: Option<TumourShown>,
    /// What a run left in a folder.
    result: Option<ResultShown>,
    /// Mesh, mechanics and map in a few figures.
    figures: Vec<FigureShown>,
}

impl Results {
    /// What the session holds.
    pub(super) fn read(&mut self, session: &Session) {
        let shown = |of: supine_flow::Figure| FigureShown { old: !session.is_fresh(of.node), of };
        self.figures = session.figures().into_iter().map(shown).collect();
        self.tumour = session.peek_tumour().map(|(movement, interval)| {
            let interval = interval.as_ref();
            let tolerance_mm = session.case().tolerance.mm();
            let reason = interval.and_then(|known| too_wide(known, tolerance_mm));
            TumourShown {
                distance_mm: movement.distance_mm,
                length_mm: interval.map(|interval| interval.length_mm),
                within_mm: interval.map(|interval| interval.within_mm),
                reason: reason.map(|reason| reason.message),
                level: interval.map(|interval| interval.level),
            }
        });
        if let Some((_, patches)) = session.peek_region() {
            self.patches = patches.into_iter().map(PatchShown::from).collect();
            self.patches_old = !session.is_fresh(NodeId::Region);
        }
    }

    /// What a run left, and the case that it is of.
    pub(super) fn show_run(&mut self, path: &Path, case: Option<String>, summary: &Summary) {
        self.result = Some(ResultShown::new(path, summary, case.is_none()));
        self.run = Some(Run { path: path.into(), case });
    }

    /// The folder whose results may leave.
    ///
    /// # Errors
    /// When there is none, the case was changed since, or the user has not typed the words.
    pub(crate) fn to_be_sent(&self, typed: Option<&str>) -> Result<PathBuf, Error> {
        let (Some(ResultShown { confirm, old: false, .. }), Some(run)) = (&self.result, &self.run)
        else {
            return Err(Error::NoResult);
        };
        match confirm.filter(|words| typed != Some(*words)) {
            Some(words) => Err(Error::Confirm(words.into())),
            None => Ok(run.path.clone()),
        }
    }

    /// Marks the run as of the case, or of the case before; whether what it left is of another one.
    pub(super) fn mark_run(&mut self, now: Option<&str>) -> bool {
        let Some(result) = &mut self.result else { return false };
        let written = self.run.as_ref().and_then(|run| run.case.as_deref());
        // Ticks say what was looked at: the written report lacks them, and nothing that was
        // computed is another for it.
        let is_ticked = written.map(without_ticks) == now.map(without_ticks);
        result.old = written.is_none() || !is_ticked;
        result.lacks_ticks = !result.old && written != now;
        !is_ticked
    }

    pub(super) fn mark_all_old(&mut self) {
        self.figures.iter_mut().for_each(|figure| figure.old = true);
        self.result.iter_mut().for_each(|result| result.old = true);
        (self.patches_old, self.tumour) = (true, None);
    }
}

impl From<UncertainPatch> for PatchShown {
    fn from(patch: UncertainPatch) -> Self {
        let UncertainPatch { centre_mm, area_cm2, error_mm, place, .. } = patch;
        Self { centre_mm, area_cm2, error_mm, name: place }
    }
}

impl ResultShown {
    fn new(path: &Path, summary: &Summary, old: bool) -> Self {
        let checks = summary.export.as_ref().map(|export| &export.verified);
        Self {
            verified: checks.map(|checks| VerifiedShown {
                ok: checks.passed == checks.total && checks.total > 0,
                text: format!(
                    "{} of {} checks of the written files passed",
                    checks.passed, checks.total
                ),
            }),
            confirm: words(summary.verdict.colour),
            name: name_of(path),
            old,
            lacks_ticks: false,
            verdict: summary.verdict.colour,
            headline: headline(summary),
            reasons: summary.verdict.reasons.iter().map(|reason| reason.message.clone()).collect(),
            outputs: summary.outputs.iter().map(|output| output.path.clone()).collect(),
        }
    }
}

/// What the user types before a result is sent; nothing where it is green.
fn words(colour: Colour) -> Option<&'static str> {
    match colour {
        Colour::Green => None,
        Colour::Amber => Some("send although amber"),
        Colour::Red => Some("send although red"),
    }
}

/// A case without its ticks of warnings.
fn without_ticks(text: &str) -> String {
    let none = Edit { key: "report.seen".into(), value: serde_json::Value::Null };
    supine_flow::spec::edit(text, &[none]).unwrap_or_else(|_| text.into())
}

//! `supine init`: a commented case file to begin with.

mod text;
mod tumour;

use super::{Gather, input, session};
use crate::commands::dicom;
use crate::folder::{USERS, write_atomically};
use crate::nodes::Import;
use crate::session::Request;
use crate::shared::{is_volume, read_ct};
use crate::spec::Spec;
use crate::{Error, NodeId, Observer};
use serde::Serialize;
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use supine_dicom::{ReadParams, SeriesReport, SeriesSummary};
use supine_segment::tumour_place;
use supine_space::{Failure, Posture, Side};
use tumour::Found;

/// What is asked.
#[derive(Clone, Debug)]
pub struct Init {
    /// The CT: a DICOM folder or a file of it, NRRD or NIfTI.
    pub ct: PathBuf,
    /// An RT structure set of the CT.
    pub structures: Option<PathBuf>,
    /// The tumour's region in it; without one, a list of points (.mrk.json, .csv).
    pub tumour: Option<String>,
    /// Radius of a tumour that is known by a point, mm.
    pub radius: Option<f64>,
    /// The side, where it is not to be proposed from the tumour.
    pub breast: Option<Side>,
    /// The case file.
    pub out: PathBuf,
    /// Whether it may be there already.
    pub overwrite: bool,
}

/// What was written.
#[derive(Clone, Debug, Serialize)]
pub struct InitDone {
    /// The case file.
    pub case: PathBuf,
    /// The series of the folder that can be used; empty of a CT that is one file.
    pub series: Vec<SeriesSummary>,
    /// Keys that are left to be filled in, in the order of the file.
    pub missing: Vec<&'static str>,
    /// Whether the side was proposed from the tumour's place.
    pub breast_proposed: bool,
}

/// Looks at a CT and writes a case file with a comment for every key; what is not known is left as
/// a line to fill in.
///
/// # Errors
/// When the file is there already, the CT holds no usable series, or the tumour cannot be what is
/// named.
pub fn init(given: &Init, observer: &dyn Observer) -> Result<InitDone, Error> {
    if given.out.exists() && !given.overwrite {
        let path = given.out.display();
        let message = format!("{path} is there already; name another --out, or add --overwrite");
        return Err(Error::Refused { kind: Failure::Output, message });
    }
    for path in std::iter::once(&given.ct).chain(&given.structures) {
        check_utf8(path)?;
    }
    let Usable { series, several, posture } = usable(given, observer)?;
    let tumour = tumour::find(given)?;
    let chosen = (series.len() == 1).then(|| series[0].uid.clone()).filter(|_| several);
    let breast = match series.len() {
        // Which one the tumour lies in is not known.
        2.. => given.breast,
        _ => side(given, (chosen.as_deref(), posture), &tumour, observer)?,
    };
    let mut missing = Vec::new();
    missing.extend((series.len() > 1).then_some("series"));
    missing.extend(breast.is_none().then_some("breast"));
    missing.push("table");
    missing.extend((!tumour.is_whole()).then_some("tumour"));
    let breast_proposed = breast.is_some() && given.breast.is_none();
    let page = text::Page {
        given,
        series: &series,
        chosen,
        posture,
        breast,
        breast_proposed,
        tumour: &tumour,
    };
    write_atomically(&given.out, page.text().as_bytes(), USERS)?;
    Ok(InitDone { case: given.out.clone(), series, missing, breast_proposed })
}

/// The series of a CT that can be used.
#[derive(Default)]
struct Usable {
    series: Vec<SeriesSummary>,
    /// Whether its folder holds others too.
    several: bool,
    /// How the patient lay in the first one, as its Patient Position tells.
    posture: Posture,
}

fn usable(given: &Init, observer: &dyn Observer) -> Result<Usable, Error> {
    if let Err(source) = std::fs::metadata(&given.ct) {
        return Err(Error::Missing { key: "ct", path: given.ct.clone(), source });
    }
    if is_volume(&given.ct) {
        refuse_deformed(given, observer)?;
        return Ok(Usable::default());
    }
    let looked = dicom::Inspect { spec: Spec::new(""), path: given.ct.clone(), pixels: false };
    let inspection = dicom::inspect(&looked, observer)?;
    let usable: Vec<&SeriesReport> = inspection.usable().collect();
    if usable.is_empty() {
        let reason = |s: &SeriesReport| {
            format!("\n  {} ({} slices): {}", s.uid, s.slices, s.reason.as_deref().unwrap_or(""))
        };
        let reasons: String = inspection.series.iter().map(reason).collect();
        let files = inspection.files;
        return Err(input(format!(
            "{} holds no usable CT series ({files} files); `supine inspect` says more{reasons}",
            given.ct.display()
        )));
    }
    let line = |s: &&SeriesReport| SeriesSummary {
        uid: s.uid.clone(),
        description: s.description.clone(),
        slices: s.slices,
    };
    let posture = Posture::of_patient_position(&usable[0].patient_position).unwrap_or_default();
    let several = inspection.series.len() > 1;
    Ok(Usable { series: usable.iter().map(line).collect(), several, posture })
}

/// Refuses a volume that is a result of this program, before it gets a case file.
fn refuse_deformed(given: &Init, observer: &dyn Observer) -> Result<(), Error> {
    Gather::new(observer, &[]).work(NodeId::Import, |progress| {
        read_ct(&given.ct, &ReadParams::default(), progress)?.not_deformed(&given.ct).map(drop)
    })
}

/// That a case file, which is UTF-8, can name a path from the folder where one is.
fn check_utf8(path: &Path) -> Result<(), Error> {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.into());
    if whole.to_str().is_some() {
        return Ok(());
    }
    let path = whole.display();
    Err(input(format!(
        "the path {path} is no UTF-8, so no case file can name it; rename its folder or file"
    )))
}

/// The side: as asked, or that of the body on which the tumour lies; the CT is read for it.
fn side(
    given: &Init,
    (series, posture): (Option<&str>, Posture),
    tumour: &Found,
    observer: &dyn Observer,
) -> Result<Option<Side>, Error> {
    let Some(sphere) = tumour.sphere()? else { return Ok(given.breast) };
    let here = std::path::absolute(".").unwrap_or_default();
    let mut spec = Spec::new(here);
    spec.set("ct", &given.ct.to_string_lossy().into())?;
    spec.set("series", &series.map_or(Json::Null, Json::from))?;
    spec.set("position", &posture.name().into())?;
    let gather = Gather::new(observer, &[]);
    let request = Request { observer: &gather, ..Request::default() };
    let read = session(&spec)?.get::<Import>(&request)?;
    if let Some(frame) = tumour.frame_of_reference() {
        gather.warn_all(NodeId::Tumour, crate::shared::of_the_ct(frame, read.source.as_ref())?);
    }
    if let Some(structures) = &given.structures {
        let doubt = crate::shared::of_the_patient(structures, read.source.as_ref())?;
        gather.warn_all(NodeId::Tumour, doubt);
    }
    Ok(tumour_place(&read.ct, sphere, given.breast)?.side.or(given.breast))
}

//! The live picture of the table: what the page asks for, and the frame that it gets.

use crate::Error;
use crate::draw::planes::{ViewShown, views};
use crate::navigation::follow::Following;
use crate::navigation::region::Over;
use crate::store::previews::Readiness;
use crate::workers::reporter::Reporter;
use serde::Deserialize;
use std::sync::Arc;
use std::time::Instant;
use supine_flow::{Applied, Lane, LiveTilt, Request, Session};
use supine_space::{Pose, TablePose, Vector};
use supine_volume::Ct;
use tokio::sync::watch;

/// Where a page gets its frames; a newer one takes the place of one that was not sent yet.
pub(crate) type Frames = watch::Sender<Option<Arc<Vec<u8>>>>;

/// What a page asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Table {
    ap: f64,
    lat: f64,
    /// Views and slices that are seen.
    planes: Vec<(String, usize)>,
}

/// An applicator on the table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Applicator {
    ap: f64,
    lat: f64,
    planes: Vec<(String, usize)>,
    /// Where its sphere is put in, LPS, mm, and where its shaft points.
    centre: [f64; 3],
    axis: [f64; 3],
    /// Radii of sphere and shaft, mm.
    radius: f64,
    shaft: f64,
    contact: Contact,
    /// Where it has gone since.
    pose: Gone,
    /// A navigation holds it: the picture is the one that it makes.
    #[serde(default)]
    followed: bool,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Contact {
    Tied,
    Frictionless,
}

/// A shift, mm, and a turn about the centre, a rotation vector, radians.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Gone {
    shift: [f64; 3],
    turn: [f64; 3],
}

/// A question.
#[derive(Clone, Debug)]
pub(crate) enum PreviewRequest {
    Table(Table),
    Applicator(Box<Applicator>),
}

/// A question with where its answer goes.
#[derive(Clone)]
pub(crate) struct TiltWish {
    pub(crate) session: Arc<Session>,
    pub(crate) asked: PreviewRequest,
    pub(crate) to: Frames,
}

impl PreviewRequest {
    fn planes(&self) -> &[(String, usize)] {
        match self {
            Self::Table(table) => &table.planes,
            Self::Applicator(applicator) => &applicator.planes,
        }
    }

    fn angles(&self) -> [f64; 2] {
        match self {
            Self::Table(table) => [table.ap, table.lat],
            Self::Applicator(applicator) => [applicator.ap, applicator.lat],
        }
    }

    /// The tilt, where it is one.
    fn pose(&self) -> Result<TablePose, Error> {
        let [ap_deg, lat_deg] = self.angles();
        let within = |degrees: f64| (-90.0..=90.0).contains(&degrees);
        (within(ap_deg) && within(lat_deg))
            .then_some(TablePose { ap_deg, lat_deg })
            .ok_or_else(|| Error::Request("the tilt is out of range".into()))
    }
}

impl Applicator {
    fn applied(&self) -> Result<Applied, Error> {
        let axis = Vector::from(self.axis);
        let good = (1.0..=60.0).contains(&self.radius)
            && (0.5..=30.0).contains(&self.shaft)
            && axis.norm() > 0.0
            && self.centre.iter().chain(&self.axis).all(|x| x.is_finite());
        let applied = Applied {
            centre: self.centre.into(),
            axis,
            radius_mm: self.radius,
            shaft_mm: self.shaft,
            slides: matches!(self.contact, Contact::Frictionless),
        };
        good.then_some(applied).ok_or_else(|| Error::Request("no such applicator".into()))
    }

    /// The motion of all space that takes it from where it was put in to where it is.
    fn moved(&self) -> Pose {
        let (centre, shift) = (Vector::from(self.centre), Vector::from(self.pose.shift));
        let turn = Vector::from(self.pose.turn);
        let turned = Pose::new(Vector::zeros(), turn) * centre;
        Pose::new(centre + shift - turned, turn)
    }
}

/// Makes a frame, with the preview that is kept or a new one.
///
/// # Errors
/// When it cannot be made, or a newer wish ends the work.
pub(crate) fn preview(
    kept: &mut Option<LiveTilt>,
    wish: &TiltWish,
    following: &Following,
    report: &Reporter,
) -> Result<(), Error> {
    let TiltWish { session, asked, to } = wish;
    let pose = asked.pose()?;
    let still = kept.as_ref().is_some_and(|tilt| tilt.is_still_of(session));
    if !still {
        keep(kept, session, report)?;
    }
    let tilt = kept.as_mut().ok_or(Error::Broken)?;
    let start = Instant::now();
    let grids = views(tilt.ct().grid());
    let number = |(name, slice): &(String, usize)| {
        Some((grids.iter().find(|view| view.is(name))?.normal(), *slice))
    };
    let seen: Vec<_> = asked.planes().iter().filter_map(number).collect();
    if let PreviewRequest::Applicator(applicator) = asked
        && applicator.followed
    {
        tilt.take_out();
        session.on_live(|| tilt.turn(pose, &seen))?;
        report.change(|store| store.previews.set_applicator(Readiness::Ready, None));
        let frame = followed(tilt, applicator, following, start);
        to.send_replace(Some(Arc::new(frame.bytes)));
        return Ok(());
    }
    let centre = session.tumour_sphere().map(|tumour| tumour.centre());
    let contact = match asked {
        PreviewRequest::Table(_) => {
            tilt.take_out();
            session.on_live(|| tilt.turn(pose, &seen))?;
            None
        }
        PreviewRequest::Applicator(applicator) => {
            let (applied, moved) = (applicator.applied()?, applicator.moved());
            Some(hold(tilt, session, (&applied, pose), &moved, &seen, report)?)
        }
    };
    let after = centre.and_then(|centre| tilt.carried(&centre));
    let moved = centre.zip(after).map(|(before, after)| (after - before).norm());
    let planes = cut(tilt, asked.planes(), None);
    let ms = start.elapsed().as_secs_f64() * 1000.0;
    let mut frame = Frame::default();
    match contact {
        None => {
            let [ap, lat] = asked.angles();
            frame.head(TABLE, [ap, lat, moved.unwrap_or(f64::NAN), ms], &planes);
        }
        Some(contact) => {
            let forces = [contact.force_n.norm(), contact.moment_n_mm.norm()];
            frame.head(APPLICATOR, [moved.unwrap_or(f64::NAN), forces[0], forces[1], ms], &planes);
            let place = after.map_or([f64::NAN; 3], |p| p.coords.into());
            let away = contact.away_mm.unwrap_or(f64::NAN);
            let radius = session.tumour_sphere().map_or(f64::NAN, |tumour| tumour.radius());
            let [ap, lat] = asked.angles();
            frame.numbers(&[place[0], place[1], place[2], away, away - radius, ap, lat, 0.0]);
        }
    }
    if contact.is_none() {
        report.change(|store| store.previews.tilted(session, asked.angles(), after));
    }
    // Last: who has the picture finds the state that goes with it.
    to.send_replace(Some(Arc::new(frame.bytes)));
    Ok(())
}

/// The table as the preview has it, with the CT that a navigation carries where it has one.
fn followed(
    tilt: &LiveTilt,
    applicator: &Applicator,
    following: &Following,
    start: Instant,
) -> Frame {
    let picture = following.picture();
    let over = picture.as_ref().map(|picture| Over::new(&picture.ct, tilt.ct().grid()));
    let planes = cut(tilt, &applicator.planes, over.as_ref());
    let answer = picture.as_ref().and_then(|picture| picture.answer.as_ref());
    let of = |number: Option<f64>| number.unwrap_or(f64::NAN);
    let moved = of(answer.and_then(|answer| answer.moved_mm));
    let force = of(answer.and_then(|answer| answer.force_n));
    let away = of(answer.and_then(|answer| answer.from_surface_mm));
    let [x, y, z] = answer.map_or([f64::NAN; 3], |answer| answer.tumour);
    let gap = away - answer.map_or(f64::NAN, |answer| answer.radius_mm);
    let ms = start.elapsed().as_secs_f64() * 1000.0;
    let mut frame = Frame::default();
    frame.head(APPLICATOR, [moved, force, f64::NAN, ms], &planes);
    frame.numbers(&[x, y, z, away, gap, applicator.ap, applicator.lat, 0.0]);
    frame
}

/// Moves the applicator; what it fails with is told.
fn hold(
    tilt: &mut LiveTilt,
    session: &Session,
    applied: (&Applied, TablePose),
    moved: &Pose,
    seen: &[(usize, usize)],
    report: &Reporter,
) -> Result<supine_flow::ContactResult, Error> {
    let show = |state: Readiness, message: Option<String>| {
        report.change(|store| store.previews.set_applicator(state, message));
    };
    if !report.look(|store| store.previews.has_applicator()) {
        show(Readiness::Preparing, None);
    }
    let centre = session.tumour_sphere().map(|tumour| tumour.centre());
    match session.on_live(|| tilt.hold(applied, moved, centre.as_ref(), seen)) {
        Ok(contact) => {
            show(Readiness::Ready, None);
            Ok(contact)
        }
        Err(error) => {
            show(Readiness::Failed, Some(error.to_string()));
            Err(error.into())
        }
    }
}

/// The preview that is kept, or a new one where that is of something else.
///
/// # Errors
/// When it cannot be made, or a newer wish ends the work.
pub(crate) fn keep(
    kept: &mut Option<LiveTilt>,
    session: &Session,
    report: &Reporter,
) -> Result<(), Error> {
    let is_of = kept.as_mut().is_some_and(|tilt| tilt.is_of(session).unwrap_or(false));
    if !is_of {
        // Two are never held at once.
        *kept = None;
        *kept = Some(new_preview(session, report)?);
    }
    Ok(())
}

fn new_preview(session: &Session, report: &Reporter) -> Result<LiveTilt, Error> {
    let show = |state: Readiness, message: Option<String>, tetrahedra: Option<usize>| {
        report.change(|store| store.previews.set_table(state, message, tetrahedra));
    };
    show(Readiness::Preparing, None, None);
    let request = Request { observer: report, lane: Lane::Live, ..Request::default() };
    match LiveTilt::new(session, &request) {
        Ok(tilt) => {
            show(Readiness::Ready, None, Some(tilt.tetrahedra()));
            Ok(tilt)
        }
        Err(supine_flow::Error::Stopped) => {
            show(Readiness::None, None, None);
            Err(Error::Flow(supine_flow::Error::Stopped))
        }
        Err(error) => {
            let error = Error::Flow(error);
            show(Readiness::Failed, Some(error.to_string()), None);
            Err(error)
        }
    }
}

/// The part of a plane that differs from the CT as it was acquired.
struct Patch {
    view: u32,
    slice: usize,
    /// First voxel along the right and down axes, and how many.
    at: [usize; 2],
    size: [usize; 2],
    hu: Vec<i16>,
}

/// The planes of the preview; `over`: what takes its place where there is some.
fn cut(tilt: &LiveTilt, planes: &[(String, usize)], over: Option<&Over<'_>>) -> Vec<Patch> {
    let all = views(tilt.ct().grid());
    let patch = |(name, slice): &(String, usize)| {
        let view = all.iter().position(|view| view.is(name))?;
        let (n, shown) = (u32::try_from(view).ok()?, &all[view]);
        let is_there = *slice < tilt.ct().grid().size()[shown.normal()];
        is_there.then(|| differs(tilt, (n, shown), *slice, over))
    };
    planes.iter().filter_map(patch).collect()
}

fn differs(
    tilt: &LiveTilt,
    (view, shown): (u32, &ViewShown),
    slice: usize,
    over: Option<&Over<'_>>,
) -> Patch {
    let (old, new): (&Ct, &Ct) = (tilt.acquired(), tilt.ct());
    let (size, [right, down]) = (new.grid().size(), shown.sides());
    let voxel = |x: usize, y: usize| {
        let mut voxel = [slice; 3];
        (voxel[right], voxel[down]) = (x, y);
        voxel
    };
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    let mut plane = Vec::with_capacity(size[right] * size[down]);
    for y in 0..size[down] {
        for x in 0..size[right] {
            let n = new.grid().offset(voxel(x, y));
            let hu = over.and_then(|over| over.at(voxel(x, y))).unwrap_or_else(|| new.data()[n]);
            if old.data()[n] != hu {
                (low[0], low[1]) = (low[0].min(x), low[1].min(y));
                (high[0], high[1]) = (high[0].max(x + 1), high[1].max(y + 1));
            }
            plane.push(hu);
        }
    }
    if high == [0; 2] {
        (low, high) = ([0; 2], [0; 2]);
    }
    let row = |y: usize| &plane[y * size[right]..][low[0]..high[0]];
    let hu = (low[1]..high[1]).flat_map(row).copied().collect();
    Patch { view, slice, at: low, size: [high[0] - low[0], high[1] - low[1]], hu }
}

/// "SEBD" and "AEBD", little-endian: the first bytes of a frame of the table, and of one with an
/// applicator.
const TABLE: u32 = 0x4442_4553;
const APPLICATOR: u32 = 0x4442_4541;

/// Little-endian: u32 magic, 0, planes, 0; four f32: of the table AP and LAT (degrees), the
/// tumour's way (mm; NaN: unknown), ms; with an applicator the tumour's way, force (N), moment (N
/// mm; NaN: a navigation does not say it), ms. For each plane u32 view (axial, sagittal, coronal),
/// slice, first voxel right and down, how many right and down; its HU row by row as i16, with two
/// bytes more where their number is odd. With an applicator eight f32 follow: the tumour's centre
/// (LPS, mm), its distance and that of its surface from the applicator's (mm), the table's AP and
/// LAT, 0.
#[derive(Default)]
struct Frame {
    bytes: Vec<u8>,
}

impl Frame {
    fn head(&mut self, magic: u32, numbers: [f64; 4], planes: &[Patch]) {
        self.wholes(&[magic as usize, 0, planes.len(), 0]);
        self.numbers(&numbers);
        for Patch { view, slice, at, size, hu } in planes {
            self.wholes(&[*view as usize, *slice, at[0], at[1], size[0], size[1]]);
            self.bytes.extend(hu.iter().flat_map(|hu| hu.to_le_bytes()));
            self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        }
    }

    fn wholes(&mut self, all: &[usize]) {
        self.bytes.extend(all.iter().flat_map(|n| (*n as u32).to_le_bytes()));
    }

    fn numbers(&mut self, all: &[f64]) {
        self.bytes.extend(all.iter().flat_map(|x| (*x as f32).to_le_bytes()));
    }
}

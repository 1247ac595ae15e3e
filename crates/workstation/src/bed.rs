//! The live picture of the table: what the page asks for, and the frame that it gets.

use crate::Error;
use crate::desk::Desk;
use crate::job::Watching;
use crate::show::preview_differs;
use crate::state::{Readiness, ViewShown, views};
use serde::Deserialize;
use std::sync::Arc;
use std::time::Instant;
use supine_flow::{Lane, LiveBed, Request, Session};
use supine_space::{BedPose, Point};
use supine_volume::Ct;
use tokio::sync::watch;

/// Where a page gets its frames; a newer one takes the place of one that was not sent yet.
pub(crate) type Frames = watch::Sender<Option<Arc<Vec<u8>>>>;

/// "SEBD", little-endian: the first bytes of a frame.
const MAGIC: u32 = 0x4442_4553;

/// What a page asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Asked {
    ap: f64,
    lat: f64,
    /// Views and slices that are seen.
    planes: Vec<(String, usize)>,
}

/// A question with where its answer goes.
#[derive(Clone)]
pub(crate) struct BedWish {
    pub(crate) session: Arc<Session>,
    pub(crate) asked: Asked,
    pub(crate) to: Frames,
}

/// Where the tumour went in the preview, and on which table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Previewed {
    pub(crate) bed: [f64; 2],
    pub(crate) tumour: Option<Point>,
}

impl Asked {
    fn pose(&self) -> Option<BedPose> {
        let within = |degrees: f64| (-90.0..=90.0).contains(&degrees);
        let pose = BedPose { ap_deg: self.ap, lat_deg: self.lat };
        (within(self.ap) && within(self.lat)).then_some(pose)
    }
}

impl Desk {
    /// Makes a frame, with the preview that is kept or a new one.
    ///
    /// # Errors
    /// When it cannot be made, or a newer wish ends the work.
    pub(crate) fn preview(
        &self,
        kept: &mut Option<LiveBed>,
        wish: &BedWish,
        watching: &Watching,
    ) -> Result<(), Error> {
        let BedWish { session, asked, to } = wish;
        let pose = asked.pose().ok_or_else(|| Error::Request("the tilt is out of range".into()))?;
        let bed = self.keep_preview(kept, session, watching)?;
        let start = Instant::now();
        let grids = views(bed.ct().grid());
        let number = |(name, slice): &(String, usize)| {
            Some((grids.iter().find(|view| view.is(name))?.normal(), *slice))
        };
        let seen: Vec<_> = asked.planes.iter().filter_map(number).collect();
        session.on_live(|| bed.turn(pose, &seen))?;
        let centre = session.tumour_sphere().map(|tumour| tumour.centre());
        let after = centre.and_then(|centre| bed.carried(&centre));
        let moved = centre.zip(after).map(|(before, after)| (after - before).norm());
        let planes = cut(bed, &asked.planes);
        let ms = start.elapsed().as_secs_f64() * 1000.0;
        to.send_replace(Some(Arc::new(frame(asked, moved, ms, &planes))));
        self.change(|held| {
            held.previewed = Some(Previewed { bed: [asked.ap, asked.lat], tumour: after });
            held.state.preview_bed.final_mm = preview_differs(held, session);
        });
        Ok(())
    }

    /// The preview that is kept, or a new one where that is of something else.
    ///
    /// # Errors
    /// When it cannot be made, or a newer wish ends the work.
    pub(crate) fn keep_preview<'a>(
        &self,
        kept: &'a mut Option<LiveBed>,
        session: &Session,
        watching: &Watching,
    ) -> Result<&'a mut LiveBed, Error> {
        let is_of = kept.as_ref().is_some_and(|bed| bed.is_of(session).unwrap_or(false));
        if !is_of {
            // Two are never held at once.
            *kept = None;
            *kept = Some(self.new_preview(session, watching)?);
        }
        kept.as_mut().ok_or(Error::Broken)
    }

    fn new_preview(&self, session: &Session, watching: &Watching) -> Result<LiveBed, Error> {
        let show = |state: Readiness, message: Option<String>, tetrahedra: Option<usize>| {
            self.change(|held| {
                let shown = &mut held.state.preview_bed;
                (shown.state, shown.message, shown.tetrahedra) = (state, message, tetrahedra);
                shown.share = None;
            });
        };
        show(Readiness::Preparing, None, None);
        let request = Request { observer: watching, lane: Lane::Live, ..Request::default() };
        let made = session.on_live(|| LiveBed::new(session, &request));
        match made {
            Ok(bed) => {
                show(Readiness::Ready, None, Some(bed.tetrahedra()));
                Ok(bed)
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

fn cut(bed: &LiveBed, planes: &[(String, usize)]) -> Vec<Patch> {
    let all = views(bed.ct().grid());
    let patch = |(name, slice): &(String, usize)| {
        let view = all.iter().position(|view| view.is(name))?;
        let (n, shown) = (u32::try_from(view).ok()?, &all[view]);
        (*slice < bed.ct().grid().size()[shown.normal()]).then(|| differs(bed, (n, shown), *slice))
    };
    planes.iter().filter_map(patch).collect()
}

fn differs(bed: &LiveBed, (view, shown): (u32, &ViewShown), slice: usize) -> Patch {
    let (old, new): (&Ct, &Ct) = (bed.acquired(), bed.ct());
    let (size, [right, down]) = (new.grid().size(), shown.sides());
    let at = |x: usize, y: usize| {
        let mut voxel = [slice; 3];
        (voxel[right], voxel[down]) = (x, y);
        new.grid().offset(voxel)
    };
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for y in 0..size[down] {
        for x in 0..size[right] {
            let n = at(x, y);
            if old.data()[n] != new.data()[n] {
                (low[0], low[1]) = (low[0].min(x), low[1].min(y));
                (high[0], high[1]) = (high[0].max(x + 1), high[1].max(y + 1));
            }
        }
    }
    if high == [0; 2] {
        (low, high) = ([0; 2], [0; 2]);
    }
    let rows = (low[1]..high[1]).flat_map(|y| (low[0]..high[0]).map(move |x| (x, y)));
    let hu = rows.map(|(x, y)| new.data()[at(x, y)]).collect();
    Patch { view, slice, at: low, size: [high[0] - low[0], high[1] - low[1]], hu }
}

/// Little-endian: u32 magic, 0, planes, 0; f32 AP and LAT (degrees), the tumour's way (mm; NaN: unknown), ms; for each
/// plane u32 view (axial, sagittal, coronal), slice, first voxel right and down, how many right and down; its HU row by row
/// as i16, with two bytes more where their number is odd.
fn frame(asked: &Asked, moved: Option<f64>, ms: f64, planes: &[Patch]) -> Vec<u8> {
    let mut bytes: Vec<u8> = Vec::new();
    let whole = |bytes: &mut Vec<u8>, n: usize| {
        bytes.extend((n as u32).to_le_bytes());
    };
    [MAGIC as usize, 0, planes.len(), 0].into_iter().for_each(|n| whole(&mut bytes, n));
    for x in [asked.ap, asked.lat, moved.unwrap_or(f64::NAN), ms] {
        bytes.extend((x as f32).to_le_bytes());
    }
    for Patch { view, slice, at, size, hu } in planes {
        let head = [*view as usize, *slice, at[0], at[1], size[0], size[1]];
        head.into_iter().for_each(|n| whole(&mut bytes, n));
        bytes.extend(hu.iter().flat_map(|hu| hu.to_le_bytes()));
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}

//! Finer labels: fat, gland, skin and tumour within the soft tissue; lung, bone and muscle within
//! the chest wall.
//!
//! Fat and gland are told apart half-way between their own levels in this scan. Published: skin of
//! the breast 1.44 mm thick in the mean, 0.87 to 2.34 (Shi et al., Med Phys 40, 2013,
//! doi:10.1118/1.4793257); gland and skin take 14 to 26 % of the breast in the mean, less than 45 %
//! in 95 of 100 women (Yaffe et al., Med Phys 36, 2009, PMC2787062). The other constants were
//! chosen and tried on phantoms, not measured.

use crate::Error;
use crate::frame::Frame;
use crate::levels::fat_mode;
use crate::plane::{fill_holes, near, squared_distance};
use crate::smoothing::smoothed;
use crate::tumour;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_record::TissueLevels;
use supine_space::{Progress, Sphere, Stopped, Warning};
use supine_volume::{Ct, LabelMap, Parts, label, median};

/// Noise is smoothed by this much in the slice before levels are compared, mm.
const SMOOTH_MM: f32 = 0.8;
/// Thickness of the skin (about the published mean); gland and fat are measured deeper than twice
/// this, mm.
const SKIN_MM: f32 = 1.6;
/// Dense tissue lies this far above fat, HU, and gland is measured where it is thicker than twice
/// this, mm.
const DENSE_HU: f32 = 60.0;
const CORE_MM: f32 = 2.5;
/// What is thinner than twice this is a strand and counts as fat, mm.
const STRAND_MM: f32 = 2.0;
/// Gland where none is thick enough to be measured, HU above fat.
const GLAND_ABOVE_FAT_HU: f32 = 130.0;
/// Lung: below this level, and its least volume, cm³.
const LUNG_HU: i16 = -400;
const LUNG_CM3: f64 = 1.0;
/// Bone: cortex, and what is above the lower level this near to it in the slice, mm.
const CORTEX_HU: f32 = 250.0;
const BONE_HU: f32 = 130.0;
const BONE_MM: f32 = 8.0;

/// A tissue of the finer labels.
#[derive(Clone, Debug, PartialEq)]
pub struct TissueShare {
    /// One of [`supine_volume::label`].
    pub label: u8,
    /// Volume, ml.
    pub ml: f64,
    /// Mean of the CT, HU; 0 when there is none.
    pub mean_hu: f64,
}

/// What is known of the finer labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TissueInfo {
    /// What the user should look at.
    pub warnings: Vec<Warning>,
    /// By what they were told from each other.
    pub levels: TissueLevels,
    /// Lung, bone, muscle, fat, gland, skin, tumour and implant in the whole CT.
    pub shares: Vec<TissueShare>,
}

/// Splits soft tissue into fat, gland, skin and tumour, and chest wall into lung, bone and muscle
/// (the rest, vessels and organs included).
///
/// Every voxel stays on its side: soft tissue remains soft tissue by
/// [`supine_volume::label::is_soft_tissue`], chest wall remains chest wall. The labels may be
/// coarse or fine, found or supplied, on the grid of the CT (HU). What they call implant stays so,
/// and so does soft tissue that `implants` ([`crate::Segmenter::implants`]) call so. Dense tissue
/// in front of the wall counts as gland wherever it lies, muscle at the shoulder too; strands
/// thinner than 4 mm count as fat. The tumour (LPS, mm) is grown where it stands out from its
/// surroundings.
///
/// # Errors
/// When the grids differ, the slices are not axial, or the callback asked to stop.
pub fn tissues(
    ct: &Ct,
    labels: &LabelMap,
    implants: Option<&LabelMap>,
    tumour: Option<Sphere>,
    progress: Progress<'_>,
) -> Result<(LabelMap, TissueInfo), Error> {
    let frame = Frame::new(ct.grid())?;
    for labels in std::iter::once(labels).chain(implants) {
        if !labels.grid().is_same(ct.grid()) {
            return Err(Error::OtherGrid { labels: labels.grid().size(), ct: ct.grid().size() });
        }
    }
    let mut out = with_implants(labels, implants);
    let deep = deep_soft_tissue(&out, &frame, progress.part(0.0, 0.3))?;
    let fat = fat_level(ct, &deep);
    let gland = gland_level(ct, &frame, &deep, fat, progress.part(0.3, 0.5))?;
    let middle = fat + 0.5 * (gland.unwrap_or(fat + GLAND_ABOVE_FAT_HU) - fat);
    let plane = frame.plane();
    let slices = Slices::new(frame.size[2], progress.part(0.5, 0.9));
    out.data_mut().par_chunks_mut(plane).enumerate().try_for_each(|(k, out)| {
        let image = smoothed(ct, &frame, k, SMOOTH_MM);
        mark_soft(&image, &frame, deep.slice(k), middle, out);
        mark_bone(&image, &frame, out);
        slices.one_more()
    })?;
    mark_lung(ct, &frame, &mut out);
    progress.at(0.95)?;
    let mut info = TissueInfo::default();
    (info.levels.fat_hu, info.levels.gland_hu) = (fat.into(), gland.map(f64::from));
    if let Some(sphere) = tumour {
        info.warnings.extend(tumour::mark(ct, &frame, sphere, &mut out));
        info.levels.tumour_grown = info.warnings.is_empty();
    }
    let all = out.data().iter().copied().zip(ct.data().iter().copied());
    info.shares = shares(all, out.grid().voxel_volume() / 1000.0);
    progress.at(1.0)?;
    Ok((out, info))
}

/// The labels with the implants that lie in their soft tissue.
fn with_implants(labels: &LabelMap, implants: Option<&LabelMap>) -> LabelMap {
    let mut out = labels.clone();
    let pairs = implants.into_iter().flat_map(|i| i.data()).zip(out.data_mut());
    for (&implant, label) in pairs {
        if implant == label::IMPLANT && label::is_soft_tissue(*label) {
            *label = implant;
        }
    }
    out
}

/// Counts slices that are done, in whatever order.
struct Slices<'a> {
    done: AtomicUsize,
    all: usize,
    progress: Progress<'a>,
}

impl<'a> Slices<'a> {
    fn new(all: usize, progress: Progress<'a>) -> Self {
        Self { done: AtomicUsize::new(0), all, progress }
    }

    fn one_more(&self) -> Result<(), Stopped> {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.progress.at(done as f64 / self.all as f64)
    }
}

/// Distance of soft tissue to the air.
struct Deep {
    plane: usize,
    /// 0: no soft tissue, or implant, 1: skin, 2: near the skin, 3: deeper.
    layer: Vec<u8>,
}

impl Deep {
    fn slice(&self, k: usize) -> &[u8] {
        &self.layer[k * self.plane..(k + 1) * self.plane]
    }
}

fn deep_soft_tissue(
    labels: &LabelMap,
    frame: &Frame,
    progress: Progress<'_>,
) -> Result<Deep, Stopped> {
    let plane = frame.plane();
    let spacing = [frame.spacing[0], frame.spacing[1]];
    let mut layer = vec![0u8; labels.data().len()];
    let slices = Slices::new(frame.size[2], progress);
    layer.par_chunks_mut(plane).enumerate().try_for_each(|(k, out)| {
        let labels = &labels.data()[k * plane..(k + 1) * plane];
        let outside: Vec<bool> = labels.iter().map(|&l| l == label::OUTSIDE).collect();
        let reach = 2.0 * SKIN_MM + frame.pixel();
        let squared = squared_distance(&outside, frame.size[0], spacing, reach);
        for (out, (&l, d)) in out.iter_mut().zip(labels.iter().zip(squared)) {
            if label::is_soft_tissue(l) && l != label::IMPLANT {
                // The skin's outside lies half a pixel before the first pixel of air.
                let mm = d.sqrt() - 0.5 * frame.pixel();
                *out = 1 + u8::from(mm > SKIN_MM) + u8::from(mm > 2.0 * SKIN_MM);
            }
        }
        slices.one_more()
    })?;
    Ok(Deep { plane, layer })
}

/// Mode of the fat, HU.
fn fat_level(ct: &Ct, deep: &Deep) -> f32 {
    fat_mode(ct.data(), |n| deep.layer[n] == 3)
}

/// Median of the gland where it is thick, HU.
fn gland_level(
    ct: &Ct,
    frame: &Frame,
    deep: &Deep,
    fat: f32,
    progress: Progress<'_>,
) -> Result<Option<f32>, Stopped> {
    let spacing = [frame.spacing[0], frame.spacing[1]];
    let slices = Slices::new(frame.size[2], progress);
    let thick: Vec<Vec<f32>> = (0..frame.size[2])
        .into_par_iter()
        .map(|k| {
            let image = smoothed(ct, frame, k, SMOOTH_MM);
            let layer = deep.slice(k);
            let thin: Vec<bool> =
                (0..image.len()).map(|n| layer[n] < 3 || image[n] < fat + DENSE_HU).collect();
            let near = near(&thin, frame.size[0], spacing, CORE_MM);
            slices.one_more()?;
            let thick = image.into_iter().zip(near).filter(|(_, near)| !near);
            Ok(thick.map(|(v, _)| v).collect())
        })
        .collect::<Result<_, Stopped>>()?;
    let mut values = thick.concat();
    Ok(median(&mut values))
}

/// Fat, gland and skin of a slice.
fn mark_soft(image: &[f32], frame: &Frame, layer: &[u8], middle: f32, out: &mut [u8]) {
    let spacing = [frame.spacing[0], frame.spacing[1]];
    let thin: Vec<bool> = (0..image.len()).map(|n| layer[n] < 2 || image[n] < middle).collect();
    let rim = near(&thin, frame.size[0], spacing, STRAND_MM);
    let core: Vec<bool> = rim.iter().map(|rim| !rim).collect();
    let thick = near(&core, frame.size[0], spacing, STRAND_MM + 0.3);
    for n in 0..out.len() {
        out[n] = match layer[n] {
            0 => out[n],
            1 => label::SKIN,
            _ if !thin[n] && thick[n] => label::GLAND,
            _ => label::FAT,
        };
    }
}

/// Bone and muscle of a slice.
fn mark_bone(image: &[f32], frame: &Frame, out: &mut [u8]) {
    let spacing = [frame.spacing[0], frame.spacing[1]];
    let wall: Vec<bool> = out.iter().map(|&l| label::is_chest_wall(l)).collect();
    let cortex: Vec<bool> = (0..out.len()).map(|n| wall[n] && image[n] > CORTEX_HU).collect();
    let near = near(&cortex, frame.size[0], spacing, BONE_MM);
    let mut bone: Vec<bool> =
        (0..out.len()).map(|n| wall[n] && image[n] > BONE_HU && near[n]).collect();
    fill_holes(&mut bone, frame.size[0]);
    for n in 0..out.len() {
        if wall[n] {
            out[n] = if bone[n] { label::BONE } else { label::MUSCLE };
        }
    }
}

fn mark_lung(ct: &Ct, frame: &Frame, out: &mut LabelMap) {
    let (hu, labels) = (ct.data(), out.data());
    let air = Parts::new(frame.size, |n| hu[n] < LUNG_HU && label::is_chest_wall(labels[n]));
    for (run, part) in air.iter() {
        if air.voxels[part] as f64 * frame.voxel_cm3() > LUNG_CM3 {
            out.data_mut()[run.voxels()].fill(label::LUNG);
        }
    }
}

/// Volume and mean of each finer label within a sphere (LPS, mm), labels on the grid of the CT
/// (HU).
pub fn tissue_shares(ct: &Ct, labels: &LabelMap, within: Sphere) -> Vec<TissueShare> {
    let Some((start, part)) = labels.grid().around(&within) else {
        return shares(std::iter::empty(), 0.0);
    };
    let inside = (0..part.len()).filter_map(|n| {
        let voxel = part.voxel(n);
        let whole = [0, 1, 2].map(|a| voxel[a] + start[a]);
        within.contains(&part.centre(voxel)).then(|| (labels.at(whole), ct.at(whole)))
    });
    shares(inside, labels.grid().voxel_volume() / 1000.0)
}

/// Volume and mean of the voxels of each label; `ml` is the volume of a voxel.
fn shares(all: impl Iterator<Item = (u8, i16)>, ml: f64) -> Vec<TissueShare> {
    let (mut voxels, mut sums) = ([0usize; 256], [0i64; 256]);
    for (l, v) in all {
        voxels[usize::from(l)] += 1;
        sums[usize::from(l)] += i64::from(v);
    }
    let share = |(label, ..): &(u8, &str, [u8; 3])| {
        let (n, sum) = (voxels[usize::from(*label)], sums[usize::from(*label)]);
        TissueShare { label: *label, ml: n as f64 * ml, mean_hu: sum as f64 / n.max(1) as f64 }
    };
    let coarse = |l: u8| l == label::SOFT_TISSUE || l == label::CHEST_WALL;
    label::ALL.iter().filter(|(l, ..)| !coarse(*l)).map(share).collect()
}

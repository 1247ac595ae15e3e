//! The patient without table, gown and wire, and her lungs.

use crate::body::{Body, flag};
use crate::foreign;
use crate::frame::Frame;
use crate::plane::{fill_holes, keep_joined, near};
use crate::{Error, Params, tubes, whole_chest};
use rayon::prelude::*;
use supine_space::Progress;
use supine_volume::{Ct, Field, Parts};

// Volumes and the level of lung were chosen, not measured.
/// Lung: air enclosed by the body of at least this volume, cm³ ...
const LUNG_CM3: f64 = 60.0;
/// ... whose mean lies above that of a pocket of air between patient and table, HU.
const LUNG_MEAN_HU: f64 = -970.0;
/// Least volume of the lungs together and of the body, litres.
pub(crate) const LUNGS_L: f64 = 0.3;
const BODY_L: f64 = 3.0;
/// Sheets and leads thinner than twice this are taken off the body, mm (docs/SEGMENTATION.md, step
/// 1).
const OPENING_MM: f32 = 3.0;
/// A way along pixels is at most this much longer than the straight one: by steps to eight
/// neighbours 8 %.
const WAY: f32 = 1.1;

/// Finds the body.
pub(crate) fn find_body(
    ct: &Ct,
    field: &Field,
    (frame, params): (&Frame, &Params),
    progress: Progress<'_>,
) -> Result<Body, Error> {
    let field = field.seen().to_vec();
    let mut flags = vec![0u8; ct.data().len()];
    let lung_l = mark_air(ct, frame, params, &field, &mut flags);
    progress.at(0.15)?;
    open(ct, frame, params, &mut flags, OPENING_MM);
    progress.at(0.4)?;
    let core = keep_largest(frame, params, &mut flags);
    if lung_l < LUNGS_L {
        // A cut through the chest opens the lungs to the outside, and what is left may be little.
        whole_chest::flat_side(frame, |n| flags[n] & flag::CORE != 0)?;
        return Err(Error::NoLungs { lung_l });
    }
    core?;
    progress.at(0.5)?;
    grow_back(ct, frame, params, &mut flags, OPENING_MM + frame.pixel());
    progress.at(0.75)?;
    let mut body = Body::new(frame, flags, field, lung_l);
    if foreign::drop(ct, frame, &mut body) {
        body.measure_depth(frame);
    }
    let tubes_cm3 = tubes::drop(ct, frame, params.skin_hu as i16, &mut body);
    if tubes_cm3 > 0.0 {
        body.foreign_cm3 += tubes_cm3;
        body.measure_depth(frame);
    }
    body.find_truncation(frame);
    progress.at(1.0)?;
    Ok(body)
}

/// Marks the lungs and the air joined to the surroundings; gives the volume of the lungs, litres.
///
/// Openness is judged within the slices first, so that lungs stay lungs where the CT shows the
/// mouth or where the field cuts one of them.
fn mark_air(ct: &Ct, frame: &Frame, params: &Params, field: &[bool], flags: &mut [u8]) -> f64 {
    let (hu, plane) = (ct.data(), frame.plane());
    let level = params.skin_hu as i16;
    flags.par_chunks_mut(plane).enumerate().for_each(|(k, flags)| {
        mark_open(&hu[k * plane..(k + 1) * plane], frame, level, field, flags);
    });
    let seen: &[u8] = flags;
    let closed = Parts::new(frame.size, |n| hu[n] < level && seen[n] & flag::OPEN_AIR == 0);
    let mut open = vec![false; closed.voxels.len()];
    let mut sum = vec![0i64; closed.voxels.len()];
    for (run, part) in closed.iter() {
        let is_open = |n: usize| flags.get(n).is_some_and(|f| f & flag::OPEN_AIR != 0);
        open[part] |=
            run.voxels().any(|n| is_open(n + plane) || n.checked_sub(plane).is_some_and(is_open));
        sum[part] += run.voxels().map(|n| i64::from(hu[n].max(-1024))).sum::<i64>();
    }
    let mut lung_voxels = 0;
    for (run, part) in closed.iter() {
        let mean = sum[part] as f64 / closed.voxels[part] as f64;
        let large = closed.voxels[part] as f64 * frame.voxel_cm3() > LUNG_CM3;
        let bit = if large && mean > LUNG_MEAN_HU {
            lung_voxels += run.len;
            flag::LUNG
        } else if open[part] {
            flag::OPEN_AIR
        } else {
            0
        };
        run.voxels().for_each(|n| flags[n] |= bit);
    }
    lung_voxels as f64 * frame.voxel_cm3() / 1000.0
}

/// Marks the air of a slice that reaches its border or the end of the field.
fn mark_open(hu: &[i16], frame: &Frame, level: i16, field: &[bool], flags: &mut [u8]) {
    let [ni, nj, _] = frame.size;
    let air = Parts::new([ni, nj, 1], |n| hu[n] < level);
    let mut open = vec![false; air.voxels.len()];
    for (run, part) in air.iter() {
        let (i, j) = (run.start % ni, run.start / ni);
        open[part] |= i == 0 || i + run.len == ni || j == 0 || j + 1 == nj;
        open[part] |= !field[run.start] || !field[run.start + run.len - 1];
    }
    for (run, part) in air.iter() {
        if open[part] {
            run.voxels().for_each(|n| flags[n] |= flag::OPEN_AIR);
        }
    }
}

fn is_tissue(hu: i16, flags: u8, level: i16) -> bool {
    hu >= level || flags & flag::LUNG != 0
}

/// Marks the core: what is farther than `reach` from air within the slice.
fn open(ct: &Ct, frame: &Frame, params: &Params, flags: &mut [u8], reach: f32) {
    let (plane, level) = (frame.plane(), params.skin_hu as i16);
    flags.par_chunks_mut(plane).enumerate().for_each(|(k, flags)| {
        let hu = &ct.data()[k * plane..(k + 1) * plane];
        let air: Vec<bool> =
            hu.iter().zip(&*flags).map(|(&v, &f)| !is_tissue(v, f, level)).collect();
        let spacing = [frame.spacing[0], frame.spacing[1]];
        let near = near(&air, frame.size[0], spacing, reach);
        for (f, near) in flags.iter_mut().zip(near) {
            *f |= if near { 0 } else { flag::CORE };
        }
    });
}

fn keep_largest(frame: &Frame, params: &Params, flags: &mut [u8]) -> Result<(), Error> {
    let parts = Parts::new(frame.size, |n| flags[n] & flag::CORE != 0);
    let largest = parts.largest();
    let volume_l = largest.map_or(0.0, |n| parts.voxels[n] as f64 * frame.voxel_cm3() / 1000.0);
    if volume_l < BODY_L {
        return Err(Error::NoBody { skin_hu: params.skin_hu, volume_l });
    }
    for (run, part) in parts.iter() {
        if Some(part) != largest {
            run.voxels().for_each(|n| flags[n] &= !flag::CORE);
        }
    }
    Ok(())
}

/// The body: tissue that a way of at most `reach` through tissue joins to the core, and what both
/// enclose in their slice. Along the way, not across the air: cloth that hangs beside the skin
/// stays outside however near it is.
fn grow_back(ct: &Ct, frame: &Frame, params: &Params, flags: &mut [u8], reach: f32) {
    let (plane, ni, level) = (frame.plane(), frame.size[0], params.skin_hu as i16);
    let spacing = [frame.spacing[0], frame.spacing[1]];
    flags.par_chunks_mut(plane).enumerate().for_each(|(k, flags)| {
        let hu = &ct.data()[k * plane..(k + 1) * plane];
        let core: Vec<bool> = flags.iter().map(|f| f & flag::CORE != 0).collect();
        let near = near(&core, ni, spacing, reach);
        let mut body: Vec<bool> =
            (0..plane).map(|n| near[n] && is_tissue(hu[n], flags[n], level)).collect();
        keep_joined(&mut body, &core, ni, spacing, WAY * reach);
        fill_holes(&mut body, ni);
        for (f, inside) in flags.iter_mut().zip(body) {
            // A pocket that is joined to the outside in another slice is not the patient.
            if inside && *f & flag::OPEN_AIR == 0 {
                *f |= flag::BODY;
            }
        }
    });
}

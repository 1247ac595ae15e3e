//! What the seeds ask of the labels: no surface and no interpolation overrules a seed.

use super::{EXCLUDE, SOFT, WALL};
use crate::body::flag;
use crate::frame::Frame;
use crate::scan::Scan;
use crate::{Error, Seeds};
use supine_space::Point;
use supine_volume::{Ct, LabelMap, label};

/// A soft-tissue seed may lie this far outside the body found, mm.
const NEAR_SKIN_MM: f32 = 4.0;
/// Radius round an exclude seed that is taken off the body, mm.
const EXCLUDE_MM: f32 = 3.0;

/// The voxel of a seed.
fn voxel(ct: &Ct, kind: &'static str, p: &Point) -> Result<[usize; 3], Error> {
    ct.grid().voxel_at(p).ok_or_else(|| Error::Seed {
        kind,
        point: p.coords.into(),
        why: "lies outside the CT".into(),
    })
}

/// Checks that every seed lies in the body, or near it if that can be meant, and in a voxel that no
/// seed of another kind claims.
pub(crate) fn check(scan: Scan<'_>, seeds: &Seeds) -> Result<(), Error> {
    let ct = scan.ct;
    let lists = [(WALL, &seeds.chest_wall), (SOFT, &seeds.soft_tissue), (EXCLUDE, &seeds.exclude)];
    let mut taken: Vec<([usize; 3], &'static str, Point)> = Vec::new();
    for (kind, points) in lists {
        for p in points {
            let here = voxel(ct, kind, p)?;
            if let Some((_, other, q)) = taken.iter().find(|(v, k, _)| *v == here && *k != kind) {
                return Err(Error::SeedsContradict {
                    first_kind: other,
                    first: q.coords.into(),
                    second_kind: kind,
                    second: p.coords.into(),
                    why: "they lie in one voxel",
                });
            }
            taken.push((here, kind, *p));
            if kind != EXCLUDE {
                in_body(scan, kind, p, here)?;
            }
        }
    }
    Ok(())
}

/// Refuses a seed that lies outside the body: of soft tissue, well outside.
fn in_body(scan: Scan<'_>, kind: &'static str, p: &Point, at: [usize; 3]) -> Result<(), Error> {
    let radius = if kind == SOFT { NEAR_SKIN_MM } else { 0.0 };
    let mut near = false;
    ball(scan, at, radius, |n| near |= scan.body.flags[n] & flag::BODY != 0);
    if near {
        return Ok(());
    }
    Err(Error::Seed { kind, point: p.coords.into(), why: "lies outside the body".into() })
}

/// Calls `f` with the offset of each voxel within `radius` (mm) of a voxel.
fn ball(scan: Scan<'_>, at: [usize; 3], radius: f32, mut f: impl FnMut(usize)) {
    let (grid, frame): (_, &Frame) = (scan.ct.grid(), scan.frame);
    let reach = [0, 1, 2].map(|a| (radius / frame.spacing[a]) as usize);
    let low = [0, 1, 2].map(|a| at[a].saturating_sub(reach[a]));
    let high = [0, 1, 2].map(|a| (at[a] + reach[a]).min(frame.size[a] - 1));
    for k in low[2]..=high[2] {
        for j in low[1]..=high[1] {
            for i in low[0]..=high[0] {
                let v = [i, j, k];
                let off = [0, 1, 2].map(|a| v[a].abs_diff(at[a]) as f32 * frame.spacing[a]);
                if off.iter().map(|x| x * x).sum::<f32>() <= radius * radius {
                    f(grid.offset(v));
                }
            }
        }
    }
}

/// Takes the surroundings of exclude seeds off the patient, adds those of soft-tissue seeds beside
/// the skin to her, and gives the voxels of all seeds their labels.
///
/// # Errors
/// When a seed lies outside the CT.
pub(crate) fn stamp(scan: Scan<'_>, labels: &mut LabelMap, seeds: &Seeds) -> Result<(), Error> {
    let grid = scan.ct.grid();
    let flags = &scan.body.flags;
    for p in &seeds.exclude {
        let at = voxel(scan.ct, EXCLUDE, p)?;
        ball(scan, at, EXCLUDE_MM, |n| labels.data_mut()[n] = label::OUTSIDE);
    }
    for p in &seeds.soft_tissue {
        let at = voxel(scan.ct, SOFT, p)?;
        if flags[grid.offset(at)] & flag::BODY == 0 {
            ball(scan, at, NEAR_SKIN_MM, |n| {
                if flags[n] & (flag::BODY | flag::OPEN_AIR) == 0 {
                    labels.data_mut()[n] = label::SOFT_TISSUE;
                }
            });
        }
    }
    let lists = [
        (label::CHEST_WALL, WALL, &seeds.chest_wall),
        (label::SOFT_TISSUE, SOFT, &seeds.soft_tissue),
        (label::OUTSIDE, EXCLUDE, &seeds.exclude),
    ];
    for (value, kind, points) in lists {
        for p in points {
            let n = grid.offset(voxel(scan.ct, kind, p)?);
            labels.data_mut()[n] = value;
        }
    }
    Ok(())
}

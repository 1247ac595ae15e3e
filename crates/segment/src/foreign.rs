//! What lies on the skin and is no patient: wires, clasps, electrodes, markers.

use crate::body::{Body, flag};
use crate::frame::Frame;
use crate::plane::near;
use rayon::prelude::*;
use supine_volume::{Ct, Parts};

/// Metal: above this level (docs/SEGMENTATION.md, step 1), smaller than this, and reaching as near
/// to the skin as no bone does (both chosen, not measured).
const METAL_HU: i16 = 500;
const METAL_CM3: f64 = 10.0;
const METAL_DEPTH_MM: f32 = 3.0;
/// As large a piece lies on the skin only where it touches the air, pixels: what is that large and
/// has skin over it was put there. Measured: copies of the port of breast-flt001 2 and 4 mm under
/// the skin of three other CTs had been taken off.
const METAL_LARGE_CM3: f64 = 1.0;
const METAL_TOUCHES: f32 = 1.5;
/// Gel and plastic, 100 to 200 HU (docs/SEGMENTATION.md, Traps): above this level, looked for this
/// deep; skin reaches it in spots.
const GEL_HU: i16 = 90;
const GEL_DEPTH_MM: f32 = 6.0;
/// Above this level, which no nipple reaches (with contrast medium about 110 HU and noise), lie
/// this volume (cm³) and this share of it. Chosen, not measured.
const GEL_CORE_HU: i16 = 130;
const GEL_CORE_CM3: f64 = 0.1;
const GEL_CORE_SHARE: f64 = 0.3;
/// At least this share of it lies in the outermost two pixels, where no bone is. Chosen, not
/// measured.
const GEL_SHARE: f64 = 0.3;
/// At least this share of it lies deeper than skin reaches: a sharp kernel makes skin itself as
/// dense. Measured on a real CT whose skin was taken for gel all round (184 cm³): 0.03; electrodes
/// and wires 0.4 and more. Skin is 1 to 3 mm thick.
const GEL_THICK_SHARE: f64 = 0.1;
const SKIN_MM: f32 = 3.0;

/// Takes dense objects on the skin off the body. True when there were any.
pub(crate) fn drop(ct: &Ct, frame: &Frame, body: &mut Body) -> bool {
    let mut slices = vec![false; frame.size[2]];
    let taken = drop_metal(ct, frame, body, &mut slices) + drop_gel(ct, frame, body, &mut slices);
    body.foreign_cm3 += taken as f64 * frame.voxel_cm3();
    if taken > 0 {
        drop_slivers(frame, &slices, &mut body.flags);
    }
    taken > 0
}

/// Takes metal and the pixels round it off; gives the voxels of metal.
fn drop_metal(ct: &Ct, frame: &Frame, body: &mut Body, slices: &mut [bool]) -> usize {
    let (flags, hu) = (&body.flags, ct.data());
    let dense = Parts::new(frame.size, |n| hu[n] > METAL_HU && flags[n] & flag::BODY != 0);
    let mut depth = vec![f32::INFINITY; dense.voxels.len()];
    for (run, part) in dense.iter() {
        depth[part] = run.voxels().map(|n| body.depth_mm(n)).fold(depth[part], f32::min);
    }
    let cm3 = |part: usize| dense.voxels[part] as f64 * frame.voxel_cm3();
    let on_skin = |part: usize| match cm3(part) {
        cm3 if cm3 >= METAL_CM3 => false,
        cm3 if cm3 > METAL_LARGE_CM3 => depth[part] < METAL_TOUCHES * frame.pixel(),
        _ => depth[part] < METAL_DEPTH_MM,
    };
    let [ni, nj, _] = frame.size;
    let mut taken = 0;
    for (run, part) in dense.iter() {
        if !on_skin(part) {
            continue;
        }
        taken += run.len;
        slices[run.start / (ni * nj)] = true;
        for n in run.voxels() {
            let (i, j) = (n % ni, n / ni % nj);
            for dj in 0..3 {
                for di in 0..3 {
                    if (1..=ni).contains(&(i + di)) && (1..=nj).contains(&(j + dj)) {
                        body.flags[n + di + dj * ni - ni - 1] &= !flag::BODY;
                    }
                }
            }
        }
    }
    taken
}

/// Takes what is denser than skin in the place of the skin off; gives its voxels.
fn drop_gel(ct: &Ct, frame: &Frame, body: &mut Body, slices: &mut [bool]) -> usize {
    let hu = ct.data();
    let outermost = 2.0 * frame.pixel();
    let parts = Parts::new(frame.size, |n| {
        hu[n] > GEL_HU && body.flags[n] & flag::BODY != 0 && body.depth_mm(n) < GEL_DEPTH_MM
    });
    let [mut shallow, mut core, mut deep] = [0; 3].map(|n| vec![n; parts.voxels.len()]);
    for (run, part) in parts.iter() {
        deep[part] += run.voxels().filter(|&n| body.depth_mm(n) > SKIN_MM).count();
        shallow[part] += run.voxels().filter(|&n| body.depth_mm(n) < outermost).count();
        core[part] += run.voxels().filter(|&n| hu[n] > GEL_CORE_HU).count();
    }
    let mut taken = 0;
    for (run, part) in parts.iter() {
        let (voxels, core) = (parts.voxels[part] as f64, core[part] as f64);
        let thick = deep[part] as f64 > GEL_THICK_SHARE * voxels;
        let dense = core * frame.voxel_cm3() > GEL_CORE_CM3 && core > GEL_CORE_SHARE * voxels;
        if dense && thick && shallow[part] as f64 > GEL_SHARE * voxels {
            taken += run.len;
            slices[run.start / frame.plane()] = true;
            run.voxels().for_each(|n| body.flags[n] &= !flag::BODY);
        }
    }
    taken
}

/// Opens the given slices by one pixel and keeps the largest part.
fn drop_slivers(frame: &Frame, slices: &[bool], flags: &mut [u8]) {
    let (ni, plane) = (frame.size[0], frame.plane());
    let reach = 1.01 * frame.spacing[0].max(frame.spacing[1]);
    let spacing = [frame.spacing[0], frame.spacing[1]];
    flags.par_chunks_mut(plane).enumerate().for_each(|(k, flags)| {
        if slices[k] {
            let off: Vec<bool> = flags.iter().map(|f| f & flag::BODY == 0).collect();
            let rim = near(&off, ni, spacing, reach);
            let core: Vec<bool> = rim.iter().map(|rim| !rim).collect();
            for (f, near) in flags.iter_mut().zip(near(&core, ni, spacing, reach)) {
                if !near {
                    *f &= !flag::BODY;
                }
            }
        }
    });
    let seen: &[u8] = flags;
    let parts = Parts::new(frame.size, |n| seen[n] & flag::BODY != 0);
    let largest = parts.largest();
    for (run, part) in parts.iter() {
        if Some(part) != largest {
            run.voxels().for_each(|n| flags[n] &= !flag::BODY);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Point, Vector};
    use supine_volume::Volume;

    /// Whether a block of metal 12 mm wide and `long` slices of 2 mm long is taken off, so many
    /// pixels of 0.8 mm under the skin.
    fn taken(under: usize, long: usize) -> bool {
        let spacing = Vector::new(0.8, 0.8, 2.0);
        let grid = Grid::new([200, 200, 40], spacing, Point::origin(), Matrix::identity()).unwrap();
        let metal = |[i, j, k]: [usize; 3]| {
            (20..35).contains(&i)
                && (10 + under..20 + under).contains(&j)
                && (4..4 + long).contains(&k)
        };
        let ct: Ct = Volume::from_fn(grid.clone(), |v| if metal(v) { 3000 } else { -100 });
        let frame = Frame::new(&grid).unwrap();
        let flags = (0..grid.len()).map(|n| if grid.voxel(n)[1] < 10 { 0 } else { flag::BODY });
        let mut body = Body::new(&frame, flags.collect(), vec![true; frame.plane()], 3.0);
        drop(&ct, &frame, &mut body)
    }

    #[test]
    fn what_is_as_large_as_a_port_is_taken_off_only_where_it_touches_the_air() {
        assert!(taken(0, 6) && !taken(3, 6), "1.2 ml");
        assert!(taken(0, 2) && taken(3, 2) && !taken(5, 2), "0.4 ml");
    }
}

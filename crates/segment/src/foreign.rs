//! What lies on the skin and is no patient: wires, clasps, electrodes, markers.

use crate::body::{Body, Device, flag};
use crate::frame::Frame;
use crate::plane::near;
use rayon::prelude::*;
use supine_space::Vector;
use supine_volume::{Ct, Parts, Run, quantile};

/// Metal: above this level (docs/SEGMENTATION.md, step 1) and smaller than this (chosen, not
/// measured).
const METAL_HU: i16 = 500;
const METAL_CM3: f64 = 10.0;
/// It lies on the skin where this share of its outline, seen from the air, has no more than a pixel
/// or so of what is less dense before it: that much the blur makes, and no skin is that thin. In
/// pixels and mm, whichever is more. Measured: at most 0.9 pixels at the wires and clasps of
/// breast-flt013 and rider0109; 1.4 pixels and 2 mm at least at copies of the port of breast-flt001,
/// whole and down to a quarter of its length, 1 mm under the skin of four other CTs.
const TOUCHING_SHARE: f64 = 0.1;
const TOUCHES_PIXELS: f32 = 1.1;
const TOUCHES_MM: f32 = 1.2;
/// And half of its outline has no more than this before it (chosen, not measured): else it lies under the skin and a
/// wire leads out of it, as the needle of a port that is in use.
const HALF_WITHIN_MM: f32 = 3.0;
/// Or it is covered, by cloth or plastic, and so near to the air, mm (chosen, not measured) ...
const COVERED_MM: f32 = 3.0;
/// ... and this share of it stands proud of the skin around it: it is left out by a disc of this
/// radius (mm) that is rolled within the patient. Measured: 0 at those copies, under skin without a
/// bump; the bump over a port is wider.
const PROUD_SHARE: f64 = 0.5;
const DISC_MM: f32 = 10.0;
/// Metal and gel of this volume that were taken off are told, ml, those whose middles lie nearer to
/// each other than this (mm) as one: as much as makes a device under the skin (`devices`).
const TOLD_ML: f64 = 0.1;
const ONE_MM: f64 = 40.0;
/// Gel and plastic, 100 to 200 HU (docs/SEGMENTATION.md, Traps): above this level, looked for this
/// deep; skin reaches it in spots.
const GEL_HU: i16 = 90;
const GEL_DEPTH_MM: f32 = 6.0;
/// Above this level, which a nipple reaches in noise only, lie this volume (cm³; chosen, not
/// measured) and this share of it. Measured: a nipple of breast-lidc0314, full of contrast medium,
/// and its thick skin have 0.47 at most, on all slices and on every second and third; an electrode
/// of 160 HU has 0.7.
const GEL_CORE_HU: i16 = 130;
const GEL_CORE_CM3: f64 = 0.1;
const GEL_CORE_SHARE: f64 = 0.5;
/// At least this share of it lies in the outermost two pixels, where no bone is. Chosen, not
/// measured.
const GEL_SHARE: f64 = 0.3;
/// At least this share of it lies deeper than skin reaches: a sharp kernel makes skin itself as
/// dense. Measured on a real CT whose skin was taken for gel all round (184 cm³): 0.03; electrodes
/// and wires 0.4 and more. Skin is 1 to 3 mm thick.
const GEL_THICK_SHARE: f64 = 0.1;
const SKIN_MM: f32 = 3.0;

/// Takes dense objects on the skin off the body, which notes the larger ones. True when there were
/// any.
pub(crate) fn drop(ct: &Ct, frame: &Frame, body: &mut Body) -> bool {
    let mut taken = Taken { slices: vec![false; frame.size[2]], ..Taken::default() };
    drop_metal(ct, frame, body, &mut taken);
    drop_gel(ct, frame, body, &mut taken);
    if taken.voxels == 0 {
        return false;
    }
    body.foreign_cm3 += taken.voxels as f64 * frame.voxel_cm3();
    drop_slivers(frame, &taken.slices, &mut body.flags);
    body.left_off = taken.told();
    true
}

/// What was taken off.
#[derive(Default)]
struct Taken {
    /// By slice, whether anything was.
    slices: Vec<bool>,
    voxels: usize,
    objects: Vec<Device>,
}

impl Taken {
    /// Notes the parts for which `on_skin` holds.
    fn add(&mut self, ct: &Ct, frame: &Frame, parts: &Parts, on_skin: &[bool]) {
        let mut sums = vec![Vector::zeros(); on_skin.len()];
        for (run, part) in parts.iter().filter(|(_, part)| on_skin[*part]) {
            self.slices[run.start / frame.plane()] = true;
            let [i, j, k] = ct.grid().voxel(run.start).map(|n| n as f64);
            let middle = Vector::new(i + 0.5 * (run.len - 1) as f64, j, k);
            sums[part] += run.len as f64 * middle;
        }
        for part in (0..on_skin.len()).filter(|&part| on_skin[part]) {
            let voxels = parts.voxels[part];
            let middle = ct.grid().patient_from_index((sums[part] / voxels as f64).into());
            self.voxels += voxels;
            self.objects.push(Device { ml: voxels as f64 * frame.voxel_cm3(), middle });
        }
    }

    /// The objects that are large enough to be told, largest first; what lies together is one.
    fn told(self) -> Vec<Device> {
        let mut out: Vec<Device> = Vec::new();
        let mut objects = self.objects;
        objects.sort_by(|a, b| b.ml.total_cmp(&a.ml));
        for Device { ml, middle } in objects {
            match out.iter_mut().find(|one| (one.middle - middle).norm() < ONE_MM) {
                Some(one) => one.ml += ml,
                None => out.push(Device { ml, middle }),
            }
        }
        out.retain(|one| one.ml >= TOLD_ML);
        out.sort_by(|a, b| b.ml.total_cmp(&a.ml));
        out
    }
}

/// Takes metal and the pixels round it off.
fn drop_metal(ct: &Ct, frame: &Frame, body: &mut Body, taken: &mut Taken) {
    let (flags, hu) = (&body.flags, ct.data());
    let dense = Parts::new(frame.size, |n| hu[n] > METAL_HU && flags[n] & flag::BODY != 0);
    let on_skin = metal_on_skin(ct, frame, body, &dense);
    taken.add(ct, frame, &dense, &on_skin);
    let [ni, nj, _] = frame.size;
    for (run, part) in dense.iter() {
        if !on_skin[part] {
            continue;
        }
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
}

/// Of each part of metal, whether it lies on the skin.
fn metal_on_skin(ct: &Ct, frame: &Frame, body: &Body, dense: &Parts) -> Vec<bool> {
    let small = |part: usize| (dense.voxels[part] as f64 * frame.voxel_cm3()) < METAL_CM3;
    let mut depth = vec![f32::INFINITY; dense.voxels.len()];
    for (run, part) in dense.iter().filter(|(_, part)| small(*part)) {
        depth[part] = run.voxels().map(|n| body.depth_mm(n)).fold(depth[part], f32::min);
    }
    let near_air = |part: usize| depth[part] < COVERED_MM;
    let mut outlines = vec![Vec::new(); dense.voxels.len()];
    for (run, part) in dense.iter().filter(|(_, part)| near_air(*part)) {
        let outline = run.voxels().filter(|&n| faces_air(ct, frame, body, n));
        outlines[part].extend(outline.map(|n| body.depth_mm(n)));
    }
    let proud = proud(frame, body, dense, near_air);
    let touches = TOUCHES_MM.max(TOUCHES_PIXELS * frame.pixel());
    let within = |outline: &mut [f32], share: f64, most: f32| {
        quantile(outline, share).is_some_and(|mm| mm <= most)
    };
    let on_skin = |(part, outline): (usize, &mut Vec<f32>)| {
        within(outline, TOUCHING_SHARE, touches) && within(outline, 0.5, HALF_WITHIN_MM)
            || proud[part] as f64 > PROUD_SHARE * dense.voxels[part] as f64
    };
    outlines.iter_mut().enumerate().map(on_skin).collect()
}

/// Whether a voxel of metal has one beside it in its slice that is none and nearer to the air.
fn faces_air(ct: &Ct, frame: &Frame, body: &Body, n: usize) -> bool {
    let [ni, nj, _] = frame.size;
    let (i, j) = (n % ni, n / ni % nj);
    let faces =
        |n: usize, m: usize| ct.data()[m] <= METAL_HU && body.depth_mm(m) < body.depth_mm(n);
    i > 0 && faces(n, n - 1)
        || i + 1 < ni && faces(n, n + 1)
        || j > 0 && faces(n, n - ni)
        || j + 1 < nj && faces(n, n + ni)
}

/// How many voxels of each part for which `counts` holds stand proud of the skin around it.
fn proud(frame: &Frame, body: &Body, parts: &Parts, counts: impl Fn(usize) -> bool) -> Vec<usize> {
    let (plane, spacing) = (frame.plane(), [frame.spacing[0], frame.spacing[1]]);
    let mut out = vec![0; parts.voxels.len()];
    // The runs of a slice follow each other.
    let runs: Vec<(Run, usize)> = parts.iter().filter(|(_, part)| counts(*part)).collect();
    for runs in runs.chunk_by(|(a, _), (b, _)| a.start / plane == b.start / plane) {
        let start = runs[0].0.start / plane * plane;
        let middles: Vec<bool> =
            (start..start + plane).map(|n| body.depth_mm(n) > DISC_MM).collect();
        let held = near(&middles, frame.size[0], spacing, DISC_MM);
        for (run, part) in runs {
            out[*part] += run.voxels().filter(|n| !held[n - start]).count();
        }
    }
    out
}

/// Takes what is denser than skin in the place of the skin off.
fn drop_gel(ct: &Ct, frame: &Frame, body: &mut Body, taken: &mut Taken) {
    let hu = ct.data();
    let outermost = 2.0 * frame.pixel();
    let parts = Parts::new(frame.size, |n| {
        hu[n] > GEL_HU && body.flags[n] & flag::BODY != 0 && body.depth_mm(n) < GEL_DEPTH_MM
    });
    let [mut shallow, mut core, mut deep] = [0; 3].map(|n| vec![n; parts.voxels.len()]);
    // What is left of metal lies under the skin, and what is joined to it is its rim.
    let mut of_metal = vec![false; parts.voxels.len()];
    for (run, part) in parts.iter() {
        of_metal[part] |= run.voxels().any(|n| hu[n] > METAL_HU);
        deep[part] += run.voxels().filter(|&n| body.depth_mm(n) > SKIN_MM).count();
        shallow[part] += run.voxels().filter(|&n| body.depth_mm(n) < outermost).count();
        core[part] += run.voxels().filter(|&n| hu[n] > GEL_CORE_HU).count();
    }
    let is_gel = |part: usize| {
        let (voxels, core) = (parts.voxels[part] as f64, core[part] as f64);
        let thick = deep[part] as f64 > GEL_THICK_SHARE * voxels;
        let dense = core * frame.voxel_cm3() > GEL_CORE_CM3 && core > GEL_CORE_SHARE * voxels;
        !of_metal[part] && dense && thick && shallow[part] as f64 > GEL_SHARE * voxels
    };
    let gel: Vec<bool> = (0..parts.voxels.len()).map(is_gel).collect();
    taken.add(ct, frame, &parts, &gel);
    for (run, _) in parts.iter().filter(|(_, part)| gel[*part]) {
        run.voxels().for_each(|n| body.flags[n] &= !flag::BODY);
    }
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

    /// A body of pixels of 0.8 mm and slices of 2 mm where `inside` holds, as dense as `hu` says:
    /// what is taken off it and told, ml.
    fn taken(inside: impl Fn([usize; 3]) -> bool, hu: impl Fn([usize; 3]) -> i16) -> Option<f64> {
        let spacing = Vector::new(0.8, 0.8, 2.0);
        let grid = Grid::new([200, 200, 40], spacing, Point::origin(), Matrix::identity()).unwrap();
        let ct: Ct = Volume::from_fn(grid.clone(), hu);
        let frame = Frame::new(&grid).unwrap();
        let flags = (0..grid.len()).map(|n| if inside(grid.voxel(n)) { flag::BODY } else { 0 });
        let mut body = Body::new(&frame, flags.collect(), vec![true; frame.plane()], 3.0);
        drop(&ct, &frame, &mut body).then(|| body.left_off.iter().map(|one| one.ml).sum())
    }

    /// Metal where that holds, in fat.
    fn metal(there: impl Fn([usize; 3]) -> bool) -> impl Fn([usize; 3]) -> i16 {
        move |v| if there(v) { 3000 } else { -100 }
    }

    fn flat([_, j, _]: [usize; 3]) -> bool {
        j >= 40
    }

    /// A block 12 mm wide and 8 mm high, so many pixels under its top surface and slices long.
    fn block(top: usize, under: usize, long: usize) -> impl Fn([usize; 3]) -> bool {
        move |[i, j, k]| {
            (90..105).contains(&i)
                && (top + under..top + 10 + under).contains(&j)
                && (4..4 + long).contains(&k)
        }
    }

    #[test]
    fn metal_of_any_size_is_taken_off_where_it_touches_the_air_and_not_under_skin() {
        for (long, ml) in [(1, 0.19), (2, 0.38), (6, 1.15)] {
            let off = taken(flat, metal(block(40, 0, long))).unwrap();
            assert!((off - ml).abs() < 0.01, "{off}");
            // Skin of 1.6 mm.
            assert_eq!(taken(flat, metal(block(40, 2, long))), None, "{ml} ml");
        }
    }

    #[test]
    fn a_port_under_a_bump_of_skin_is_not_taken_off_and_a_covered_bead_on_it_is() {
        // A bump 8 mm high and 45 mm wide, as over a port in a thin patient.
        let bump = |[i, j, _]: [usize; 3]| {
            let off = ((i as f64 - 97.0) / 28.0).clamp(-1.0, 1.0);
            j as f64 >= 40.0 - 5.0 * (1.0 + (std::f64::consts::PI * off).cos())
        };
        // 4 mm of skin and fat over its middle, 2.4 over its corners.
        for long in [2, 6] {
            assert_eq!(taken(bump, metal(block(30, 5, long))), None);
        }
        // A bead of 5 mm on the skin under 2.4 mm of plastic.
        let near = |[i, j, k]: [usize; 3], r: f64| {
            (5..8).contains(&k) && (i as f64 - 97.0).hypot(j as f64 - 36.0) < r
        };
        let covered = |v: [usize; 3]| v[1] >= 40 || near(v, 6.0);
        assert!(taken(covered, metal(|v| near(v, 3.0))).is_some());
    }

    #[test]
    fn a_port_with_a_needle_through_the_skin_and_its_line_on_it_stays() {
        let port = block(40, 6, 8);
        let needle =
            |[i, j, k]: [usize; 3]| (96..98).contains(&i) && (40..48).contains(&j) && k == 8;
        let line = |[i, j, k]: [usize; 3]| (60..98).contains(&i) && (40..42).contains(&j) && k == 8;
        assert_eq!(taken(flat, metal(|v| port(v) || needle(v) || line(v))), None);
        assert!(taken(flat, metal(line)).is_some(), "the line alone");
    }

    #[test]
    fn gel_is_taken_off_and_a_nipple_as_dense_as_contrast_medium_in_noise_makes_it_is_not() {
        // Noise of 20 HU (standard deviation) with a flat histogram, the same in every run.
        let of = |hu: i16| {
            let place = |[i, j, k]: [usize; 3]| {
                (90..105).contains(&i) && (40..45).contains(&j) && (4..14).contains(&k)
            };
            move |[i, j, k]: [usize; 3]| {
                let noise = ((i * 7_919 + j * 104_729 + k * 1_299_709) % 71) as i16 - 35;
                if place([i, j, k]) { hu + noise } else { -100 }
            }
        };
        assert!(taken(flat, of(160)).is_some());
        assert_eq!(taken(flat, of(118)), None);
    }
}

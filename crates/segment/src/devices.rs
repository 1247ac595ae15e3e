//! Metal devices under the skin: ports, pacemakers, the valves of expanders.
//!
//! They are as dense as bone, and as joined to it by their streaks as ribs are to each other: both
//! would draw the chest wall out to the skin. What follows sees them as fat, so that the wall ends
//! behind them.

use crate::body::{Body, Device, flag};
use crate::frame::Frame;
use crate::implant::{FATTY_HU, RIM_MM as BLUR_MM, filled};
use crate::lung_hull::{Hull, to_back};
use crate::plane::near;
use std::collections::BTreeSet;
use std::sync::Arc;
use supine_space::Point;
use supine_volume::{Ct, Parts, Run, Volume, distance_mm};

// Measured on the port of breast-flt001 and on what is as dense in the chests of five other CTs,
// unless a reason is given.
/// Metal: no bone of the trunk of six CTs is as dense over this volume, cm³; what else is, are
/// veins full of contrast medium.
const CORE_HU: i16 = 1800;
const CORE_CM3: f64 = 0.1;
/// The device is what is denser than this so near to its core, mm: its housing of plastic, and its
/// streaks.
const RIM_HU: i16 = 150;
const RIM_MM: f32 = 8.0;
/// From there so far around, mm, at most this share is as dense: 0.01 round the port, 0.1 round one
/// on the ribs of a thin phantom, 0.2 and more round teeth and fillings. Wires round a breastbone
/// that was opened lie in bone, too.
const AROUND_MM: f32 = 16.0;
const DENSE_SHARE: f64 = 0.2;
/// It reaches as near to the skin, mm: devices are made to be felt through it. The port lies 7
/// deep, no vein less than 25.
const DEPTH_MM: f32 = 15.0;
/// Pacemakers have up to 35 cm³; bones and beds of metal have more. Chosen, not measured.
const MOST_CM3: f64 = 60.0;
/// Parts of metal whose middles lie nearer to each other are one device, mm. Chosen, not measured.
const ONE_MM: f64 = 40.0;

/// The CT in which devices under the skin of the front are filled with this patient's fat; what was
/// found goes into the body.
pub(crate) fn as_fat(ct: Arc<Ct>, frame: &Frame, body: &mut Body) -> Arc<Ct> {
    let parts = Parts::new(frame.size, |n| is_core(&ct, body, n));
    let ml = |part: usize| parts.voxels[part] as f64 * frame.voxel_cm3();
    let large = |part: &usize| (CORE_CM3..=MOST_CM3).contains(&ml(*part));
    let mut runs: Vec<Vec<Run>> = vec![Vec::new(); parts.voxels.len()];
    parts.iter().for_each(|(run, part)| runs[part].push(run));
    let metal: Vec<Metal> = (0..runs.len())
        .filter(large)
        .filter_map(|part| around(&ct, frame, body, &runs[part]))
        .collect();
    let device_parts = under_skin(metal);
    if device_parts.is_empty() {
        return ct;
    }
    let all: BTreeSet<usize> = device_parts.iter().flatten().copied().collect();
    body.devices = devices(&ct, frame, &device_parts);
    let blurred = blurred(&ct, frame, body, &all);
    filled(ct, body, all.into_iter(), blurred.into_iter())
}

/// A core with what is round it, where no bone is.
struct Metal {
    voxels: Vec<usize>,
    middle: Point,
    /// How near to the skin it reaches, mm.
    depth_mm: f32,
}

/// The parts of metal near the skin, and the deeper ones that make up a device with these.
fn under_skin(metal: Vec<Metal>) -> Vec<Vec<usize>> {
    let near = |part: &Metal| part.depth_mm <= DEPTH_MM;
    let shallow: Vec<Point> = metal.iter().filter(|part| near(part)).map(|m| m.middle).collect();
    let of_one = |at: &Point| shallow.iter().any(|other| (other - at).norm() < ONE_MM);
    metal.into_iter().filter(|part| of_one(&part.middle)).map(|part| part.voxels).collect()
}

fn is_core(ct: &Ct, body: &Body, n: usize) -> bool {
    ct.data()[n] > CORE_HU && body.flags[n] & flag::BODY != 0
}

/// The metal round a core; `None` when it is bone.
fn around(ct: &Ct, frame: &Frame, body: &Body, core: &[Run]) -> Option<Metal> {
    let (grid, hu) = (ct.grid(), ct.data());
    let ends = core.iter().flat_map(|run| [run.start, run.start + run.len - 1]);
    let (mut low, mut high) = (frame.size, [0; 3]);
    for voxel in ends.map(|n| grid.voxel(n)) {
        for a in 0..3 {
            let reach = (AROUND_MM / frame.spacing[a]).ceil() as usize;
            low[a] = low[a].min(voxel[a].saturating_sub(reach));
            high[a] = high[a].max((voxel[a] + reach + 1).min(frame.size[a]));
        }
    }
    let part = grid.crop(low, [0, 1, 2].map(|a| high[a] - low[a])).ok()?;
    let place = |[i, j, k]: [usize; 3]| grid.offset([i + low[0], j + low[1], k + low[2]]);
    let own: BTreeSet<usize> = core.iter().flat_map(|run| run.voxels()).collect();
    let from_own = distance_mm(&Volume::from_fn(part.clone(), |v| own.contains(&place(v))));
    let from_any = distance_mm(&Volume::from_fn(part.clone(), |v| is_core(ct, body, place(v))));
    let hulls: Vec<Option<Hull>> =
        (low[2]..high[2]).map(|k| Hull::new(frame, body.flags_slice(frame, k))).collect();
    let in_front = |n: usize| {
        let (k, pixel) = (n / frame.plane(), n % frame.plane());
        let hull = hulls[k - low[2]].as_ref();
        hull.is_some_and(|hull| !hull.inside[pixel] && to_back(frame, pixel) < hull.middle)
    };
    let (mut device, mut shallowest) = (Vec::new(), f32::INFINITY);
    let (mut near, mut dense) = (0usize, 0usize);
    for v in 0..part.len() {
        let n = place(part.voxel(v));
        if body.flags[n] & flag::BODY == 0 || from_own.data()[v] > AROUND_MM {
            continue;
        }
        if from_own.data()[v] > RIM_MM {
            let beside = usize::from(from_any.data()[v] > RIM_MM);
            near += beside;
            dense += beside * usize::from(hu[n] > RIM_HU);
        } else if hu[n] > RIM_HU {
            if from_own.data()[v] == 0.0 && !in_front(n) {
                return None;
            }
            device.push(n);
            shallowest = shallowest.min(body.depth_mm(n));
        }
    }
    let apart = dense as f64 <= DENSE_SHARE * near as f64;
    let small = device.len() as f64 * frame.voxel_cm3() <= MOST_CM3;
    let middle = middle(ct, device.iter());
    (apart && small).then_some(Metal { voxels: device, middle, depth_mm: shallowest })
}

/// What the parts of metal make up: parts beside each other are one device, a voxel of two counts
/// once.
fn devices(ct: &Ct, frame: &Frame, found: &[Vec<usize>]) -> Vec<Device> {
    let mut devices: Vec<(BTreeSet<usize>, Point)> = Vec::new();
    for part in found {
        let middle = middle(ct, part.iter());
        match devices.iter_mut().find(|(_, at)| (*at - middle).norm() < ONE_MM) {
            Some((voxels, _)) => voxels.extend(part),
            None => devices.push((part.iter().copied().collect(), middle)),
        }
    }
    let device = |(voxels, _): (BTreeSet<usize>, Point)| Device {
        ml: voxels.len() as f64 * frame.voxel_cm3(),
        middle: middle(ct, voxels.iter()),
    };
    devices.into_iter().map(device).collect()
}

fn middle<'a>(ct: &Ct, voxels: impl ExactSizeIterator<Item = &'a usize>) -> Point {
    let count = voxels.len().max(1) as f64;
    let sum = voxels.fold([0.0; 3], |sum, n| {
        let voxel = ct.grid().voxel(*n);
        [0, 1, 2].map(|a| sum[a] + voxel[a] as f64 / count)
    });
    ct.grid().patient_from_index(sum)
}

/// The voxels between a device and the fat beside it, whose mean with the metal looks like muscle.
fn blurred(ct: &Ct, frame: &Frame, body: &Body, device: &BTreeSet<usize>) -> Vec<usize> {
    let (plane, spacing) = (frame.plane(), [frame.spacing[0], frame.spacing[1]]);
    let slices: BTreeSet<usize> = device.iter().map(|n| n / plane).collect();
    let of_slice = |k: usize| {
        let on: Vec<bool> = (0..plane).map(|n| device.contains(&(k * plane + n))).collect();
        let hu = &ct.data()[k * plane..(k + 1) * plane];
        let fatty: Vec<bool> = hu.iter().map(|&hu| f32::from(hu) < FATTY_HU).collect();
        let [at_device, at_fat] = [&on, &fatty].map(|on| near(on, frame.size[0], spacing, BLUR_MM));
        let inside = move |n: &usize| at_device[*n] && at_fat[*n];
        let voxels = (0..plane).filter(inside).map(move |n| k * plane + n);
        voxels.filter(|&n| body.flags[n] & flag::BODY != 0).collect::<Vec<_>>()
    };
    slices.into_iter().flat_map(of_slice).collect()
}

//! Lung and bone in what labels call soft tissue.

use supine_space::{Point, Vector, Warning};
use supine_volume::{Ct, LabelMap, Parts, label};

// Chosen, not measured, unless a reason is given.
/// Below is lung, or an air cavity, HU: partial volume of skin and of the pleura stays above.
const LUNG_HU: i16 = -600;
/// Above is bone, HU (as in a breast's region).
const BONE_HU: i16 = 200;
/// Volumes that warn, ml: a rim of partial volume holds less lung, a clip or a calcification less bone.
const LUNG_ML: f64 = 0.1;
const BONE_ML: f64 = 1.0;

/// Warnings of lung and bone within the soft tissue, with the volume of all and the place of the largest piece.
pub(crate) fn inclusions(ct: &Ct, labels: &LabelMap) -> Vec<Warning> {
    let hu = ct.data();
    let soft = |n: usize| label::is_soft_tissue(labels.data()[n]);
    let lung = largest(labels, |n| soft(n) && hu[n] < LUNG_HU, true, LUNG_ML);
    let bone = largest(labels, |n| soft(n) && hu[n] > BONE_HU, false, BONE_ML);
    let told = |code: &'static str, what: &str, (ml, at): (f64, Point)| {
        let text = format!(
            "the soft tissue of the labels holds {ml:.1} ml {what}, the largest piece at {:.0} {:.0} {:.0} mm; correct the labels \
             there where it is none of the breast",
            at.x, at.y, at.z
        );
        Warning::new(code, text).value("volume_ml", ml)
    };
    let lung =
        lung.map(|found| told("labels-lung-in-soft-tissue", "of lung or enclosed air", found));
    let bone = bone.map(|found| told("labels-bone-in-soft-tissue", "as dense as bone", found));
    lung.into_iter().chain(bone).collect()
}

/// Volume of the pieces of at least `least` ml, and the middle of the largest of them; of air that touches the outside none
/// counts when `enclosed` is asked for.
fn largest(
    labels: &LabelMap,
    test: impl Fn(usize) -> bool + Sync,
    enclosed: bool,
    least: f64,
) -> Option<(f64, Point)> {
    let grid = labels.grid();
    let [ni, nj, nk] = grid.size();
    let parts = Parts::new(grid.size(), test);
    let outside = |[i, j, k]: [usize; 3]| {
        let open = |v: [usize; 3]| labels.at(v) == label::OUTSIDE;
        i > 0 && open([i - 1, j, k])
            || i + 1 < ni && open([i + 1, j, k])
            || j > 0 && open([i, j - 1, k])
            || j + 1 < nj && open([i, j + 1, k])
            || k > 0 && open([i, j, k - 1])
            || k + 1 < nk && open([i, j, k + 1])
    };
    let mut sums = vec![(Vector::zeros(), enclosed); parts.voxels.len()];
    for (run, part) in parts.iter() {
        for n in run.voxels() {
            let (sum, within) = &mut sums[part];
            *sum += grid.centre(grid.voxel(n)).coords;
            *within &= enclosed && !outside(grid.voxel(n));
        }
    }
    let ml = |part: usize| parts.voxels[part] as f64 * grid.voxel_volume() / 1000.0;
    let counts = |&part: &usize| ml(part) >= least && (!enclosed || sums[part].1);
    let found: Vec<usize> = (0..sums.len()).filter(counts).collect();
    let most = *found.iter().max_by_key(|&&part| (parts.voxels[part], usize::MAX - part))?;
    let middle = sums[most].0 / parts.voxels[most] as f64;
    Some((found.iter().map(|&part| ml(part)).sum(), Point::from(middle)))
}

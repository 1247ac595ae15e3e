//! Lung and bone in what labels call soft tissue.

use crate::pieces::{Amount, amount};
use supine_space::Warning;
use supine_volume::{Ct, LabelMap, Parts, label};

// Chosen, not measured, unless a reason is given.
/// Below is lung, or an air cavity, HU: partial volume of skin and of the pleura stays above.
const LUNG_HU: i16 = -600;
/// Above is bone, HU (as in a breast's region).
const BONE_HU: i16 = 200;
/// Volumes that warn, ml: a rim of partial volume holds less lung, a clip or a calcification less
/// bone.
const LUNG_ML: f64 = 0.1;
const BONE_ML: f64 = 1.0;

/// Warnings of lung and bone within the soft tissue, with the volume of all and the place of the
/// largest piece.
pub(crate) fn inclusions(ct: &Ct, labels: &LabelMap) -> Vec<Warning> {
    let hu = ct.data();
    let soft = |n: usize| label::is_soft_tissue(labels.data()[n]);
    let lung = Parts::new(labels.grid().size(), |n| soft(n) && hu[n] < LUNG_HU);
    let within = enclosed(labels, &lung);
    let lung = amount(&lung, labels.grid(), LUNG_ML, |_, part| within[part]);
    let bone = Parts::new(labels.grid().size(), |n| soft(n) && hu[n] > BONE_HU);
    let bone = amount(&bone, labels.grid(), BONE_ML, |_, _| true);
    let told = |code: &'static str, what: &str, Amount { ml, middle: at, .. }: Amount| {
        let text = format!(
            "the soft tissue of the labels holds {ml:.1} ml {what}, the largest piece at {:.0} {:.0} {:.0} mm; correct the labels \
             there where it is none of the breast",
            at.x, at.y, at.z
        );
        (ml > 0.0).then(|| Warning::new(code, text).value("volume_ml", ml))
    };
    let lung = told("labels-lung-in-soft-tissue", "of lung or enclosed air", lung);
    let bone = told("labels-bone-in-soft-tissue", "as dense as bone", bone);
    lung.into_iter().chain(bone).collect()
}

/// Lung and air count that are enclosed: what touches the outside of the labels is none.
fn enclosed(labels: &LabelMap, parts: &Parts) -> Vec<bool> {
    let grid = labels.grid();
    let [ni, nj, nk] = grid.size();
    let outside = |[i, j, k]: [usize; 3]| {
        let open = |v: [usize; 3]| labels.at(v) == label::OUTSIDE;
        i > 0 && open([i - 1, j, k])
            || i + 1 < ni && open([i + 1, j, k])
            || j > 0 && open([i, j - 1, k])
            || j + 1 < nj && open([i, j + 1, k])
            || k > 0 && open([i, j, k - 1])
            || k + 1 < nk && open([i, j, k + 1])
    };
    let mut out = vec![true; parts.voxels.len()];
    for (run, part) in parts.iter() {
        out[part] = out[part] && !run.voxels().any(|n| outside(grid.voxel(n)));
    }
    out
}

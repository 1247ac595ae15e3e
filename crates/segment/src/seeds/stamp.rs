//! What the seeds ask of the labels: no surface and no interpolation overrules a seed.

use super::marks::{Mark, NEAR_SKIN_MM, ball};
use crate::body::flag;
use crate::scan::Scan;
use supine_volume::{LabelMap, Parts, SeedKind, label};

/// Radius round an exclude point that is taken off the body, mm. Chosen, not measured.
const EXCLUDE_MM: f32 = 3.0;

/// Takes what is excluded off the patient, and what hung on her by it alone; adds what soft-tissue
/// seeds tell beside the skin; and gives the voxels of all seeds their labels.
pub(crate) fn stamp(scan: Scan<'_>, labels: &mut LabelMap, marks: &[Mark]) {
    exclude(scan, labels, marks);
    let flags = &scan.body.flags;
    let points = marks.iter().filter(|m| m.kind == SeedKind::SoftTissue && !m.painted);
    for mark in points.filter(|m| flags[m.voxel] & flag::BODY == 0) {
        ball(scan, mark.voxel, NEAR_SKIN_MM, |n| {
            if flags[n] & (flag::BODY | flag::OPEN_AIR) == 0 {
                labels.data_mut()[n] = label::SOFT_TISSUE;
            }
        });
    }
    for mark in marks {
        labels.data_mut()[mark.voxel] = match mark.kind {
            SeedKind::ChestWall => label::CHEST_WALL,
            SeedKind::SoftTissue => label::SOFT_TISSUE,
            SeedKind::Exclude => label::OUTSIDE,
        };
    }
}

fn exclude(scan: Scan<'_>, labels: &mut LabelMap, marks: &[Mark]) {
    let mut taken = Vec::new();
    for mark in marks.iter().filter(|m| m.kind == SeedKind::Exclude) {
        let radius = if mark.painted { 0.0 } else { EXCLUDE_MM };
        ball(scan, mark.voxel, radius, |n| {
            labels.data_mut()[n] = label::OUTSIDE;
            taken.push(n);
        });
    }
    if taken.is_empty() {
        return;
    }
    let parts = Parts::new(scan.frame.size, |n| labels.data()[n] != label::OUTSIDE);
    let part_at = |n: usize| {
        let run = parts.runs.partition_point(|r| r.start <= n).checked_sub(1)?;
        parts.runs[run].voxels().contains(&n).then(|| parts.part[run])
    };
    let [ni, nj, nk] = scan.frame.size;
    let mut loose = vec![false; parts.voxels.len()];
    for n in taken {
        let (i, j, k) = (n % ni, n / ni % nj, n / (ni * nj));
        let near = [
            (i > 0).then(|| n - 1),
            (i + 1 < ni).then(|| n + 1),
            (j > 0).then(|| n - ni),
            (j + 1 < nj).then(|| n + ni),
            (k > 0).then(|| n - ni * nj),
            (k + 1 < nk).then(|| n + ni * nj),
        ];
        near.into_iter().flatten().filter_map(part_at).for_each(|part| loose[part] = true);
    }
    if let Some(largest) = parts.largest() {
        loose[largest] = false;
    }
    for (run, _) in parts.iter().filter(|(_, part)| loose[*part]) {
        labels.data_mut()[run.voxels()].fill(label::OUTSIDE);
    }
}

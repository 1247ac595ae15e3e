//! What the seeds ask of the labels: no surface and no interpolation overrules a seed.

use super::marks::{Mark, NEAR_SKIN_MM, ball};
use crate::body::flag;
use crate::scan::Scan;
use supine_space::Warning;
use supine_volume::{LabelMap, Parts, SeedKind, label};

/// Radius round an exclude point that is taken off the body, mm. Chosen, not measured.
const EXCLUDE_MM: f32 = 3.0;

/// Takes what is excluded off the patient, and what hung on her by it alone; adds what soft-tissue
/// seeds tell beside the skin; and gives the voxels of all seeds their labels. Tells of what had no
/// effect.
pub(crate) fn stamp(scan: Scan<'_>, labels: &mut LabelMap, marks: &[Mark]) -> Vec<Warning> {
    let warnings = exclude(scan, labels, marks);
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
    warnings
}

fn exclude(scan: Scan<'_>, labels: &mut LabelMap, marks: &[Mark]) -> Vec<Warning> {
    let excluded: Vec<&Mark> = marks.iter().filter(|m| m.kind == SeedKind::Exclude).collect();
    let mut taken = Vec::new();
    for (m, mark) in excluded.iter().enumerate() {
        let radius = if mark.painted { 0.0 } else { EXCLUDE_MM };
        ball(scan, mark.voxel, radius, |n| {
            labels.data_mut()[n] = label::OUTSIDE;
            taken.push((n, m));
        });
    }
    if taken.is_empty() {
        return Vec::new();
    }
    let parts = Parts::new(scan.frame.size, |n| labels.data()[n] != label::OUTSIDE);
    let part_at = |n: usize| {
        let run = parts.runs.partition_point(|r| r.start <= n).checked_sub(1)?;
        parts.runs[run].voxels().contains(&n).then(|| parts.part[run])
    };
    let [ni, nj, nk] = scan.frame.size;
    let mut loose = vec![false; parts.voxels.len()];
    // By excluded mark.
    let mut beside = vec![Vec::new(); excluded.len()];
    for (n, m) in taken {
        let (i, j, k) = (n % ni, n / ni % nj, n / (ni * nj));
        let near = [
            (i > 0).then(|| n - 1),
            (i + 1 < ni).then(|| n + 1),
            (j > 0).then(|| n - ni),
            (j + 1 < nj).then(|| n + ni),
            (k > 0).then(|| n - ni * nj),
            (k + 1 < nk).then(|| n + ni * nj),
        ];
        for part in near.into_iter().flatten().filter_map(part_at) {
            loose[part] = true;
            beside[m].push(part);
        }
    }
    if let Some(largest) = parts.largest() {
        loose[largest] = false;
    }
    let alone = excluded.iter().zip(&beside).filter(|(mark, beside)| {
        !mark.painted && !beside.is_empty() && !beside.iter().any(|&part| loose[part])
    });
    let warnings = alone.map(|(mark, _)| takes_itself_alone(mark)).collect();
    for (run, _) in parts.iter().filter(|(_, part)| loose[*part]) {
        labels.data_mut()[run.voxels()].fill(label::OUTSIDE);
    }
    warnings
}

fn takes_itself_alone(mark: &Mark) -> Warning {
    let [x, y, z] = mark.point.coords.into();
    let text = format!(
        "the exclude seed at [{x:.1}, {y:.1}, {z:.1}] mm takes {EXCLUDE_MM:.0} mm around itself off the patient and nothing else, as \
         what it lies in is joined to her: paint all that is to go (`seeds.strokes` with tissue exclude)"
    );
    Warning::new("exclude-seed-alone", text).at(&mark.point)
}

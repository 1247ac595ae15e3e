//! Labels that the user supplies, made elsewhere: whether they can be this CT's.

use crate::frame::Frame;
use crate::inclusions::inclusions;
use crate::labels_error::{AIR_HU, LabelsError};
use crate::orientation::{Kind, Orientation};
use crate::uncertainty::UNCERTAIN_MM;
use rayon::prelude::*;
use supine_space::{Grid, Warning};
use supine_volume::{Ct, LabelMap, Parts, Volume, label};

// But for the share of right labels in air, chosen, not measured.
/// Above is tissue without partial volume.
const TISSUE_HU: i16 = -200;
/// Share of the soft tissue in air that is suspect; right labels have 0.0002 or less.
const SUSPECT_AIR: f64 = 0.01;
/// Share of the soft tissue in air, or of the chest wall in the air around the patient, that no
/// labels of this CT can have.
const WRONG_AIR: f64 = 0.1;
/// Mirrored labels fit better when they leave less than this share of the soft tissue's air.
const MIRRORED_FIT: f64 = 0.25;
/// Share of the outer boundary that may lie within tissue: the table touches the back.
const INNER_BOUNDARY: f64 = 0.3;
/// Loose pieces and holes below this volume are worth no warning, cm³.
const WARN_CM3: f64 = 1.0;

/// Takes labels that were made elsewhere, by any program or by hand, for a CT: on its own grid to
/// the bit, in whatever order its voxels are stored, whole or cut off around what is labelled, with
/// warnings of what is suspect about them.
///
/// # Errors
/// When the labels are on another grid, one of soft tissue and chest wall is missing, or they
/// cannot be of this CT: mirrored, or in air.
pub fn take_labels(ct: &Ct, labels: LabelMap) -> Result<(LabelMap, Vec<Warning>), LabelsError> {
    // Programs that keep to one orientation store the rows of an axial CT from their other end.
    let labels = labels.in_order_of(ct.grid());
    let given = labels.grid().size();
    let is_part = labels.grid().len() < ct.grid().len();
    // 3D Slicer and others cut off what is empty.
    let labels = match is_part && !cuts_through(ct, &labels) {
        true => labels.placed_in(ct.grid()),
        false => labels,
    };
    let other_size = LabelsError::Size { labels: labels.grid().size(), ct: ct.grid().size() };
    let Some(off_mm) = labels.grid().offset_mm(ct.grid()) else { return Err(other_size) };
    if !labels.grid().is_same(ct.grid()) {
        return Err(LabelsError::Grid { off_mm });
    }
    // Files round positions to different digits.
    let labels = Volume::new(ct.grid().clone(), labels.into_parts().1).map_err(|_| other_size)?;
    let there = |kind: fn(u8) -> bool| labels.data().iter().any(|l| kind(*l));
    if !there(label::is_soft_tissue) {
        return Err(LabelsError::Missing { missing: "soft tissue" });
    }
    if !there(label::is_chest_wall) {
        return Err(LabelsError::Missing { missing: "chest wall" });
    }
    let share = soft_tissue_in_air(ct, &labels)?;
    chest_wall_in_air(ct, &labels)?;
    let mut warnings = Vec::new();
    if is_part {
        let text = format!(
            "the labels cover {given:?} of the CT's {:?} voxels: around them nothing is labelled",
            ct.grid().size()
        );
        warnings.push(Warning::new("labels-cropped", text));
    }
    if share > SUSPECT_AIR {
        let text = format!(
            "{:.1} % of the soft tissue in the labels lies in air or lung (below {AIR_HU} HU)",
            100.0 * share
        );
        warnings.push(Warning::new("labels-in-air", text));
    }
    let inner = boundary_in_tissue(ct, &labels);
    if inner > INNER_BOUNDARY {
        let text = format!(
            "{:.0} % of the labels' outer boundary lies within tissue: it counts as skin there; \
             the soft tissue should reach the skin everywhere",
            100.0 * inner
        );
        warnings.push(Warning::new("labels-inside-skin", text));
    }
    warnings.extend(pieces(&labels));
    warnings.extend(inclusions(ct, &labels));
    if let Ok(frame) = Frame::new(ct.grid()) {
        let kind = |n: usize| {
            let (hu, l) = (ct.data()[n], labels.data()[n]);
            Kind::of(hu, l != label::OUTSIDE, label::is_chest_wall(l) && hu < AIR_HU)
        };
        warnings.extend(Orientation::of(&frame, kind).warnings());
    }
    let text = format!(
        "how far the chest wall of the labels given may be wrong is not known: no place of it is called uncertain, and its \
         error is taken for {UNCERTAIN_MM:.1} mm everywhere; look at the boundary on the images"
    );
    warnings.push(Warning::new("labels-uncertainty-unknown", text));
    Ok((labels, warnings))
}

/// Whether labels of a part of the CT end within the patient: what is labelled on the faces of the
/// part goes on as tissue beyond them.
fn cuts_through(ct: &Ct, part: &LabelMap) -> bool {
    let (whole, own) = (ct.grid(), part.grid());
    let Some(start) = whole.voxel_at(&own.origin()) else { return false };
    let (mut labelled, mut cut) = (0u64, 0u64);
    for n in (0..own.len()).filter(|&n| part.data()[n] != label::OUTSIDE) {
        let at = own.voxel(n);
        let place = [0, 1, 2].map(|a| at[a] + start[a]);
        if (0..3).any(|a| place[a] >= whole.size()[a]) {
            return false;
        }
        for a in 0..3 {
            let mut beyond = place;
            if at[a] == 0 && start[a] > 0 {
                beyond[a] -= 1;
            } else if at[a] + 1 == own.size()[a] && place[a] + 1 < whole.size()[a] {
                beyond[a] += 1;
            } else {
                continue;
            }
            labelled += 1;
            cut += u64::from(ct.at(beyond) > TISSUE_HU);
        }
    }
    cut as f64 > INNER_BOUNDARY * labelled as f64
}

/// Share of the soft tissue in air; an error when that is too much, or much less when mirrored.
fn soft_tissue_in_air(ct: &Ct, labels: &LabelMap) -> Result<f64, LabelsError> {
    let [ni, nj, nk] = ct.grid().size();
    let (hu, plane) = (ct.data(), ni * nj);
    // Soft tissue, and how much of it is air at its own place and at the seven mirrored ones: bits
    // 0, 1, 2 of the index say along which axes.
    let count = |k: usize| {
        let mut counts = [0u64; 9];
        for (n, _) in labels.data()[k * plane..(k + 1) * plane]
            .iter()
            .enumerate()
            .filter(|(_, l)| label::is_soft_tissue(**l))
        {
            let (i, j) = (n % ni, n / ni);
            counts[8] += 1;
            for (mirror, air) in counts[..8].iter_mut().enumerate() {
                let i = if mirror & 1 == 0 { i } else { ni - 1 - i };
                let j = if mirror & 2 == 0 { j } else { nj - 1 - j };
                let k = if mirror & 4 == 0 { k } else { nk - 1 - k };
                *air += u64::from(hu[k * plane + j * ni + i] < AIR_HU);
            }
        }
        counts
    };
    let add = |mut a: [u64; 9], b: [u64; 9]| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let counts = (0..nk).into_par_iter().map(count).reduce(|| [0; 9], add);
    let share = |mirror: usize| counts[mirror] as f64 / counts[8].max(1) as f64;
    let best = (1..8).min_by_key(|&m| (counts[m], m)).unwrap_or(1);
    if share(0) > SUSPECT_AIR && share(best) < MIRRORED_FIT * share(0) {
        return Err(LabelsError::Mirrored {
            share: 100.0 * share(0),
            mirrored: 100.0 * share(best),
            axes: directions(ct.grid(), best),
        });
    }
    if share(0) > WRONG_AIR {
        return Err(LabelsError::SoftTissueInAir { share: 100.0 * share(0) });
    }
    Ok(share(0))
}

/// The patient's direction nearest to each axis of the grid: 0 left-right, 1 front-back, 2
/// feet-head.
fn patient_axis(grid: &Grid, axis: usize) -> usize {
    grid.direction().column(axis).abs().imax()
}

fn directions(grid: &Grid, mirror: usize) -> String {
    let names = ["left and right", "front and back", "head and feet"];
    let axes = (0..3).filter(|a| mirror & (1 << a) != 0).map(|a| names[patient_axis(grid, a)]);
    axes.collect::<Vec<_>>().join(", ")
}

/// An error when much of the chest wall lies in air that reaches the sides of the CT.
fn chest_wall_in_air(ct: &Ct, labels: &LabelMap) -> Result<(), LabelsError> {
    let (grid, hu) = (ct.grid(), ct.data());
    let air = Parts::new(grid.size(), |n| hu[n] < AIR_HU);
    let sides: Vec<usize> = (0..3).filter(|&a| patient_axis(grid, a) != 2).collect();
    let mut open = vec![false; air.voxels.len()];
    for (run, part) in air.iter() {
        let ends = [grid.voxel(run.start), grid.voxel(run.start + run.len - 1)];
        open[part] |= ends
            .iter()
            .any(|voxel| sides.iter().any(|&a| voxel[a] == 0 || voxel[a] + 1 == grid.size()[a]));
    }
    let wall = |n: &usize| label::is_chest_wall(labels.data()[*n]);
    let outside = air.iter().filter(|(_, part)| open[*part]);
    let outside: usize = outside.map(|(run, _)| run.voxels().filter(wall).count()).sum();
    let all = (0..grid.len()).filter(wall).count();
    let share = outside as f64 / all.max(1) as f64;
    if share > WRONG_AIR {
        return Err(LabelsError::ChestWallInAir { share: 100.0 * share });
    }
    Ok(())
}

/// Share of the outer boundary within the slices beyond which, two voxels out, there is tissue.
fn boundary_in_tissue(ct: &Ct, labels: &LabelMap) -> f64 {
    let [ni, nj, nk] = ct.grid().size();
    let (hu, data) = (ct.data(), labels.data());
    let slice = |k: usize| {
        let mut counts = [0usize; 2];
        for j in 2..nj.saturating_sub(2) {
            for i in 2..ni.saturating_sub(2) {
                let n = (k * nj + j) * ni + i;
                if !label::is_soft_tissue(data[n]) {
                    continue;
                }
                for (next, beyond) in
                    [(n - 1, n - 2), (n + 1, n + 2), (n - ni, n - 2 * ni), (n + ni, n + 2 * ni)]
                {
                    if data[next] == label::OUTSIDE && data[beyond] == label::OUTSIDE {
                        counts[0] += 1;
                        counts[1] += usize::from(hu[beyond] > TISSUE_HU);
                    }
                }
            }
        }
        counts
    };
    let add = |a: [usize; 2], b: [usize; 2]| [a[0] + b[0], a[1] + b[1]];
    let [all, inner] = (0..nk).into_par_iter().map(slice).reduce(|| [0; 2], add);
    inner as f64 / all.max(1) as f64
}

/// Warnings of loose pieces and holes.
fn pieces(labels: &LabelMap) -> Vec<Warning> {
    let (grid, data) = (labels.grid(), labels.data());
    let cm3 = |voxels: usize| voxels as f64 * grid.voxel_volume() / 1000.0;
    let mut warnings = Vec::new();
    let mut warn_of_pieces = |name: &str, kind: fn(u8) -> bool| {
        let parts = Parts::new(grid.size(), |n| kind(data[n]));
        let largest = parts.largest().map_or(0, |p| parts.voxels[p]);
        let loose = parts.voxels.iter().sum::<usize>() - largest;
        if cm3(loose) > WARN_CM3 {
            let text = format!(
                "the {name} of the labels is in {} pieces: {:.1} cm³ are not joined to the largest",
                parts.voxels.len(),
                cm3(loose)
            );
            warnings.push(Warning::new("labels-in-pieces", text));
        }
    };
    warn_of_pieces("soft tissue", label::is_soft_tissue);
    warn_of_pieces("chest wall", label::is_chest_wall);
    let outside = Parts::new(grid.size(), |n| data[n] == label::OUTSIDE);
    let mut closed = vec![true; outside.voxels.len()];
    for (run, part) in outside.iter() {
        let ends = [grid.voxel(run.start), grid.voxel(run.start + run.len - 1)];
        let at_end = |v: &[usize; 3]| (0..3).any(|a| v[a] == 0 || v[a] + 1 == grid.size()[a]);
        closed[part] &= !ends.iter().any(at_end);
    }
    let holes: Vec<usize> =
        (0..closed.len()).filter(|&p| closed[p]).map(|p| outside.voxels[p]).collect();
    let hollow = holes.iter().sum();
    if cm3(hollow) > WARN_CM3 {
        let text = format!(
            "the labels have {} hole(s) within the patient, {:.1} cm³ together",
            holes.len(),
            cm3(hollow)
        );
        warnings.push(Warning::new("labels-with-holes", text));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector};

    const SIZE: [usize; 3] = [60, 50, 24];

    fn grid() -> Grid {
        // Rows run to the patient's right, as after a change of convention.
        let direction = Matrix::new(-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        let spacing = Vector::new(4.0, 4.0, 6.0);
        Grid::new(SIZE, spacing, Point::new(10.0, 20.0, 30.0), direction).unwrap()
    }

    /// A trunk that narrows to the head, one breast, a chest wall with lung.
    fn truth([i, j, k]: [usize; 3]) -> u8 {
        let (x, y) = (i as f64 - 29.5, j as f64 - 28.0);
        let narrow = 1.0 + 0.012 * k as f64;
        let trunk = (x / 24.0).powi(2) + (y / 16.0).powi(2);
        let breast = ((x - 11.0) / 8.0).powi(2) + ((y + 14.0) / 8.0).powi(2);
        let wall = (x / 19.0).powi(2) + (y / 12.0).powi(2);
        if wall * narrow < 1.0 {
            label::CHEST_WALL
        } else if trunk * narrow < 1.0 || breast < 1.0 && (6..18).contains(&k) {
            label::SOFT_TISSUE
        } else {
            label::OUTSIDE
        }
    }

    fn ct() -> Ct {
        Ct::from_fn(grid(), |v| {
            let (x, y) = (v[0] as f64 - 29.5, v[1] as f64 - 28.0);
            match truth(v) {
                label::OUTSIDE => -1000,
                label::CHEST_WALL if (x / 15.0).powi(2) + (y / 9.0).powi(2) < 1.0 => -850,
                label::CHEST_WALL => 50,
                _ => -90,
            }
        })
    }

    fn labels(f: impl FnMut([usize; 3]) -> u8) -> LabelMap {
        LabelMap::from_fn(grid(), f)
    }

    fn refused(labels: LabelMap) -> String {
        take_labels(&ct(), labels).unwrap_err().to_string()
    }

    #[test]
    fn right_labels_are_taken_as_they_are() {
        let (taken, warnings) = take_labels(&ct(), labels(truth)).unwrap();
        assert_eq!(taken, labels(truth));
        let told = warnings.iter().map(Warning::to_string).collect::<Vec<_>>();
        assert!(told.len() == 1 && told[0].contains("is not known"), "{told:?}");
        // Rounded positions of another file are those of the CT.
        let g = grid();
        let near = g.origin() + Vector::new(0.004, -0.004, 0.002);
        let near = Grid::new(SIZE, g.spacing(), near, *g.direction()).unwrap();
        let (taken, _) = take_labels(&ct(), LabelMap::from_fn(near, truth)).unwrap();
        assert_eq!(taken.grid(), &g);
    }

    #[test]
    fn labels_in_another_order_are_turned_without_loss() {
        let g = grid();
        // As nibabel's canonical orientation and dcm2niix store them: axes from their other ends.
        for back in [[true, false, false], [false, true, false], [true, true, false], [true; 3]] {
            let signs = Vector::from(back.map(|back| if back { -1.0 } else { 1.0 }));
            let direction = g.direction() * Matrix::from_diagonal(&signs);
            let turned =
                |v: [usize; 3]| [0, 1, 2].map(|a| if back[a] { SIZE[a] - 1 - v[a] } else { v[a] });
            let stored = Grid::new(SIZE, g.spacing(), g.centre(turned([0; 3])), direction).unwrap();
            let (taken, _) =
                take_labels(&ct(), LabelMap::from_fn(stored, |v| truth(turned(v)))).unwrap();
            assert!(taken == labels(truth), "{back:?}");
        }
    }

    #[test]
    fn labels_cut_off_around_what_is_labelled_are_taken_for_the_whole() {
        let g = grid();
        let all = labels(truth);
        let labelled = |a: usize| {
            let on = (0..g.len()).filter(|&n| all.data()[n] != label::OUTSIDE);
            on.map(|n| g.voxel(n)[a])
                .fold([usize::MAX, 0], |[low, high], n| [low.min(n), high.max(n)])
        };
        let ends = [0, 1, 2].map(labelled);
        let (start, size) = (ends.map(|e| e[0]), ends.map(|[low, high]| high - low + 1));
        assert!(size != SIZE, "{size:?}");
        let part = |shift: f64| {
            let origin = g.centre(start) + Vector::new(shift, 0.0, 0.0);
            let part = Grid::new(size, g.spacing(), origin, *g.direction()).unwrap();
            LabelMap::from_fn(part, |v| truth([0, 1, 2].map(|a| v[a] + start[a])))
        };
        let (taken, warnings) = take_labels(&ct(), part(0.0)).unwrap();
        assert!(taken == all && warnings.iter().any(|w| w.code() == "labels-cropped"));
        // Beside the CT's voxels they are no part of it.
        assert!(refused(part(0.4)).contains("not on the CT's grid"));
    }

    #[test]
    fn mirrored_labels_are_named_in_the_patients_directions() {
        let last = SIZE.map(|n| n - 1);
        for (axes, words) in [
            ([true, false, false], "left and right are"),
            ([false, true, false], "front and back are"),
            ([false, false, true], "head and feet are"),
            ([true, true, false], "left and right, front and back are"),
        ] {
            let text = refused(labels(|v| {
                truth([0, 1, 2].map(|a| if axes[a] { last[a] - v[a] } else { v[a] }))
            }));
            assert!(text.contains("mirrored") && text.contains(words), "{words}: {text}");
        }
    }

    #[test]
    fn another_grid_is_one_clear_error() {
        let g = grid();
        let shifted = g.origin() + Vector::new(0.0, 0.5, 0.0);
        let shifted = Grid::new(SIZE, g.spacing(), shifted, *g.direction()).unwrap();
        let text = refused(LabelMap::from_fn(shifted, truth));
        assert!(text.contains("0.50 mm") && text.contains("resample"), "{text}");
        let cropped = g.crop([0; 3], [60, 50, 20]).unwrap();
        let text = refused(LabelMap::from_fn(cropped, truth));
        assert!(text.contains("[60, 50, 20]") && text.contains("[60, 50, 24]"), "{text}");
    }

    #[test]
    fn labels_that_cannot_be_of_this_ct_are_refused() {
        let without =
            |missing: u8| refused(labels(|v| if truth(v) == missing { 0 } else { truth(v) }));
        assert!(without(label::SOFT_TISSUE).contains("no soft tissue"));
        assert!(without(label::CHEST_WALL).contains("no chest wall"));
        // A wall of ribs and muscle alone leaves the lungs to the soft tissue.
        let (t, c) = (labels(truth), ct());
        let shell = refused(labels(|v| if c.at(v) == -850 { 1 } else { t.at(v) }));
        assert!(shell.contains("enclose the lungs"), "{shell}");
        // A wall that hangs beside the patient.
        let beside = refused(labels(|v| if v[0] < 5 { 2 } else { truth(v).min(1) }));
        assert!(beside.contains("another CT"), "{beside}");
    }

    #[test]
    fn what_is_suspect_is_told() {
        let told = |labels: LabelMap| {
            let warnings = take_labels(&ct(), labels).unwrap().1;
            warnings.iter().map(Warning::to_string).collect::<Vec<_>>().join("\n")
        };
        let hollow = told(labels(|v| {
            if (27..32).contains(&v[0]) && v[1] == 28 && (8..12).contains(&v[2]) {
                0
            } else {
                truth(v)
            }
        }));
        assert!(hollow.contains("1 hole(s)") && hollow.contains("1.9 cm³"), "{hollow}");
        let loose = told(labels(|v| if v[0] < 3 && v[1] < 3 { 1 } else { truth(v) }));
        assert!(loose.contains("2 pieces") && loose.contains("20.7 cm³"), "{loose}");
        // Soft tissue that ends before the skin.
        let within = |v: [usize; 3]| {
            let (x, y) = (v[0] as f64 - 29.5, v[1] as f64 - 28.0);
            (x / 20.5).powi(2) + (y / 13.2).powi(2) < 1.0
        };
        let short = told(labels(|v| if within(v) { truth(v) } else { 0 }));
        assert!(short.contains("reach the skin"), "{short}");
        let lung = told(labels(|v| {
            let deep = v[0] == 20 && v[1] == 28 && (8..10).contains(&v[2]);
            if deep { label::SOFT_TISSUE } else { truth(v) }
        }));
        assert!(lung.contains("0.2 ml of lung") && lung.contains("-70 132 81"), "{lung}");
        let bone = {
            let mut ct = ct();
            let rib =
                |v: [usize; 3]| v[0] == 40 && (10..15).contains(&v[1]) && (8..12).contains(&v[2]);
            for n in 0..ct.grid().len() {
                if rib(ct.grid().voxel(n)) {
                    ct.data_mut()[n] = 600;
                }
            }
            let warnings = take_labels(&ct, labels(truth)).unwrap().1;
            warnings.iter().map(Warning::to_string).collect::<Vec<_>>().join("\n")
        };
        assert!(bone.contains("1.9 ml as dense as bone"), "{bone}");
        let proud = told(labels(|v| {
            let next = truth([(v[0] + 1).min(59), v[1], v[2]]);
            if truth(v) == 0 && next == 1 { 1 } else { truth(v) }
        }));
        assert!(proud.contains("of the soft tissue in the labels lies in air"), "{proud}");
    }
}

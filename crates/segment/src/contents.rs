//! What the soft tissue must not hold: lung, cavities of air, bone. What belongs to the chest
//! becomes chest wall, which holds all that it encloses; the rest is told.

use crate::Error;
use crate::body::flag;
use crate::paint::Outline;
use crate::pieces::{Amount, amount};
use crate::plane::{fill_holes, near};
use crate::radial_map::RAYS;
use crate::scan::Scan;
use rayon::prelude::*;
use supine_record::QualityCheck;
use supine_space::Warning;
use supine_volume::{LabelMap, Parts, Run, label};

/// Air below this is no partial volume of air and tissue, HU. Chosen, not measured.
const AIR_HU: i16 = -600;
/// Air this near to the skin is the air before it, mm. Chosen, not measured.
const SKIN_MM: f32 = 3.0;
/// The wall is nowhere thinner over lung than this, mm. Measured on four real CTs: 2.9 to 5.5 at
/// the thinnest place.
const THINNEST_MM: f32 = 3.0;
/// As dense as bone, HU: the level of [`crate::check_region`].
const BONE_HU: i16 = 200;
/// A piece of a rib or of cartilage outside the wall ends this near to it, mm; an arm or a vein
/// full of contrast medium goes on. Chosen, not measured.
const BESIDE_MM: f32 = 5.0;
/// Rays that turn at least this far to the front, share: the shoulders and the veins of the armpits
/// lie farther to the side. Measured: up to 0.3 there.
const IN_FRONT: f32 = 0.4;
/// Volumes that warn, and the volume of lung that refuses, ml. Measured on four real CTs: 0.05 at
/// most; 2.1 where the wall had fallen 14 mm into a lung.
const WARNS_ML: f64 = 0.1;
const REFUSES_ML: f64 = 10.0;

/// What lay in the soft tissue.
#[derive(Debug)]
pub(crate) struct Contents {
    /// Lung and the air joined to it, chest wall now.
    lung: Amount,
    /// Other air.
    air: Amount,
    /// Bone that ends beside the wall, chest wall now.
    rib: Amount,
    /// Other bone.
    bone: Amount,
    /// How far the outline is wrong at least, mm, by ray over all slices.
    pub(crate) off: Vec<(usize, f32)>,
}

/// Connected pieces of one kind, and which of them belong to the chest.
struct Pieces {
    parts: Parts,
    belong: Vec<bool>,
}

/// Looks through the soft tissue of labels; gives the chest what belongs to it.
///
/// # Errors
/// [`Error::LungOutsideWall`] when that is too much to be mended.
pub(crate) fn settle(
    outline: &Outline<'_>,
    ribless: &[bool],
    labels: &mut LabelMap,
) -> Result<Contents, Error> {
    let scan = outline.scan();
    let (air, bone) = (air(scan, labels), bone(outline, labels));
    let chest = chest(scan, ribless);
    // In the slices of the chest.
    let amount = |pieces: &Pieces, belong: bool| {
        amount(&pieces.parts, scan.ct.grid(), 0.0, |run, part| {
            pieces.belong[part] == belong && chest[run.start / scan.frame.plane()]
        })
    };
    let mut contents = Contents {
        lung: amount(&air, true),
        air: amount(&air, false),
        rib: amount(&bone, true),
        bone: amount(&bone, false),
        off: Vec::new(),
    };
    if contents.lung.ml > REFUSES_ML {
        let Amount { ml: lung_ml, middle, .. } = contents.lung;
        return Err(Error::LungOutsideWall { lung_ml, at: middle.coords.into() });
    }
    for (pieces, rim_mm) in [(&air, THINNEST_MM), (&bone, 0.0)] {
        let runs: Vec<Run> =
            pieces.parts.iter().filter(|(_, part)| pieces.belong[*part]).map(|(r, _)| r).collect();
        let voxels = runs.iter().flat_map(|run| run.voxels());
        contents.off.extend(voxels.map(|n| (outline.ray(n), outline.beyond(n) + rim_mm)));
        enclose(scan, &runs, rim_mm, labels);
    }
    Ok(contents)
}

/// The slices that hold lung and ribs.
fn chest(scan: Scan<'_>, ribless: &[bool]) -> Vec<bool> {
    let lung = |k: usize| scan.body.flags_slice(scan.frame, k).iter().any(|f| f & flag::LUNG != 0);
    (0..ribless.len()).into_par_iter().map(|k| !ribless[k] && lung(k)).collect()
}

/// Lung, and air deeper than the skin. Lung belongs to the chest, and air that goes on in it.
fn air(scan: Scan<'_>, labels: &LabelMap) -> Pieces {
    let (hu, flags, labels) = (scan.ct.data(), &scan.body.flags, labels.data());
    let cavity = |n: usize| hu[n] < AIR_HU && scan.body.depth_mm(n) > SKIN_MM;
    let lung = |n: usize| flags[n] & flag::LUNG != 0;
    let parts =
        Parts::new(scan.frame.size, |n| labels[n] == label::SOFT_TISSUE && (lung(n) || cavity(n)));
    let inner = |n: usize| labels.get(n) == Some(&label::CHEST_WALL) && hu[n] < AIR_HU;
    let mut belong = vec![false; parts.voxels.len()];
    for (run, part) in parts.iter() {
        belong[part] |= run.voxels().any(|n| lung(n) || beside(scan, n).any(inner));
    }
    Pieces { parts, belong }
}

/// Bone in front of the thorax. What goes on in the wall's bone and ends beside the wall belongs to
/// it.
fn bone(outline: &Outline<'_>, labels: &LabelMap) -> Pieces {
    let scan = outline.scan();
    let (hu, flags, labels) = (scan.ct.data(), &scan.body.flags, labels.data());
    let in_front = |n: usize| scan.rays.to_back[outline.ray(n) % RAYS] < -IN_FRONT;
    let is_bone = |n: usize| flags[n] & flag::BONE != 0;
    let parts = Parts::new(scan.frame.size, |n| {
        labels[n] == label::SOFT_TISSUE && is_bone(n) && hu[n] > BONE_HU && in_front(n)
    });
    let inner = |n: usize| labels.get(n) == Some(&label::CHEST_WALL) && is_bone(n);
    let (plane, ni) = (scan.frame.plane(), scan.frame.size[0]);
    let spacing = [scan.frame.spacing[0], scan.frame.spacing[1]];
    let mut joined = vec![false; parts.voxels.len()];
    let mut ends = vec![true; parts.voxels.len()];
    let mut near_wall = (usize::MAX, Vec::new());
    for (run, part) in parts.iter() {
        let k = run.start / plane;
        if near_wall.0 != k {
            let wall: Vec<bool> = labels[k * plane..(k + 1) * plane]
                .iter()
                .map(|&l| l == label::CHEST_WALL)
                .collect();
            near_wall = (k, near(&wall, ni, spacing, BESIDE_MM));
        }
        joined[part] |= run.voxels().any(|n| beside(scan, n).any(inner));
        ends[part] &= run.voxels().all(|n| near_wall.1[n % plane]);
    }
    let belong = joined.iter().zip(ends).map(|(joined, ends)| *joined && ends).collect();
    Pieces { parts, belong }
}

/// The six neighbours of a voxel (those before the volume left out); at the end of a row the next
/// one's.
fn beside(scan: Scan<'_>, n: usize) -> impl Iterator<Item = usize> {
    let steps = [1, scan.frame.size[0], scan.frame.plane()];
    let before = steps.into_iter().filter_map(move |step| n.checked_sub(step));
    before.chain(steps.into_iter().map(move |step| n + step))
}

/// Makes runs of voxels, the soft tissue this near to them and what the wall then encloses in their
/// slices chest wall.
fn enclose(scan: Scan<'_>, runs: &[Run], rim_mm: f32, labels: &mut LabelMap) {
    let (plane, ni) = (scan.frame.plane(), scan.frame.size[0]);
    let spacing = [scan.frame.spacing[0], scan.frame.spacing[1]];
    for runs in runs.chunk_by(|a, b| a.start / plane == b.start / plane) {
        let start = runs[0].start / plane * plane;
        let labels = &mut labels.data_mut()[start..start + plane];
        let mut on = vec![false; plane];
        runs.iter().flat_map(|run| run.voxels()).for_each(|n| on[n - start] = true);
        let rim = near(&on, ni, spacing, rim_mm);
        let mut wall: Vec<bool> =
            (0..plane).map(|n| rim[n] || labels[n] == label::CHEST_WALL).collect();
        fill_holes(&mut wall, ni);
        for (l, wall) in labels.iter_mut().zip(wall) {
            if wall && *l == label::SOFT_TISSUE {
                *l = label::CHEST_WALL;
            }
        }
    }
}

impl Contents {
    pub(crate) fn checks(&self) -> [QualityCheck; 3] {
        let check = |what, ml| QualityCheck::at_most(what, ml, "ml").warns(WARNS_ML);
        [
            check("lung that lay outside the chest wall", self.lung.ml).refuses(REFUSES_ML),
            check("air in the soft tissue of the chest", self.air.ml),
            check("bone outside the chest wall, in front", self.rib.ml + self.bone.ml),
        ]
    }

    pub(crate) fn warnings(&self) -> Vec<Warning> {
        let Self { lung, air, rib, bone, .. } = self;
        let told = [
            told(
                lung,
                "lung-outside-wall",
                "lung lay outside the chest wall that was found; it is chest wall now, but the wall before it may lie too deep: \
                 look at the boundary there, and add a chest-wall seed",
            ),
            told(
                air,
                "air-in-soft-tissue",
                "air lie enclosed in the soft tissue: after surgery, biopsy or in a device; it will move like breast",
            ),
            told(
                rib,
                "rib-outside-wall",
                "rib or cartilage lay outside the chest wall that was found; it is chest wall now: look at the boundary there",
            ),
            told(
                bone,
                "bone-outside-wall",
                "bone, or a vein as dense with contrast medium, lie in the soft tissue in front of the chest: look at the labels \
                 there, and add a chest-wall seed where it is a rib",
            ),
        ];
        told.into_iter().flatten().collect()
    }
}

fn told(amount: &Amount, code: &'static str, what: &str) -> Option<Warning> {
    let Amount { ml, largest_ml, middle: at } = amount;
    (*ml > WARNS_ML).then(|| {
        let text = format!(
            "{ml:.1} ml of {what} (the largest piece, {largest_ml:.1} ml, lies at {:.0}, {:.0}, {:.0} mm, LPS)",
            at.x, at.y, at.z
        );
        Warning::new(code, text).value("volume_ml", *ml).value("largest_ml", *largest_ml)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::frame::Frame;
    use crate::radial_map::{RadialMap, Rays};
    use supine_space::{Grid, Matrix, Point, Vector};
    use supine_volume::{Ct, Volume};

    const SIZE: usize = 60;

    /// A square body with the wall's outline at 40 mm round its middle; 3 mm voxels.
    fn settled(
        value: i16,
        bit: u8,
        at: fn([usize; 3]) -> bool,
    ) -> (LabelMap, Result<Contents, Error>) {
        let spacing = Vector::repeat(3.0);
        let grid =
            Grid::new([SIZE, SIZE, 24], spacing, Point::origin(), Matrix::identity()).unwrap();
        let ct: Ct = Volume::from_fn(grid.clone(), |v| if at(v) { value } else { 40 });
        let frame = Frame::new(&grid).unwrap();
        let lung = |v: [usize; 3]| v[0] == 30 && v[1] == 30;
        let flags = (0..grid.len()).map(|n| {
            let v = grid.voxel(n);
            let border = v[0].min(v[1]).min(SIZE - 1 - v[0].max(v[1])) == 0;
            let more = if at(v) { bit } else { 0 } | if lung(v) { flag::LUNG } else { 0 };
            if border { flag::OPEN_AIR } else { flag::BODY | more }
        });
        let body = Body::new(&frame, flags.collect(), vec![true; frame.plane()], 1.0);
        let rays = Rays::new(&frame, vec![[90.0, 90.0]; 24]);
        let scan = Scan { ct: &ct, frame: &frame, body: &body, rays: &rays };
        let outline = Outline::new(scan, RadialMap::new(24, 40.0));
        let mut labels = outline.paint();
        let found = settle(&outline, &[false; 24], &mut labels);
        (labels, found)
    }

    fn codes(found: &Contents) -> Vec<&'static str> {
        found.warnings().iter().map(Warning::code).collect()
    }

    #[test]
    fn lung_and_what_it_lies_against_is_chest_wall() {
        // In front of the outline, which lies at row 16.7.
        let lung =
            |[i, j, k]: [usize; 3]| (29..32).contains(&i) && (13..17).contains(&j) && k == 12;
        let (labels, found) = settled(-850, flag::LUNG, lung);
        let found = found.unwrap();
        assert_eq!(codes(&found), ["lung-outside-wall"]);
        for j in 12..30 {
            assert_eq!(labels.at([30, j, 12]), label::CHEST_WALL, "{j}");
        }
        assert_eq!(labels.at([30, 10, 12]), label::SOFT_TISSUE);
        assert!(found.off.iter().any(|(_, mm)| (12.0..16.0).contains(mm)), "{:?}", found.off);
    }

    #[test]
    fn much_lung_outside_the_wall_is_refused_with_its_place() {
        let lung = |[i, j, k]: [usize; 3]| (25..35).contains(&i) && (10..16).contains(&j) && k > 11;
        let error = settled(-850, flag::LUNG, lung).1.unwrap_err();
        let Error::LungOutsideWall { lung_ml, at } = error else { panic!("{error}") };
        assert!((lung_ml - 19.4).abs() < 0.1 && (at[1] - 37.5).abs() < 0.1, "{lung_ml} {at:?}");
    }

    #[test]
    fn air_that_goes_on_in_the_chest_belongs_to_it_and_other_air_is_told() {
        let bulla =
            |[i, j, k]: [usize; 3]| (29..32).contains(&i) && (14..22).contains(&j) && k == 12;
        let (labels, found) = settled(-1000, 0, bulla);
        assert_eq!(codes(&found.unwrap()), ["lung-outside-wall"]);
        assert_eq!(labels.at([30, 14, 12]), label::CHEST_WALL);
        let cavity =
            |[i, j, k]: [usize; 3]| (29..32).contains(&i) && (8..12).contains(&j) && k == 12;
        let (labels, found) = settled(-1000, 0, cavity);
        assert_eq!(codes(&found.unwrap()), ["air-in-soft-tissue"]);
        assert_eq!(labels.at([30, 9, 12]), label::SOFT_TISSUE);
    }

    #[test]
    fn a_rib_that_ends_beside_the_wall_belongs_to_it_and_a_bar_is_told() {
        let rib = |[i, j, _]: [usize; 3]| (29..32).contains(&i) && (16..20).contains(&j);
        let (labels, found) = settled(400, flag::BONE, rib);
        assert_eq!(codes(&found.unwrap()), ["rib-outside-wall"]);
        assert_eq!(labels.at([30, 16, 12]), label::CHEST_WALL);
        let bar = |[i, j, _]: [usize; 3]| (29..32).contains(&i) && (8..20).contains(&j);
        let (labels, found) = settled(400, flag::BONE, bar);
        assert_eq!(codes(&found.unwrap()), ["bone-outside-wall"]);
        assert_eq!(labels.at([30, 9, 12]), label::SOFT_TISSUE);
    }
}

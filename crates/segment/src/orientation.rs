//! Whether head and feet, left and right are where the CT says: what of the chest contradicts.
//!
//! Measured on four real CTs, one with a consolidated lung and effusion (rider0109), and four
//! synthetic patients, as shares of the tissue or bone compared; of a CT reversed or mirrored each
//! has the other sign:
//!
//! | | ribs | mass | aorta | heart | liver |
//! |---|---|---|---|---|---|
//! | real | 0.06 to 0.10 | 0.26 to 0.44 | 0.49 to 0.79 | 0.37 to 0.73 | 0.50 and 0.98 (0 on a CT that ends above it) |
//! | rider0109 | 0.09 | -0.19 | -0.02 | -0.02 | 0.81 |
//! | synthetic | 0.32 to 0.40 | 0.35 to 0.45 | 0.55 to 0.81 | 0.40 to 0.49 | 0.82 to 1.00 |

use crate::Error;
use crate::body::{Body, flag};
use crate::frame::Frame;
use crate::plane::near;
use rayon::prelude::*;
use std::ops::RangeInclusive;
use supine_record::QualityCheck;
use supine_space::Warning;
use supine_volume::{Ct, median};

// The limits lie between the figures measured above and those of the other sign; where none is
// named they were chosen, not measured.
/// Ribs that run up towards the front by more than this share contradict.
const RIBS: f64 = -0.03;
/// So does this share more of tissue between the lungs in their upper half, together with the ribs:
/// of itself a consolidated lung has as much.
const MASS: f64 = -0.15;
/// Aorta and heart on the right contradict together: one alone may be pushed aside.
const AORTA: f64 = -0.25;
const HEART: f64 = -0.15;
/// So does a liver on the left where neither aorta nor heart lies clearly on the left, by their
/// limits of the other sign: a sick lung beside them takes their evidence, but hardly the liver's.
const LIVER: f64 = -0.4;
/// The liver is looked for below this share of the lungs' length and down to this far below them,
/// mm ...
const LOW: f32 = 0.15;
const BELOW_MM: f32 = 60.0;
/// ... as tissue without gas and fat this far around within the slice and across it, mm, up to so
/// far from the midline, mm: bowel, stomach and spleen are smaller or mixed with them.
const SOLID_MM: [f32; 2] = [14.0, 10.0];
const LIVER_MM: f32 = 120.0;
/// The chest is looked at on points this far apart within the slices, mm.
const STEP_MM: f32 = 3.0;
/// Denser is bone, less dense is fat, HU.
const BONE_HU: i16 = 200;
const TISSUE_HU: i16 = -20;
/// Slices with this area of lung belong to the chest, mm²; those with the second one show where the
/// lungs' back is.
const LUNG_MM2: f32 = 2000.0;
const WHOLE_MM2: f32 = 6000.0;
/// Lungs over less than this length tell nothing, mm.
const LENGTH_MM: f32 = 60.0;
/// Ribs are followed over this height, mm, at the sides, between these angles from the front, over
/// up to so many bins of 2 degrees: farther lies the next rib.
const RISE_MM: f32 = 5.0;
/// Slices farther apart than this jump from rib to rib, mm. Measured: on every third slice of
/// rider0109, 15 mm apart, ribs had the other sign.
const APART_MM: f32 = 10.0;
const SIDES: std::ops::Range<usize> = 30..63;
const BINS: usize = 91;
const SHIFTS: usize = 5;
/// Bone nearer to the middle of the chest is no rib, mm.
const RIB_MM: f32 = 60.0;
/// Less bone or tissue than this many points tells nothing.
const LEAST: f64 = 500.0;

/// What a point of the chest is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    Outside,
    Lung,
    Bone,
    Tissue,
    Fat,
}

impl Kind {
    pub(crate) fn of(hu: i16, inside: bool, lung: bool) -> Self {
        match hu {
            _ if lung => Self::Lung,
            _ if !inside => Self::Outside,
            hu if hu > BONE_HU => Self::Bone,
            hu if hu > TISSUE_HU => Self::Tissue,
            _ => Self::Fat,
        }
    }

    fn is_dense(self) -> bool {
        matches!(self, Self::Bone | Self::Tissue)
    }
}

/// What speaks for the directions of a CT, as shares from -1 to 1; 0 when nothing does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Orientation {
    /// Ribs that run down towards the front against those that run up.
    ribs: f64,
    /// Tissue between the lungs (heart, liver) in their lower half against their upper.
    mass: f64,
    /// Tissue left of the spine's front (the aorta) against right.
    aorta: f64,
    /// Tissue between the lungs left of the midline (the heart) against right.
    heart: f64,
    /// Large solid tissue under the lungs right of the midline (the liver) against left.
    liver: f64,
}

impl Orientation {
    /// # Errors
    /// [`Error::HeadFeetReversed`] when ribs and tissue between the lungs say so. Left and right
    /// are never refused: of 10,000 people one has her heart on the right.
    pub(crate) fn check(ct: &Ct, frame: &Frame, body: &Body) -> Result<Self, Error> {
        let kind = |n: usize| {
            let (inside, lung) = (body.flags[n] & flag::BODY != 0, flag::LUNG | flag::BODY);
            Kind::of(ct.data()[n], inside, body.flags[n] & lung == lung)
        };
        let orientation = Self::of(frame, kind);
        if orientation.ribs < RIBS && orientation.mass < MASS {
            return Err(Error::HeadFeetReversed);
        }
        Ok(orientation)
    }

    /// What the points of a CT say.
    pub(crate) fn of(frame: &Frame, kind: impl Fn(usize) -> Kind + Sync) -> Self {
        let chest = Chest::new(frame, kind);
        if chest.slices.len() as f32 * chest.slice_mm < LENGTH_MM {
            return Self::default();
        }
        let (ribs, mass) = (chest.ribs(), chest.mass());
        let Some(midline) = chest.midline() else { return Self { ribs, mass, ..Self::default() } };
        let (aorta, heart) = chest.aorta_and_heart(midline);
        Self { ribs, mass, aorta, heart, liver: chest.liver(midline) }
    }

    /// What was measured. Ribs and tissue refuse together only, aorta, heart and liver warn
    /// together only; tissue alone does not warn, for disease of a lung moves it.
    pub(crate) fn checks(&self) -> [QualityCheck; 5] {
        let least = |what, share: f64| QualityCheck::at_least(what, 100.0 * share, "%");
        [
            least("ribs that run down towards the front, against up", self.ribs)
                .warns(100.0 * RIBS)
                .refuses_jointly(100.0 * RIBS),
            least("tissue between the lungs towards the feet, against the head", self.mass)
                .refuses_jointly(100.0 * MASS),
            least("tissue left of the spine's front (the aorta), against right", self.aorta),
            least("tissue left between the lungs (the heart), against right", self.heart),
            least("solid tissue right under the lungs (the liver), against left", self.liver),
        ]
    }

    /// What contradicts the directions of the CT.
    pub(crate) fn warnings(&self) -> Vec<Warning> {
        let mut contrary = Vec::new();
        if self.ribs < RIBS {
            contrary.push(("head and feet", "the ribs run up towards the front"));
        }
        if self.aorta < AORTA && self.heart < HEART {
            contrary.push(("left and right", "heart and aorta lie on the right"));
        } else if self.liver < LIVER && self.aorta < -AORTA && self.heart < -HEART {
            contrary.push((
                "left and right",
                "the liver lies on the left, and neither heart nor aorta clearly does",
            ));
        }
        let warning = |(what, why): (&str, &str)| {
            let text = format!(
                "{what} of the CT may be exchanged: {why}; check on the images that the breast to be simulated is the right \
                 one and that the CT was exported as it was taken"
            );
            Warning::new("orientation-doubtful", text)
        };
        contrary.into_iter().map(warning).collect()
    }
}

/// The slices that show lung, from the feet to the head, on points along the patient's left and
/// back.
struct Chest {
    size: [usize; 2],
    slices: Vec<Vec<Kind>>,
    /// Those below them, as far as the liver is looked for.
    below: Vec<Vec<Kind>>,
    slice_mm: f32,
}

impl Chest {
    fn new(frame: &Frame, kind: impl Fn(usize) -> Kind + Sync) -> Self {
        let [ni, nj, nk] = frame.size;
        let corners = [[0, 0], [ni - 1, 0], [0, nj - 1], [ni - 1, nj - 1]].map(|[i, j]| {
            let p = [i as f32 * frame.spacing[0], j as f32 * frame.spacing[1]];
            [frame.left, frame.back].map(|d| p[0] * d[0] + p[1] * d[1])
        });
        let bound = |a: usize, f: fn(f32, f32) -> f32| corners.iter().map(|c| c[a]).reduce(f);
        let low = [0, 1].map(|a| bound(a, f32::min).unwrap_or(0.0));
        let high = [0, 1].map(|a| bound(a, f32::max).unwrap_or(0.0));
        let size = [0, 1].map(|a| ((high[a] - low[a]) / STEP_MM) as usize + 1);
        // The pixel of each point.
        let pixel = |n: usize| {
            let at = [n % size[0], n / size[0]];
            let [l, b] = [0, 1].map(|a| low[a] + at[a] as f32 * STEP_MM);
            let [i, j] = [0, 1].map(|a| {
                let mm = l * frame.left[a] + b * frame.back[a];
                (mm / frame.spacing[a]).round()
            });
            let within = i >= 0.0 && j >= 0.0 && i < ni as f32 && j < nj as f32;
            within.then(|| j as usize * ni + i as usize)
        };
        let pixels: Vec<Option<usize>> = (0..size[0] * size[1]).map(pixel).collect();
        let slice = |k: usize| -> Vec<Kind> {
            let k = if frame.towards_head { k } else { nk - 1 - k };
            let at = |n: &Option<usize>| n.map_or(Kind::Outside, |n| kind(k * frame.plane() + n));
            pixels.iter().map(at).collect()
        };
        let mut slices: Vec<Vec<Kind>> = (0..nk).into_par_iter().map(slice).collect();
        let with_lung = |s: &Vec<Kind>| lung_mm2(s) > LUNG_MM2;
        slices.truncate(slices.iter().rposition(with_lung).map_or(0, |k| k + 1));
        let mut below: Vec<Vec<Kind>> =
            slices.drain(..slices.iter().position(with_lung).unwrap_or(0)).collect();
        let slice_mm = frame.spacing[2];
        below.drain(..below.len().saturating_sub((BELOW_MM / slice_mm) as usize));
        Self { size, slices, below, slice_mm }
    }

    /// Rows of a slice from the front to the back.
    fn rows<'a>(&self, slice: &'a [Kind]) -> impl Iterator<Item = &'a [Kind]> {
        slice.chunks(self.size[0])
    }

    fn mass(&self) -> f64 {
        let between = |s: &Vec<Kind>| self.rows(s).map(|row| between(row).count()).sum::<usize>();
        let count: Vec<usize> = self.slices.iter().map(between).collect();
        let half = count.len() / 2;
        let of = |part: &[usize]| part.iter().sum::<usize>() as f64;
        share(of(&count[..half]), of(&count[count.len() - half..]))
    }

    /// Whether the ribs' places wander backwards from slice to slice towards the head.
    fn ribs(&self) -> f64 {
        let Some([x, y]) = self.middle().filter(|_| self.slice_mm <= APART_MM) else { return 0.0 };
        let places = |s: &Vec<Kind>| {
            let mut sides = [[0f64; BINS]; 2];
            for (n, _) in s.iter().enumerate().filter(|(_, k)| **k == Kind::Bone) {
                let (dx, dy) = ((n % self.size[0]) as f32 - x, (n / self.size[0]) as f32 - y);
                if dx.hypot(dy) * STEP_MM > RIB_MM {
                    let degrees = dx.abs().atan2(-dy).to_degrees();
                    sides[usize::from(dx > 0.0)][(degrees / 2.0) as usize % BINS] += 1.0;
                }
            }
            sides.map(spread)
        };
        let places: Vec<[[f64; BINS]; 2]> = self.slices.iter().map(places).collect();
        let rise = ((RISE_MM / self.slice_mm).round() as usize).max(1);
        let (mut down, mut up) = (0.0, 0.0);
        for (low, high) in places.iter().zip(places.iter().skip(rise)) {
            for (low, high) in low.iter().zip(high) {
                for (a, shift) in SIDES.flat_map(|a| (1..=SHIFTS).map(move |shift| (a, shift))) {
                    if SIDES.contains(&(a + shift)) {
                        down += low[a] * high[a + shift];
                        up += low[a + shift] * high[a];
                    }
                }
            }
        }
        share(down, up)
    }

    /// The middle of the lungs' box, points.
    fn middle(&self) -> Option<[f32; 2]> {
        let [low, high] = self.lungs()?;
        Some([0, 1].map(|a| 0.5 * (low[a] + high[a]) as f32))
    }

    /// Two corners of the lungs' box, points.
    fn lungs(&self) -> Option<[[usize; 2]; 2]> {
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        for slice in &self.slices {
            for (n, _) in slice.iter().enumerate().filter(|(_, k)| **k == Kind::Lung) {
                let at = [n % self.size[0], n / self.size[0]];
                low = [0, 1].map(|a| low[a].min(at[a]));
                high = [0, 1].map(|a| high[a].max(at[a]));
            }
        }
        (low[0] <= high[0]).then_some([low, high])
    }

    /// Points from the right to the middle of the spine.
    fn midline(&self) -> Option<f32> {
        let spine = |s: &Vec<Kind>| self.lungs_back(s).and_then(|back| self.spine(s, back));
        median(&mut self.slices.iter().filter_map(spine).collect::<Vec<f32>>())
    }

    fn liver(&self, midline: f32) -> f64 {
        let across = (SOLID_MM[1] / self.slice_mm).round() as usize;
        let Some([front, back]) = self.lungs().map(|corners| corners.map(|[_, j]| j)) else {
            return 0.0;
        };
        let low = (LOW * self.slices.len() as f32) as usize + across;
        let low = self.below.iter().chain(&self.slices[..low.min(self.slices.len())]);
        let solid: Vec<Vec<bool>> = low.map(|slice| self.solid(slice, front..=back)).collect();
        let mut sides = [0.0; 2];
        for about in solid.windows(2 * across + 1) {
            let inner = (0..about[0].len()).filter(|&n| about.iter().all(|slice| slice[n]));
            beside(inner.map(|n| n % self.size[0]), midline, LIVER_MM, &mut sides);
        }
        share(sides[1], sides[0])
    }

    /// The points of these rows of a slice with nothing but tissue around.
    fn solid(&self, slice: &[Kind], rows: RangeInclusive<usize>) -> Vec<bool> {
        let other: Vec<bool> = slice.iter().map(|kind| *kind != Kind::Tissue).collect();
        let near = near(&other, self.size[0], [STEP_MM; 2], SOLID_MM[0]);
        let within = |n: usize| rows.contains(&(n / self.size[0]));
        near.iter().enumerate().map(|(n, near)| !near && within(n)).collect()
    }

    /// The aorta runs at the left before the spine, about 35 to 75 mm before the lungs' back, up to
    /// 50 mm from the middle; the heart lies before that, in the lower half.
    fn aorta_and_heart(&self, midline: f32) -> (f64, f64) {
        let points = |mm: f32| (mm / STEP_MM) as usize;
        let length = self.slices.len() as f64;
        let (mut aorta, mut heart) = ([0.0; 2], [0.0; 2]);
        for (k, slice) in self.slices.iter().enumerate() {
            let Some(back) = self.lungs_back(slice) else { continue };
            let height = k as f64 / length;
            for (j, row) in self.rows(slice).enumerate() {
                let spine =
                    j > back.saturating_sub(points(75.0)) && j < back.saturating_sub(points(35.0));
                let front = j < back.saturating_sub(points(70.0));
                if spine && (0.25..0.7).contains(&height) {
                    let dense = (0..row.len()).filter(|&i| row[i].is_dense());
                    beside(dense, midline, 50.0, &mut aorta);
                }
                if front && (0.2..0.5).contains(&height) {
                    beside(between(row), midline, 90.0, &mut heart);
                }
            }
        }
        (share(aorta[0], aorta[1]), share(heart[0], heart[1]))
    }

    /// The last row that shows 10 mm of lung.
    fn lungs_back(&self, slice: &[Kind]) -> Option<usize> {
        let lung = |row: &[Kind]| row.iter().filter(|k| **k == Kind::Lung).count() as f32 * STEP_MM;
        let last = self.rows(slice).enumerate().filter(|(_, row)| lung(row) > 10.0).last()?.0;
        (lung_mm2(slice) >= WHOLE_MM2).then_some(last)
    }

    /// The middle of the bone about and behind the spinal canal, points from the right; contrast
    /// medium does not reach there.
    fn spine(&self, slice: &[Kind], back: usize) -> Option<f32> {
        let columns = slice.iter().enumerate().filter(|(_, k)| **k != Kind::Outside);
        let (low, high) = columns
            .map(|(n, _)| n % self.size[0])
            .fold((usize::MAX, 0), |(low, high), i| (low.min(i), high.max(i)));
        let middle = 0.5 * (low + high) as f32;
        let near = |n: &usize| {
            let (i, j) = (n % self.size[0], n / self.size[0]);
            (i as f32 - middle).abs() * STEP_MM < 35.0 && j as f32 > back as f32 - 25.0 / STEP_MM
        };
        let bone = (0..slice.len()).filter(|&n| slice[n] == Kind::Bone).filter(near);
        let mut xs: Vec<f32> = bone.map(|n| (n % self.size[0]) as f32).collect();
        (xs.len() as f32 * STEP_MM * STEP_MM > 150.0).then(|| median(&mut xs)).flatten()
    }
}

fn lung_mm2(slice: &[Kind]) -> f32 {
    slice.iter().filter(|k| **k == Kind::Lung).count() as f32 * STEP_MM * STEP_MM
}

/// The places of a row with dense tissue between its first and last lung.
fn between(row: &[Kind]) -> impl Iterator<Item = usize> {
    let lung = |k: &Kind| *k == Kind::Lung;
    let first = row.iter().position(lung).unwrap_or(row.len());
    let last = row.iter().rposition(lung).unwrap_or(0);
    (first..last).filter(|&i| row[i].is_dense())
}

/// Adds how many lie up to `reach` mm left and right of the middle; the middle itself is on no
/// side.
fn beside(places: impl Iterator<Item = usize>, middle: f32, reach: f32, sides: &mut [f64; 2]) {
    for i in places {
        let left = (i as f32 - middle) * STEP_MM;
        if (4.0..reach).contains(&left.abs()) {
            sides[usize::from(left < 0.0)] += 1.0;
        }
    }
}

/// How much more the one has, of both together; 0 of too little.
fn share(a: f64, b: f64) -> f64 {
    if a + b < LEAST { 0.0 } else { (a - b) / (a + b) }
}

/// Limited to a rib's thickness, and the mean of three neighbours.
fn spread(mut bins: [f64; BINS]) -> [f64; BINS] {
    bins = bins.map(|count| count.min(4.0));
    let mut out = bins;
    for a in 1..BINS - 1 {
        out[a] = (bins[a - 1] + bins[a] + bins[a + 1]) / 3.0;
    }
    out
}

//! Tubes and leads that run along the skin: they stand on it, and are longer than a nipple.

use crate::body::{Body, flag};
use crate::frame::Frame;
use crate::plane::squared_distance;
use rayon::prelude::*;
use supine_volume::{Ct, Parts, Run};

/// What is narrower than twice this stands proud of the patient, mm: tubes, nipples, tips of folds.
/// Measured: a tube with its clamp is 17 mm wide.
const OPENING_MM: f32 = 10.0;
/// A tube is followed so far off the skin, mm (measured: it reaches 12 mm).
const REACH_MM: f32 = 12.0;
/// A tube is longer than this and its part that is taken for the patient higher, mm. Measured on
/// two tubes: 53 and 60 long, 7 and 12 high; nipples are at most 20 long, the table's contact with
/// the back 2.2 high.
const LONG_MM: f32 = 40.0;
const HIGH_MM: f32 = 4.0;
/// At least this share of it is no wider at the skin than above it. Measured: 0.95 and more of
/// tubes; of nipples and folds of the skin, which have their base there, 0.55 and less.
const STANDS: f64 = 0.75;

/// A run of voxels that stand proud of the patient.
struct Proud {
    run: Run,
    /// Whether its piece of the slice is no wider at the skin than above it.
    stands: bool,
    /// Voxels of the patient among it, and the height of the highest of them, mm.
    of_patient: usize,
    high_mm: f32,
}

/// What is known of one object.
#[derive(Clone, Default)]
struct Object {
    standing: usize,
    of_patient: usize,
    high_mm: f32,
    /// Its first and last voxel along i, j, k.
    extent: Option<[[usize; 3]; 2]>,
}

/// Takes tubes off the body, down to the skin; gives their volume, cm³. `level` is that of the
/// skin, HU.
pub(crate) fn drop(ct: &Ct, frame: &Frame, level: i16, body: &mut Body) -> f64 {
    let slices: Vec<Vec<Proud>> =
        (0..frame.size[2]).into_par_iter().map(|k| proud(ct, frame, level, body, k)).collect();
    let proud: Vec<Proud> = slices.into_iter().flatten().collect();
    let parts = Parts::of_runs(frame.size, proud.iter().map(|p| p.run).collect());
    let mut objects = vec![Object::default(); parts.voxels.len()];
    for (p, &part) in proud.iter().zip(&parts.part) {
        objects[part].add(p, frame);
    }
    let mut taken = 0;
    for (p, &part) in proud.iter().zip(&parts.part) {
        if objects[part].is_tube(parts.voxels[part], frame) {
            taken += p.of_patient;
            p.run.voxels().for_each(|n| body.flags[n] &= !flag::BODY);
        }
    }
    taken as f64 * frame.voxel_cm3()
}

impl Object {
    fn add(&mut self, p: &Proud, frame: &Frame) {
        let [ni, nj, _] = frame.size;
        let at = |n: usize| [n % ni, n / ni % nj, n / (ni * nj)];
        let (first, last) = (at(p.run.start), at(p.run.start + p.run.len - 1));
        let [low, high] = self.extent.unwrap_or([first, last]);
        self.extent = Some([
            [0, 1, 2].map(|a| low[a].min(first[a])),
            [0, 1, 2].map(|a| high[a].max(last[a])),
        ]);
        self.standing += if p.stands { p.run.len } else { 0 };
        self.of_patient += p.of_patient;
        self.high_mm = self.high_mm.max(p.high_mm);
    }

    fn is_tube(&self, voxels: usize, frame: &Frame) -> bool {
        let Some([low, high]) = self.extent else { return false };
        let mm = [0, 1, 2].map(|a| (high[a] + 1 - low[a]) as f32 * frame.spacing[a]);
        let long = mm.iter().map(|mm| mm * mm).sum::<f32>() > LONG_MM * LONG_MM;
        long && self.high_mm > HIGH_MM && self.standing as f64 > STANDS * voxels as f64
    }
}

/// What of a slice stands proud of the patient opened by a disc, with its height over her.
fn proud(ct: &Ct, frame: &Frame, level: i16, body: &Body, k: usize) -> Vec<Proud> {
    let (start, ni, nj) = (k * frame.plane(), frame.size[0], frame.size[1]);
    let spacing = [frame.spacing[0], frame.spacing[1]];
    let core: Vec<bool> =
        (start..start + frame.plane()).map(|n| body.depth_mm(n) > OPENING_MM).collect();
    // The distance to what a disc makes of its middles is that to them less its radius.
    let away = squared_distance(&core, ni, spacing, OPENING_MM + REACH_MM);
    let height = |n: usize| away[n].sqrt() - OPENING_MM;
    let flags = body.flags_slice(frame, k);
    let hu = &ct.data()[start..start + frame.plane()];
    let tissue = |n: usize| body.field[n] && (hu[n] >= level || flags[n] & flag::BODY != 0);
    let near = OPENING_MM * OPENING_MM;
    let pieces = Parts::new([ni, nj, 1], |n| away[n] > near && away[n].is_finite() && tissue(n));
    let stands = stands(&pieces, |n| (height(n) / frame.pixel()) as usize);
    let run = |(run, part): (Run, usize)| {
        let of_patient = || run.voxels().filter(|&n| flags[n] & flag::BODY != 0);
        Proud {
            run: Run { start: start + run.start, len: run.len },
            stands: stands[part],
            of_patient: of_patient().count(),
            high_mm: of_patient().map(height).fold(0.0, f32::max),
        }
    };
    pieces.iter().map(run).collect()
}

/// Whether each piece has as many pixels in a layer above as in the one on the skin.
fn stands(pieces: &Parts, layer: impl Fn(usize) -> usize) -> Vec<bool> {
    let mut widths: Vec<Vec<usize>> = vec![Vec::new(); pieces.voxels.len()];
    for (run, part) in pieces.iter() {
        for n in run.voxels() {
            let (layer, widths) = (layer(n), &mut widths[part]);
            if widths.len() <= layer {
                widths.resize(layer + 1, 0);
            }
            widths[layer] += 1;
        }
    }
    // The layer next to the skin has pixels of it.
    let above = |widths: &[usize]| widths.iter().skip(2).copied().max().unwrap_or(0);
    widths.iter().map(|widths| above(widths) >= widths[0]).collect()
}

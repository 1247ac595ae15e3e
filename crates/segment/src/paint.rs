//! Surfaces to labels.

use crate::body::flag;
use crate::scan::Scan;
use crate::sheet::{RAYS, Sheet};
use rayon::prelude::*;
use supine_volume::{LabelMap, label};

/// Labels of the voxels whose centres lie inside the body, inside or outside the wall.
pub(crate) fn paint(scan: Scan<'_>, shell: &Sheet, height: &Sheet) -> LabelMap {
    let Scan { ct, frame, body, rays } = scan;
    let mut labels = ct.map(|_| label::OUTSIDE);
    labels.data_mut().par_chunks_mut(frame.plane()).enumerate().for_each(|(k, out)| {
        let radius: Vec<f32> =
            (0..=RAYS).map(|p| shell.at(k, p % RAYS) + height.at(k, p % RAYS)).collect();
        let flags = body.flags_slice(frame, k);
        for (n, out) in out.iter_mut().enumerate() {
            if flags[n] & flag::BODY == 0 {
                continue;
            }
            let (r, turn) = rays.polar(k, frame.position(n));
            let p = (turn as usize).min(RAYS - 1);
            let t = turn - p as f32;
            let wall = radius[p] * (1.0 - t) + radius[p + 1] * t;
            *out = if r < wall { label::CHEST_WALL } else { label::SOFT_TISSUE };
        }
    });
    labels
}

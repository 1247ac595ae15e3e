//! The tumour, grown from its centre.

use crate::frame::Frame;
use crate::smoothing::smoothed;
use std::ops::RangeInclusive;
use supine_space::{Sphere, Warning};
use supine_volume::{Ct, LabelMap, Volume, components, distance_mm, label, median};

// Chosen, not measured.
/// Smoothing in the slice before levels are compared, mm.
const SMOOTH_MM: f32 = 1.0;
/// Shares of the radius: the middle that tells its level, the ring that tells its surroundings, the
/// reach of growth, and half the width of the necks that are cut.
const MIDDLE: f64 = 0.5;
const RING: (f64, f64) = (1.5, 2.0);
const REACH: f64 = 1.5;
const NECK: f32 = 0.4;
/// Least difference of the tumour to its surroundings, HU: less is lost in noise and gland.
const CONTRAST_HU: f32 = 40.0;
/// Volume grown over the volume of the sphere.
const VOLUME: (f64, f64) = (0.4, 1.6);

/// Labels the tumour within the soft tissue; a warning when it does not stand out and the sphere
/// was taken as it is.
pub(crate) fn mark(
    ct: &Ct,
    frame: &Frame,
    sphere: Sphere,
    labels: &mut LabelMap,
) -> Option<Warning> {
    let near = Surroundings::new(ct, frame, sphere, labels);
    let soft = |n: usize, labels: &LabelMap| label::is_soft_tissue(labels.data()[n]);
    let Some(near) = near else {
        let text = "nothing is labelled as tumour: its centre lies outside the CT";
        return Some(Warning::new("tumour-outside-ct", text));
    };
    let (chosen, warning) = match near.grow() {
        Ok(grown) => (grown, None),
        Err(why) => {
            let text = format!("the tumour's label is the sphere given: {why}");
            (near.within(1.0), Some(Warning::new("tumour-not-grown", text)))
        }
    };
    for n in chosen {
        if soft(n, labels) {
            labels.data_mut()[n] = label::TUMOUR;
        }
    }
    warning
}

/// The box round the tumour.
struct Surroundings {
    sphere: Sphere,
    /// Offsets in the CT.
    offset: Volume<usize>,
    hu: Volume<f32>,
    soft: Volume<bool>,
}

impl Surroundings {
    fn new(ct: &Ct, frame: &Frame, sphere: Sphere, labels: &LabelMap) -> Option<Self> {
        let grid = ct.grid();
        grid.voxel_at(&sphere.centre())?;
        let ring = Sphere::new(sphere.centre(), RING.1 * sphere.radius()).ok()?;
        let (start, part) = grid.around(&ring)?;
        let size = part.size();
        let offset = Volume::from_fn(part, |[i, j, k]| {
            grid.offset([i + start[0], j + start[1], k + start[2]])
        });
        let slices: Vec<Vec<f32>> =
            (0..size[2]).map(|k| smoothed(ct, frame, start[2] + k, SMOOTH_MM)).collect();
        let plane = frame.plane();
        let hu = offset.map(|n| slices[n / plane - start[2]][n % plane]);
        let soft = offset.map(|n| label::is_soft_tissue(labels.data()[*n]));
        Some(Self { sphere, offset, hu, soft })
    }

    /// Distance of a voxel to the centre over the radius.
    fn away(&self, n: usize) -> f64 {
        let grid = self.hu.grid();
        let off = grid.centre(grid.voxel(n)) - self.sphere.centre();
        off.norm() / self.sphere.radius()
    }

    /// Offsets in the CT of the voxels within this many radii.
    fn within(&self, radii: f64) -> Vec<usize> {
        let near = (0..self.offset.data().len()).filter(|&n| self.away(n) <= radii);
        near.map(|n| self.offset.data()[n]).collect()
    }

    fn level(&self, away: RangeInclusive<f64>) -> Option<f32> {
        let mut values: Vec<f32> = (0..self.hu.data().len())
            .filter(|&n| self.soft.data()[n] && away.contains(&self.away(n)))
            .map(|n| self.hu.data()[n])
            .collect();
        median(&mut values)
    }

    /// Offsets in the CT of the tumour, or why it cannot be told.
    fn grow(&self) -> Result<Vec<usize>, String> {
        let levels = (self.level(0.0..=MIDDLE), self.level(RING.0..=RING.1));
        let (Some(inside), Some(around)) = levels else {
            return Err("there is no soft tissue round it".into());
        };
        if (inside - around).abs() < CONTRAST_HU {
            return Err(format!(
                "at {inside:.0} HU it does not stand out from its surroundings at {around:.0} HU"
            ));
        }
        let half = 0.5 * (inside + around);
        let mut on = self.hu.map(|v| (v - half) * (inside - around) > 0.0);
        for n in 0..on.data().len() {
            on.data_mut()[n] &= self.soft.data()[n] && self.away(n) <= REACH;
        }
        let neck = NECK * self.sphere.radius() as f32;
        let inner = distance_mm(&on.map(|on| !on)).map(|&d| d > neck);
        let parts = components(&inner);
        // The centre is the planner's: the part nearest to it is the tumour.
        let nearest = (0..inner.data().len())
            .filter(|&n| inner.data()[n])
            .min_by(|&a, &b| self.away(a).total_cmp(&self.away(b)))
            .filter(|&n| self.away(n) < MIDDLE)
            .ok_or("nothing of its density is as thick as the tumour")?;
        let own = parts.ids.data()[nearest];
        let near = distance_mm(&parts.ids.map(|&id| id == own));
        let spacing = self.hu.grid().spacing();
        let slack = 0.5 * spacing.min() as f32;
        let grown: Vec<usize> = (0..on.data().len())
            .filter(|&n| on.data()[n] && near.data()[n] <= neck + slack)
            .map(|n| self.offset.data()[n])
            .collect();
        let sphere = 4.0 / 3.0 * std::f64::consts::PI * self.sphere.radius().powi(3);
        let share = grown.len() as f64 * self.hu.grid().voxel_volume() / sphere;
        if !(VOLUME.0..=VOLUME.1).contains(&share) {
            return Err(format!("what stands out has {share:.1} times the volume of the sphere"));
        }
        Ok(grown)
    }
}

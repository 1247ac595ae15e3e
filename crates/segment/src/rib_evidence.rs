//! What the tissue along a ray says of where the outer surface of the ribs lies.

use crate::body::flag;
use crate::levels::Levels;
use crate::plane::Between;
use crate::radial_map::{RADII, START_MM};
use crate::scan::Scan;

// Costs and reaches of docs/SEGMENTATION.md, step 4, unless another source is named.
/// Reward for the outer edge of a bone that has soft tissue behind it. Chosen, not measured.
pub(crate) const EDGE: f32 = 4.0;
/// Cost per mm of bone beyond the shell, counted to this many mm; of cartilage as much, by how
/// dense it is.
const BONE_BEYOND: f32 = 0.5;
const BONE_BEYOND_MM: f32 = 14.0;
/// Cost of leaving lung outside or of touching the skin.
pub(crate) const BARRED: f32 = 30.0;
/// The shell keeps this distance to the skin, mm.
const SKIN_MM: f32 = 3.0;

// Where a chest has no bone in front, what lies just inside and outside tells where its wall is.
// Measured on real CTs with contours: without the two a wall of cartilage alone was drawn 14 mm
// into the fat of one and 20 mm in to a heart full of contrast medium.
/// Cost per mm of fat within this distance inside the shell, beyond a slack: fat lies outside the
/// ribs.
const FAT_INSIDE: f32 = 0.6;
const FAT_INSIDE_MM: usize = 10;
const FAT_SLACK_MM: f32 = 1.0;
/// Cost per mm of cartilage beyond the shell.
const CARTILAGE_BEYOND: f32 = 1.0;
/// Neither fat nor wall: air, lung.
const AIR_HU: f32 = -200.0;

/// What lies along a ray, 1 mm steps.
#[derive(Default)]
pub(crate) struct Profile {
    bone: Vec<bool>,
    cartilage: Vec<bool>,
    lung: Vec<bool>,
    hu: Vec<f32>,
    depth: Vec<f32>,
}

impl Profile {
    /// Looks along a ray of a slice and its smoothed `image`.
    pub(crate) fn sample(&mut self, scan: Scan<'_>, image: &[f32], k: usize, p: usize) {
        let ([ni, nj, _], rays) = (scan.frame.size, scan.rays);
        let flags = scan.body.flags_slice(scan.frame, k);
        let depth = scan.body.depth_slice(scan.frame, k);
        self.bone.clear();
        self.cartilage.clear();
        self.lung.clear();
        self.hu.clear();
        self.depth.clear();
        for i in 0..RADII {
            let at = rays.pixel(k, p, START_MM + i as f32);
            let at = Between::new([ni, nj], at);
            let share = |bit: u8| {
                at.map_or(0.0, |at| at.sample(flags, |f| f32::from(u8::from(f & bit != 0))))
            };
            self.bone.push(share(flag::BONE) > 0.5);
            self.cartilage.push(share(flag::CARTILAGE) > 0.5);
            self.lung.push(share(flag::LUNG) > 0.5);
            self.hu.push(at.map_or(-1024.0, |at| at.sample(image, |v| v)));
            self.depth.push(at.map_or(0.0, |at| at.sample(depth, f32::from)) * 0.1);
        }
    }

    /// The cost of each radius.
    pub(crate) fn costs(&self, levels: Levels, out: &mut [f32]) {
        out.fill(0.0);
        self.bone_costs(out);
        self.bar(out);
        self.fat_costs(levels, out);
        self.cartilage_costs(out);
    }

    fn bone_costs(&self, out: &mut [f32]) {
        let bone = |i: usize| i < RADII && self.bone[i];
        let hu = |i: usize| self.hu[i.min(RADII - 1)];
        let edges: Vec<bool> = (0..RADII)
            .map(|i| {
                let ends = bone(i) && !bone(i + 1) && !bone(i + 2) && !bone(i + 3);
                ends && hu(i + 3).min(hu(i + 5)) > -350.0
            })
            .collect();
        // A Gaussian of 1 mm, its top at 1.
        let reward = |i: usize| -> f32 {
            [1.0f32, 0.607, 0.135, 0.011]
                .iter()
                .enumerate()
                .map(|(d, w)| {
                    let on = (i >= d && edges[i - d]) || (i + d < RADII && edges[i + d]);
                    if on { *w } else { 0.0 }
                })
                .fold(0.0, f32::max)
        };
        let mut beyond = 0.0f32;
        for i in (0..RADII).rev() {
            beyond += f32::from(self.bone[i]);
            out[i] += BONE_BEYOND * (beyond - 1.0).clamp(0.0, BONE_BEYOND_MM) - EDGE * reward(i);
        }
    }

    /// Lung stays inside, and the skin outside.
    fn bar(&self, out: &mut [f32]) {
        let mut lung = 0;
        for i in (0..RADII).rev() {
            lung += usize::from(self.lung[i]);
            out[i] += if lung > 2 { BARRED } else { 0.0 };
            out[i] += if self.depth[i] < SKIN_MM { BARRED } else { 0.0 };
        }
    }

    fn fat_costs(&self, levels: Levels, out: &mut [f32]) {
        let likeness = |i: usize| {
            if self.hu[i] < AIR_HU || self.lung[i] {
                return 0.0;
            }
            1.0 - levels.likeness(self.hu[i])
        };
        let likeness: Vec<f32> = (0..RADII).map(likeness).collect();
        let mut inside = 0.0f32;
        for i in 0..RADII {
            inside +=
                likeness[i] - if i < FAT_INSIDE_MM { 0.0 } else { likeness[i - FAT_INSIDE_MM] };
            out[i] += FAT_INSIDE * (inside - FAT_SLACK_MM).max(0.0);
        }
    }

    fn cartilage_costs(&self, out: &mut [f32]) {
        let mut beyond = 0.0f32;
        for i in (0..RADII).rev() {
            out[i] += CARTILAGE_BEYOND * beyond.min(BONE_BEYOND_MM);
            beyond += f32::from(self.cartilage[i]);
        }
    }
}

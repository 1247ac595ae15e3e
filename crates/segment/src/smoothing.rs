//! Slices smoothed in their plane.

use crate::frame::Frame;
use std::ops::Range;
use supine_volume::{Ct, gaussian_rows};

/// Smoothing before any level is compared, mm (docs/SEGMENTATION.md, step 3).
pub(crate) const SMOOTH_MM: f32 = 0.9;

/// A slice in f32, padding and metal clamped, smoothed in its plane.
pub(crate) fn smoothed(ct: &Ct, frame: &Frame, k: usize, sigma_mm: f32) -> Vec<f32> {
    smoothed_rows(ct, frame, (k, 0..frame.size[1]), sigma_mm)
}

/// [`smoothed`], but that rows beyond those asked for of slice k hold anything.
pub(crate) fn smoothed_rows(
    ct: &Ct,
    frame: &Frame,
    (k, rows): (usize, Range<usize>),
    sigma_mm: f32,
) -> Vec<f32> {
    let plane = frame.plane();
    let mut image: Vec<f32> = ct.data()[k * plane..(k + 1) * plane]
        .iter()
        .map(|&v| f32::from(v.clamp(-1024, 3071)))
        .collect();
    let spacing = [frame.spacing[0], frame.spacing[1]];
    gaussian_rows(&mut image, frame.size[0], spacing, sigma_mm, rows);
    image
}

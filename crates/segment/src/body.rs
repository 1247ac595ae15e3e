//! What is known of each voxel: the patient, her lungs and bones, and how deep it lies under the
//! skin.

use crate::frame::Frame;
use crate::plane::squared_distance;
use rayon::prelude::*;
use std::ops::Range;
use supine_space::Point;

/// What is known of a voxel; bits.
pub(crate) mod flag {
    pub(crate) const BODY: u8 = 1;
    pub(crate) const LUNG: u8 = 2;
    pub(crate) const BONE: u8 = 4;
    /// Air that is joined to the air around the patient.
    pub(crate) const OPEN_AIR: u8 = 8;
    pub(crate) const CORE: u8 = 16;
    pub(crate) const IMPLANT: u8 = 32;
    /// As dense as costal cartilage and joined to a bone: cartilage, the bones themselves, organs
    /// full of contrast medium.
    pub(crate) const CARTILAGE: u8 = 64;
}

/// Units of [`Body::depth`] per mm, and how far it is measured, mm: what eight bits hold.
const DEPTH_PER_MM: f32 = 10.0;
const DEPTH_MM: f32 = 25.5;

/// A dense object: a metal device under the skin, or what lies on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Device {
    /// Its volume, that of a device with its streaks, ml.
    pub ml: f64,
    /// Its middle, LPS, mm.
    pub middle: Point,
}

/// The patient.
pub(crate) struct Body {
    /// Bits of [`flag`] per voxel.
    pub(crate) flags: Vec<u8>,
    /// Distance to the air outside within the slice, tenths of mm, at most 25.5 mm; 0 outside.
    depth: Vec<u8>,
    /// Pixels within the reconstructed field (the same in all slices).
    pub(crate) field: Vec<bool>,
    /// Volume of the lungs, litres.
    pub(crate) lung_l: f64,
    /// Slices where the body reaches the end of the field, by slice.
    pub(crate) truncated: Vec<bool>,
    /// Volume of dense objects taken off the skin, cm³.
    pub(crate) foreign_cm3: f64,
    /// The larger of these, largest first.
    pub(crate) left_off: Vec<Device>,
    /// Volume of the implants, ml.
    pub(crate) implant_ml: f64,
    /// Metal devices under the skin.
    pub(crate) devices: Vec<Device>,
}

impl Body {
    /// The body of these flags, nothing of it measured but the depth.
    pub(crate) fn new(frame: &Frame, flags: Vec<u8>, field: Vec<bool>, lung_l: f64) -> Self {
        let mut body = Self {
            flags,
            depth: Vec::new(),
            field,
            lung_l,
            truncated: vec![false; frame.size[2]],
            foreign_cm3: 0.0,
            left_off: Vec::new(),
            implant_ml: 0.0,
            devices: Vec::new(),
        };
        body.measure_depth(frame);
        body
    }

    /// Distance of a voxel to the air outside within its slice, mm; at most 25.5, 0 outside.
    #[inline]
    pub(crate) fn depth_mm(&self, n: usize) -> f32 {
        f32::from(self.depth[n]) / DEPTH_PER_MM
    }

    /// [`Self::depth_mm`] of a slice, in tenths of mm.
    pub(crate) fn depth_slice(&self, frame: &Frame, k: usize) -> &[u8] {
        &self.depth[k * frame.plane()..(k + 1) * frame.plane()]
    }

    /// Flags of a slice.
    pub(crate) fn flags_slice(&self, frame: &Frame, k: usize) -> &[u8] {
        &self.flags[k * frame.plane()..(k + 1) * frame.plane()]
    }

    /// The rows of a slice that hold the body, and one more at both sides.
    pub(crate) fn rows(&self, frame: &Frame, k: usize) -> Range<usize> {
        let (flags, [ni, nj, _]) = (self.flags_slice(frame, k), frame.size);
        let inside = |f: &u8| f & flag::BODY != 0;
        let first = flags.iter().position(inside).map_or(0, |n| n / ni);
        let last = flags.iter().rposition(inside).map_or(0, |n| n / ni);
        first.saturating_sub(1)..(last + 2).min(nj)
    }

    /// Measures the depth again after the body has changed.
    pub(crate) fn measure_depth(&mut self, frame: &Frame) {
        let spacing = [frame.spacing[0], frame.spacing[1]];
        self.depth.resize(self.flags.len(), 0);
        let (flags, field, plane) = (&self.flags, &self.field, frame.plane());
        self.depth.par_chunks_mut(plane).enumerate().for_each(|(k, out)| {
            let flags = &flags[k * plane..(k + 1) * plane];
            let outside: Vec<bool> =
                flags.iter().zip(field).map(|(f, &seen)| seen && f & flag::BODY == 0).collect();
            let reach = DEPTH_MM + frame.pixel();
            let squared = squared_distance(&outside, frame.size[0], spacing, reach);
            for n in 0..plane {
                // The skin lies half a pixel before the centre of the first pixel outside.
                let mm = squared[n].sqrt() - 0.5 * frame.pixel();
                let inside = flags[n] & flag::BODY != 0;
                out[n] = if inside { (mm * DEPTH_PER_MM).clamp(1.0, 255.0) as u8 } else { 0 };
            }
        });
    }

    /// A slice is truncated when 10 mm of the body's outline lie at the end of the field.
    pub(crate) fn find_truncation(&mut self, frame: &Frame) {
        let (ni, nj) = (frame.size[0], frame.size[1]);
        let edge: Vec<usize> = (0..frame.plane())
            .filter(|&n| {
                let (i, j) = (n % ni, n / ni);
                let at_end = i == 0 || j == 0 || i + 1 == ni || j + 1 == nj;
                let beyond = |m: usize| !self.field[m];
                self.field[n]
                    && (at_end
                        || beyond(n - 1)
                        || beyond(n + 1)
                        || beyond(n - ni)
                        || beyond(n + ni))
            })
            .collect();
        for k in 0..frame.size[2] {
            let flags = self.flags_slice(frame, k);
            let touching = edge.iter().filter(|&&n| flags[n] & flag::BODY != 0).count();
            self.truncated[k] = touching as f32 * frame.pixel() > 10.0;
        }
    }
}

//! How long an edge should be at a place.

use crate::Params;
use crate::boundary::Boundary;
use supine_space::Vector;

/// Soft tissue thinner than this (mm) is not meshed finer, or a wedge would eat the elements.
const THIN_MM: f64 = 2.5;
/// Longest edge in units of the local thickness.
const PER_THICKNESS: f64 = 1.8;
/// Rims refine their surroundings no further than this, mm.
const RIM_REACH_MM: f64 = 6.0;
/// Deeper than this (mm) the thickness is not thin.
const DEEP_MM: f64 = 6.0;

/// The size field: edge length wanted at each place, mm, as a multiple of one base length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sizing<'a> {
    /// The fields.
    pub fields: &'a dyn Boundary,
    /// Edge length at the surface, mm.
    pub base: f64,
    growth: f64,
    growth_limit: f64,
    rim: f64,
}

impl<'a> Sizing<'a> {
    pub(crate) fn new(fields: &'a dyn Boundary, params: &Params, base: f64) -> Self {
        let Params { growth, growth_limit, rim_refinement: rim, .. } = *params;
        Self { fields, base, growth, growth_limit, rim }
    }

    /// Edge length wanted at `p`, mm.
    pub(crate) fn at(&self, p: &Vector) -> f64 {
        self.fields.refined(self.at_surfaces(p), p)
    }

    /// That without refinement.
    pub(crate) fn at_surfaces(&self, p: &Vector) -> f64 {
        let depth = self.fields.depth(p);
        let mut size = self.base * (1.0 + self.growth * depth / self.base).min(self.growth_limit);
        let reach = self.base.min(RIM_REACH_MM);
        if self.rim < 1.0 && depth < reach + DEEP_MM {
            let near = (self.fields.rim_distance(p) / reach).min(1.0);
            size *= self.rim + (1.0 - self.rim) * near;
        }
        if depth > DEEP_MM {
            return size;
        }
        size.min(PER_THICKNESS * self.fields.thickness(p).max(THIN_MM))
    }
}

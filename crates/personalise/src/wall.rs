//! What the uncertain place of the chest wall does to the displacement of the tumour.

use supine_fem::WallNode;
use supine_record::UncertainPatch;
use supine_space::{Matrix, Point, Vector};

/// Errors of the wall at two places are alike when these are near: their correlation falls as
/// exp(-d²/2L²) with this L, mm. Chosen: a rib and the gap beside it, or the border of a muscle.
const ALIKE_MM: f64 = 20.0;
/// Standard deviations that 19 of 20 errors do not exceed, either way.
const NINETEEN_OF_TWENTY: f64 = 1.96;

/// Nodes of the wall and the error (mm) that 19 of 20 places like each do not exceed.
pub(crate) struct Wall<'a> {
    pub(crate) nodes: &'a [WallNode],
    pub(crate) error_mm: Vec<f64>,
}

impl Wall<'_> {
    /// Covariance of the tumour's displacement, mm².
    pub(crate) fn covariance(&self) -> Matrix {
        let changes: Vec<(Point, Vector)> = self
            .nodes
            .iter()
            .zip(&self.error_mm)
            .map(|(node, error)| (node.place, node.change * (error / NINETEEN_OF_TWENTY)))
            .collect();
        let row = |(p, a): &(Point, Vector)| {
            let alike = |(q, b): &(Point, Vector)| {
                b * (-(p - q).norm_squared() / (2.0 * ALIKE_MM * ALIKE_MM)).exp()
            };
            a * changes.iter().map(alike).sum::<Vector>().transpose()
        };
        changes.iter().map(row).sum()
    }

    /// Length by which the tumour's displacement changes when the wall is off by the error of each
    /// uncertain place there, all to one side, mm.
    pub(crate) fn effects_mm(&self, patches: &[UncertainPatch]) -> Vec<f64> {
        let effect = |patch: &UncertainPatch| {
            // As far as a round place of its area reaches.
            let reach = (patch.area_cm2 * 100.0 / std::f64::consts::PI).sqrt();
            let centre = Point::from(patch.centre_mm);
            let within = |node: &&WallNode| (node.place - centre).norm() <= reach;
            let change: Vector = self.nodes.iter().filter(within).map(|node| node.change).sum();
            change.norm() * patch.error_mm
        };
        patches.iter().map(effect).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(apart: f64) -> Vec<WallNode> {
        let at = |n: f64| WallNode {
            place: Point::new(n * apart, 0.0, 0.0),
            change: Vector::new(0.1, 0.0, 0.0),
        };
        vec![at(0.0), at(1.0)]
    }

    #[test]
    fn near_errors_add_and_far_ones_do_not() {
        let deviation = |apart: f64| {
            let nodes = nodes(apart);
            Wall { nodes: &nodes, error_mm: vec![NINETEEN_OF_TWENTY; 2] }.covariance()[(0, 0)]
                .sqrt()
        };
        assert!((deviation(0.0) - 0.2).abs() < 1e-12);
        assert!((deviation(1000.0) - 0.1 * 2.0f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_place_counts_with_its_own_nodes() {
        let nodes = nodes(30.0);
        let wall = Wall { nodes: &nodes, error_mm: vec![1.0; 2] };
        let patch = UncertainPatch {
            area_cm2: 3.1,
            centre_mm: [0.0; 3],
            error_mm: 3.0,
            place: String::new(),
            effect_mm: None,
            seeds_mm: vec![],
        };
        assert!((wall.effects_mm(&[patch])[0] - 0.3).abs() < 1e-12);
    }
}

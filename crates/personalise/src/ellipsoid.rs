//! The ellipsoid that holds most of a cloud of places.

use supine_space::{Matrix, Vector};

/// Least semi-axis, mm: a flat cloud still is a body.
const LEAST_MM: f64 = 1e-3;

/// An ellipsoid of displacements, LPS, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Its centre: the mean displacement.
    pub centre: Vector,
    /// Its semi-axes, the longest first.
    pub axes: [Vector; 3],
}

impl Ellipsoid {
    /// The ellipsoid of the cloud's mean and covariance that holds this share of it.
    pub(crate) fn holding(share: f64, cloud: &[Vector]) -> Self {
        let centre = cloud.iter().sum::<Vector>() / cloud.len() as f64;
        let outer = |v: &Vector| (v - centre) * (v - centre).transpose();
        let covariance: Matrix = cloud.iter().map(outer).sum::<Matrix>() / cloud.len() as f64;
        let eigen = covariance.symmetric_eigen();
        let mut axes: Vec<(f64, Vector)> = (0..3)
            .map(|k| {
                (
                    eigen.eigenvalues[k].max(0.0).sqrt().max(LEAST_MM),
                    eigen.eigenvectors.column(k).into(),
                )
            })
            .collect();
        axes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let far = |v: &Vector| {
            axes.iter()
                .map(|(length, axis)| (axis.dot(&(v - centre)) / length).powi(2))
                .sum::<f64>()
        };
        let mut distances: Vec<f64> = cloud.iter().map(far).collect();
        distances.sort_by(f64::total_cmp);
        let last = ((distances.len() as f64 * share).ceil() as usize).clamp(1, distances.len()) - 1;
        let factor = distances[last].sqrt();
        let axis = |k: usize| {
            // One sign of two: the largest component is positive.
            let (length, axis) = axes[k];
            let sign = axis[axis.iamax()].signum();
            axis * (sign * length * factor)
        };
        Self { centre, axes: [0, 1, 2].map(axis) }
    }

    /// Whether it holds a displacement.
    pub fn holds(&self, displacement: &Vector) -> bool {
        let off = displacement - self.centre;
        self.axes.iter().map(|axis| (axis.dot(&off) / axis.norm_squared()).powi(2)).sum::<f64>()
            <= 1.0 + 1e-9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_holds_its_share_of_the_cloud() {
        let cloud: Vec<Vector> = (0..1000)
            .map(|n| {
                let t = f64::from(n) / 999.0 - 0.5;
                Vector::new(8.0 * t, 3.0 * (n as f64 * 0.7).sin(), 0.5 * (n as f64 * 1.3).cos())
            })
            .collect();
        let found = Ellipsoid::holding(0.95, &cloud);
        let inside = cloud.iter().filter(|v| found.holds(v)).count();
        assert!((949..=951).contains(&inside), "{inside}");
        assert!(found.axes[0].normalize().x > 0.99 && found.axes[2].normalize().z.abs() > 0.99);
        assert!(found.axes[0].dot(&found.axes[1]).abs() < 1e-9);
    }
}

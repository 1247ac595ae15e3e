//! Normals: as given, from triangles, from the points near by.

use super::cells::representatives;
use super::{NormalSource, Scan, ScanError, ScanInfo, orient};
use crate::PointTree;
use rayon::prelude::*;
use supine_space::{Matrix, Point, Vector};

/// Given normals are taken when at least this share of them is usable.
const USABLE: f64 = 0.5;
/// Given normals whose mean is longer than this are all alike: nobody computed them.
const ALIKE: f64 = 0.999;
/// Triangles around a point disagree about the sides where less than this share of their area
/// remains in the sum, and tell nothing when that is so at more than a share of the points.
const AGREE: f64 = 0.5;
const DISAGREE: f64 = 0.05;
/// Planes go through points this far apart, mm, so that noise does not tilt them, and through so
/// many beside the first.
const SPARSE_MM: f64 = 2.0;
const AROUND: usize = 16;
/// A missing normal is the mean of so many near by.
const MEND: usize = 4;

/// Gives every point of a scan a unit normal.
pub(super) fn complete(scan: &mut Scan, info: &mut ScanInfo) -> Result<(), ScanError> {
    let given = std::mem::take(&mut scan.normals);
    let had = !given.is_empty();
    let (source, normals) = match usable(given) {
        Some(normals) => (NormalSource::Given, normals),
        None => match from_triangles(scan) {
            Some(normals) => (NormalSource::Triangles, normals),
            None => (NormalSource::Neighbours, from_neighbours(&scan.points)),
        },
    };
    info.normals = source;
    scan.normals = normals;
    if had && source != NormalSource::Given {
        let text = "most normals of the scan are missing or all alike: they are computed anew";
        info.warn("scan-normals-unusable", text, ("points", scan.points.len() as f64));
    }
    info.mended = mend(scan)?;
    Ok(())
}

/// Of unit length, if a normal has a direction.
pub(super) fn unit(normal: &Vector) -> Option<Vector> {
    // By its largest part first: the squares of very small and very large ones are no numbers.
    let largest = normal.amax();
    let finite = largest > 0.0 && normal.iter().all(|c| c.is_finite());
    finite.then(|| (normal / largest).normalize())
}

/// Twice the area of a triangle along its normal, mm².
pub(super) fn across(points: &[Point], triangle: &[u32; 3]) -> Vector {
    let [a, b, c] = triangle.map(|p| points[p as usize]);
    (b - a).cross(&(c - a))
}

/// Given normals of unit length, zero where there is none; `None` when too few are left.
fn usable(mut normals: Vec<Vector>) -> Option<Vec<Vector>> {
    normals.par_iter_mut().for_each(|n| *n = unit(n).unwrap_or_default());
    let count = normals.iter().filter(|n| **n != Vector::zeros()).count() as f64;
    let mean = normals.iter().sum::<Vector>() / count.max(1.0);
    (count > 0.0 && count >= USABLE * normals.len() as f64 && mean.norm() < ALIKE)
        .then_some(normals)
}

/// The mean of the triangles around each point by their area, zero where there is none; `None` when
/// they do not tell.
fn from_triangles(scan: &Scan) -> Option<Vec<Vector>> {
    let mut sums = vec![(Vector::zeros(), 0.0); scan.points.len()];
    for triangle in &scan.triangles {
        let normal = across(&scan.points, triangle);
        for &corner in triangle {
            let (sum, area) = &mut sums[corner as usize];
            *sum += normal;
            *area += normal.norm();
        }
    }
    let with = sums.iter().filter(|s| s.1 > 0.0).count() as f64;
    let against = sums.iter().filter(|s| s.0.norm() < AGREE * s.1).count() as f64;
    let enough = with >= USABLE * scan.points.len() as f64;
    (enough && against <= DISAGREE * with)
        .then(|| sums.iter().map(|s| unit(&s.0).unwrap_or_default()).collect())
}

/// Normals of planes through the points near by, each away from the middle as a whole.
fn from_neighbours(points: &[Point]) -> Vec<Vector> {
    let few = representatives(points, SPARSE_MM);
    let sparse: Vec<Point> = few.iter().map(|&n| points[n as usize]).collect();
    let tree = PointTree::new(&sparse);
    let near = |p: &Point| tree.nearest_few(p, AROUND + 1, f64::INFINITY);
    let around: Vec<(Vector, Vec<u32>)> = sparse
        .par_iter()
        .map(|p| {
            let near = near(p);
            let normal = plane(near.iter().map(|found| &sparse[found.0]));
            // The first is the point itself.
            let links = near.iter().skip(1).take(orient::LINKS).map(|found| found.0 as u32);
            (normal.unwrap_or_default(), links.collect())
        })
        .collect();
    let (mut normals, links): (Vec<Vector>, Vec<Vec<u32>>) = around.into_iter().unzip();
    orient::orient(&sparse, &mut normals, &links);
    let of_nearest = |p: &Point| {
        let nearest = tree.nearest(p, f64::INFINITY);
        nearest.map(|found| normals[found.0]).unwrap_or_default()
    };
    points.par_iter().map(of_nearest).collect()
}

/// The normal of the plane that fits points best, of either sign.
fn plane<'a>(points: impl ExactSizeIterator<Item = &'a Point> + Clone) -> Option<Vector> {
    let count = points.len() as f64;
    let mean = points.clone().map(|p| p.coords).sum::<Vector>() / count;
    let spread: Matrix = points.map(|p| p.coords - mean).map(|d| d * d.transpose()).sum();
    thinnest(&(spread / count))
}

/// The direction in which a symmetric matrix has its smallest eigenvalue, `None` when there are
/// several.
///
/// Source: Smith, Commun. ACM 4, 1961, for the eigenvalue.
fn thinnest(matrix: &Matrix) -> Option<Vector> {
    let mean = matrix.trace() / 3.0;
    let apart = matrix - Matrix::identity() * mean;
    let scale = (apart.norm_squared() / 6.0).sqrt();
    if scale == 0.0 || !scale.is_finite() {
        return None;
    }
    let angle = ((apart / scale).determinant() / 2.0).clamp(-1.0, 1.0).acos() / 3.0;
    let smallest = 2.0 * scale * (angle + std::f64::consts::TAU / 3.0).cos();
    let rest = apart - Matrix::identity() * smallest;
    // Its rows lie across the direction; two of them that are not parallel give it.
    let rows = [0, 1, 2].map(|r| Vector::from(rest.row(r).transpose()));
    let crossed = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| rows[a].cross(&rows[b]));
    let longest = crossed.into_iter().max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    // Parallel rows, as far as the root of rounding tells: the points lie on a line.
    (longest.norm() > 1e-6 * scale * scale).then(|| longest.normalize())
}

/// Gives points without a normal the mean of those near by; how many.
fn mend(scan: &mut Scan) -> Result<usize, ScanError> {
    let has = |n: &u32| scan.normals[*n as usize] != Vector::zeros();
    let (with, without): (Vec<u32>, Vec<u32>) = (0..scan.points.len() as u32).partition(has);
    if with.is_empty() {
        return Err(ScanError::Line);
    }
    if without.is_empty() {
        return Ok(0);
    }
    let places: Vec<Point> = with.iter().map(|&n| scan.points[n as usize]).collect();
    let tree = PointTree::new(&places);
    let normal = |found: &(usize, f64)| scan.normals[with[found.0] as usize];
    let mended = |&n: &u32| {
        let near = tree.nearest_few(&scan.points[n as usize], MEND, f64::INFINITY);
        let mean: Vector = near.iter().map(normal).sum();
        // Opposite ones leave nothing: then the nearest.
        if mean.norm() > 0.1 { mean.normalize() } else { normal(&near[0]) }
    };
    let mended: Vec<Vector> = without.par_iter().map(mended).collect();
    for (&n, normal) in without.iter().zip(&mended) {
        scan.normals[n as usize] = *normal;
    }
    Ok(without.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_thinnest_direction_is_the_eigenvector(v in prop::array::uniform9(-2.0..2.0f64)) {
            let matrix = Matrix::from_row_slice(&v);
            let symmetric = matrix * matrix.transpose();
            let eigen = symmetric.symmetric_eigen();
            let smallest = eigen.eigenvalues.imin();
            let mut values: Vec<f64> = eigen.eigenvalues.iter().copied().collect();
            values.sort_by(f64::total_cmp);
            prop_assume!(values[1] - values[0] > 1e-3 * values[2]);
            let found = thinnest(&symmetric).unwrap();
            prop_assert!(found.dot(&eigen.eigenvectors.column(smallest)).abs() > 1.0 - 1e-9);
        }
    }

    #[test]
    fn a_line_has_no_plane() {
        let line: Vec<Point> =
            (0..9).map(|n| Point::from([0.3, 1.1, -0.7].map(|c| c * f64::from(n)))).collect();
        assert_eq!(plane(line.iter()), None);
        assert_eq!(plane(line[..1].iter()), None);
        let flat = [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 2.0, 5.0], [1.0, 1.0, 5.0]];
        let found = plane(flat.map(Point::from).iter()).unwrap();
        assert!(found.z.abs() > 1.0 - 1e-12);
    }

    #[test]
    fn tiny_and_huge_normals_have_a_direction() {
        for size in [1e-300, 1e-9, 7.0, 1e300] {
            let found = unit(&(Vector::new(0.0, 0.6, -0.8) * size)).unwrap();
            assert!((found - Vector::new(0.0, 0.6, -0.8)).norm() < 1e-12);
        }
        for bad in
            [Vector::zeros(), Vector::new(f64::NAN, 1.0, 0.0), Vector::new(f64::INFINITY, 1.0, 0.0)]
        {
            assert_eq!(unit(&bad), None);
        }
    }
}

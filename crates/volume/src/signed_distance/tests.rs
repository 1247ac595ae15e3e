use super::*;
use supine_space::{Matrix, Vector};

/// Voxels as a chest CT has them.
const SPACING: [f64; 3] = [1.4, 1.4, 5.0];
const BAND_MM: f64 = 10.0;

fn grid() -> Grid {
    let origin = Point::new(-48.0, -48.0, -60.0);
    Grid::new([70, 70, 25], SPACING.into(), origin, Matrix::identity()).unwrap()
}

/// The distance made from `f`, negative inside, with its linear crossings.
fn of(grid: &Grid, f: impl Fn(&Point) -> f64 + Sync) -> SignedDistance {
    let at = |n: usize| f(&grid.centre(grid.voxel(n)));
    let inside = |n: usize| at(n) < 0.0;
    SignedDistance::new(grid, BAND_MM, inside, |n, m| {
        // The true crossing, by bisection: f need not be linear.
        let (a, b) = (grid.centre(grid.voxel(n)), grid.centre(grid.voxel(m)));
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            let in_it = f(&(a + (b - a) * middle)) < 0.0;
            if in_it { low = middle } else { high = middle }
        }
        low as f32
    })
}

/// Largest error at voxels whose true distance is below `reach` (mm) and at most that far from
/// the border of the grid, mm.
fn worst(d: &SignedDistance, f: impl Fn(&Point) -> f64, reach: f64, margin: usize) -> f64 {
    let (grid, size) = (d.grid(), d.grid().size());
    (0..grid.len())
        .filter(|&n| {
            let v = grid.voxel(n);
            (0..3).all(|a| {
                v[a] >= margin.min(size[a] / 3) && v[a] + margin.min(size[a] / 3) < size[a]
            })
        })
        .map(|n| (d.mm(n), f(&grid.centre(grid.voxel(n)))))
        .filter(|(_, want)| want.abs() < reach)
        .map(|(got, want)| (got - want).abs())
        .fold(0.0, f64::max)
}

fn signs_agree(d: &SignedDistance, f: impl Fn(&Point) -> f64) {
    let grid = d.grid();
    for n in 0..grid.len() {
        let want = f(&grid.centre(grid.voxel(n))) < 0.0;
        assert_eq!(d.is_inside(n), want, "{:?}", grid.voxel(n));
        assert!(d.mm(n) != 0.0 && d.mm(n).abs() <= BAND_MM, "{}", d.mm(n));
    }
}

#[test]
fn planes_are_exact_in_long_voxels() {
    let grid = grid();
    for normal in [[1.0, 0.0, 0.0], [0.3, -0.8, 0.4], [0.6, 0.1, 0.75], [0.05, 0.1, 1.0]] {
        let normal = Vector::from(normal).normalize();
        let f = |p: &Point| p.coords.dot(&normal) - 0.37;
        let d = of(&grid, f);
        signs_agree(&d, f);
        let error = worst(&d, f, 0.95 * BAND_MM, 12);
        assert!(error < 0.01, "{normal:?}: {error}");
        let at = Point::new(0.3, -0.2, 1.1) + normal * 0.5;
        assert!((d.at(&at) - f(&at)).abs() < 0.003, "{normal:?}: {}", d.at(&at) - f(&at));
    }
}

#[test]
fn a_sphere_is_told_to_a_fraction_of_a_voxel() {
    let grid = grid();
    let f = |p: &Point| p.coords.norm() - 30.0;
    let d = of(&grid, f);
    signs_agree(&d, f);
    let (near, far) = (worst(&d, f, 1.4, 1), worst(&d, f, 9.0, 1));
    assert!(near < 0.1 && far < 0.6, "{near} {far}");
}

#[test]
fn a_slab_thinner_than_a_voxel_keeps_its_sides() {
    let grid = grid();
    // 1.1 mm thick, less than the spacing, across i.
    let f = |p: &Point| (p.x - 0.7).abs() - 0.55;
    let d = of(&grid, f);
    signs_agree(&d, f);
    let error = worst(&d, f, 9.0, 1);
    assert!(error < 0.01, "{error}");
    let layers = grid.size()[0];
    assert!((0..layers).any(|i| d.is_inside(grid.offset([i, 30, 10]))), "the slab is seen");
}

#[test]
fn nothing_and_everything_are_far() {
    let grid = grid();
    for inside in [false, true] {
        let d = SignedDistance::new(&grid, BAND_MM, |_| inside, |_, _| 0.5);
        let want = if inside { -BAND_MM } else { BAND_MM };
        assert!((0..grid.len()).all(|n| (d.mm(n) - want).abs() < 1e-9));
    }
}

#[test]
fn crossings_are_given_back() {
    let grid = grid();
    let normal = Vector::new(0.6, 0.1, 0.75).normalize();
    let d = of(&grid, |p| p.coords.dot(&normal) - 0.37);
    let again = SignedDistance::new(&grid, BAND_MM, |n| d.is_inside(n), |n, m| d.crossing(n, m));
    let [ni, nj, nk] = grid.size();
    // At the border of the grid the surface leaves by a side that is not there.
    let within = |n: &usize| {
        let [i, j, k] = grid.voxel(*n);
        i.min(j) > 4 && i.max(j) + 5 < ni.min(nj) && k > 0 && k + 1 < nk
    };
    let near = (0..grid.len()).filter(within).filter(|&n| d.mm(n).abs() < 1.4);
    let change = near.map(|n| (d.mm(n) - again.mm(n)).abs()).fold(0.0, f64::max);
    assert!(change < 0.01, "{change}");
}

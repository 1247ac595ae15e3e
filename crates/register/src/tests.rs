//! A torso with one breast, scanned from somewhere.

use super::*;
use nalgebra::{Translation3, UnitQuaternion};
use supine_mesh::Scan;
use supine_space::{Grid, Matrix, Point, Pose, Progress, Vector};
use supine_volume::SignedDistance;

/// Negative inside an elliptic cylinder along z with a breast on its left front, mm.
fn body(p: &Point) -> f64 {
    let torso = ((p.x / 150.0).powi(2) + (p.y / 100.0).powi(2)).sqrt() * 100.0 - 100.0;
    let breast = (p - Point::new(65.0, -75.0, 10.0)).norm() - 50.0;
    // Smooth where both meet.
    let (k, h) = (12.0, 0.5 * (torso - breast) / 12.0);
    let h = (0.5 + h).clamp(0.0, 1.0);
    breast * h + torso * (1.0 - h) - k * h * (1.0 - h)
}

fn skin() -> Skin {
    let origin = Point::new(-171.0, -141.0, -120.0);
    let grid =
        Grid::new([115, 95, 49], [3.0, 3.0, 5.0].into(), origin, Matrix::identity()).unwrap();
    let at = |n: usize| body(&grid.centre(grid.voxel(n)));
    let share = |n: usize, m: usize| (at(n) / (at(n) - at(m))) as f32;
    Skin::of(&SignedDistance::new(&grid, 12.0, |n| at(n) < 0.0, share))
}

fn surface(skin: &Skin) -> Rigid {
    let weights = skin.points().iter().map(|p| if p.y < 40.0 { 1.0 } else { 0.0 }).collect();
    Rigid { points: skin.points().to_vec(), triangles: skin.triangles().to_vec(), weights }
}

/// The front of the body, between the voxels, in a frame of its own.
fn scan(from_scan: &Pose) -> Scan {
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    for k in 0..40 {
        for i in 0..90 {
            let angle = (200.0 + 140.0 * f64::from(i) / 89.0).to_radians();
            let out = Vector::new(angle.cos(), angle.sin(), 0.0);
            let (mut low, mut high) = (60.0, 200.0);
            let at = |r: f64| Point::new(0.0, 0.0, -95.0 + 4.8 * f64::from(k)) + out * r;
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if body(&at(middle)) < 0.0 { low = middle } else { high = middle }
            }
            let p = at(low);
            let slope = [0, 1, 2].map(|a| {
                let step = Vector::ith(a, 1e-4);
                body(&(p + step)) - body(&(p - step))
            });
            points.push(from_scan.inverse() * p);
            normals.push(from_scan.rotation.inverse() * Vector::from(slope));
        }
    }
    Scan::new(points, Some(normals), vec![]).unwrap().0
}

fn pose(angles: [f64; 3], shift: [f64; 3]) -> Pose {
    let [a, b, c] = angles;
    Pose::from_parts(
        Translation3::from(Vector::from(shift)),
        UnitQuaternion::from_euler_angles(a, b, c),
    )
}

fn params() -> Params<'static> {
    let centre = Point::new(65.0, -75.0, 10.0);
    Params {
        centre,
        reach_mm: [20.0, 4.0],
        iterations: 40,
        pose: true,
        prior_mm2: 0.0,
        counts: None,
    }
}

/// Distance (mm) at the breast and turn (degrees) between two poses.
fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    let own = b.inverse() * params().centre;
    ((a * own - params().centre).norm(), a.rotation.angle_to(&b.rotation).to_degrees())
}

#[test]
fn a_scan_comes_back_from_a_rough_start() {
    let truth = pose([0.4, -1.1, 2.0], [120.0, -60.0, 300.0]);
    let start = pose([0.06, 0.05, -0.08], [9.0, -7.0, 8.0]) * truth;
    let start = Start { pose: start, values: vec![] };
    let found =
        align(&scan(&truth), &surface(&skin()), &start, &params(), Progress::none()).unwrap();
    let (mm, degrees) = apart(&found.pose, &truth);
    assert!(mm < 0.15 && degrees < 0.1, "{mm} mm, {degrees} degrees");
    let distances: Vec<f64> = found.matches.0.iter().map(|m| m.residual_mm.abs()).collect();
    assert!(distances.iter().sum::<f64>() / (distances.len() as f64) < 0.1);
}

#[test]
fn a_scan_is_found_without_landmarks_from_anywhere() {
    let shape = surface(&skin());
    for truth in
        [pose([0.4, -1.1, 2.0], [120.0, -60.0, 300.0]), pose([-2.5, 0.7, -0.4], [0.0, 500.0, 9.0])]
    {
        let found = candidates(&scan(&truth), &shape, &[], Progress::none()).unwrap();
        let (mm, degrees) = apart(&found[0].1, &truth);
        assert!(mm < 1.0 && degrees < 0.5, "{mm} mm, {degrees} degrees");
        assert!(found.get(1).is_none_or(|next| next.0 > 2.0 * found[0].0 + 1.0), "{found:?}");
    }
}

#[test]
fn a_scan_of_something_else_is_refused() {
    let far = Start { pose: pose([0.0; 3], [2000.0, 0.0, 0.0]), values: vec![] };
    let found =
        align(&scan(&Pose::identity()), &surface(&skin()), &far, &params(), Progress::none());
    assert!(matches!(found, Err(Error::Apart { matched: 0, .. })), "{found:?}");
}

/// A scaled surface of which it is known that its scale is right.
struct Held<'a>(Scaled<'a>, [Prior; 1]);

impl Shape for Held<'_> {
    fn triangles(&self) -> &[[u32; 3]] {
        self.0.triangles()
    }

    fn weights(&self) -> &[f64] {
        self.0.weights()
    }

    fn priors(&self) -> &[Prior] {
        &self.1
    }

    fn points(&self, values: &[f64]) -> Vec<Point> {
        self.0.points(values)
    }

    fn slopes(&self, values: &[f64]) -> Vec<Vec<Vector>> {
        self.0.slopes(values)
    }
}

#[test]
fn a_parameter_is_found_with_the_pose_and_a_prior_pulls_it() {
    let truth = pose([0.02, 0.01, -0.03], [2.0, 1.0, -2.0]);
    let larger = scan(&truth);
    let scaled =
        |p: &Point| truth.inverse() * (params().centre + (truth * p - params().centre) * 1.02);
    let points = larger.points().iter().map(scaled).collect();
    let larger = Scan::new(points, Some(larger.normals().to_vec()), vec![]).unwrap().0;
    let (surface, start) = (surface(&skin()), Start { pose: Pose::identity(), values: vec![0.0] });
    let scaled = || Scaled::new(&surface, params().centre);
    let free = align(&larger, &scaled(), &start, &params(), Progress::none()).unwrap();
    assert!((free.values[0] - 0.02).abs() < 1e-3 && !free.at_end[0], "{:?}", free.values);
    let (mm, degrees) = apart(&free.pose, &truth);
    assert!(mm < 0.3 && degrees < 0.15, "{mm} mm, {degrees} degrees");
    let prior = Prior { mean: 0.0, deviation: 1e-4, range: [-0.1, 0.1], step: 0.05 };
    let held = Params { prior_mm2: 1e-2, ..params() };
    let held = align(&larger, &Held(scaled(), [prior]), &start, &held, Progress::none()).unwrap();
    assert!(held.values[0].abs() < 2e-3, "{:?}", held.values);
}

#[test]
fn many_threads_give_the_bytes_of_one() {
    let truth = pose([0.1, 0.2, 0.3], [10.0, 20.0, 30.0]);
    let start = Start { pose: pose([0.03, 0.0, 0.02], [4.0, 2.0, 1.0]) * truth, values: vec![] };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            align(&scan(&truth), &surface(&skin()), &start, &params(), Progress::none()).unwrap()
        })
    };
    assert_eq!(on(1).pose, on(3).pose);
}

#[test]
fn distances_are_those_of_a_shifted_scan() {
    let shape = surface(&skin());
    let posed = Posed::new(&shape, &[]);
    let shift = Pose::translation(0.0, -0.5, 0.0);
    let found = signed_distances(&scan(&Pose::identity()), &shift, &posed, &shape.weights, 5.0);
    let front = supine_space::Sphere::new(Point::new(0.0, -100.0, 0.0), 30.0).unwrap();
    let spread = found.within(&front).spread();
    assert!(
        (spread.mean_mm - 0.5).abs() < 0.05 && spread.max_mm < 0.8 && spread.points > 20,
        "{spread:?}"
    );
}

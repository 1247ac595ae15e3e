//! Poses to begin from when no landmark is known.

use crate::{Matches, Params, Posed, Shape, Start, Tukey, align};
use nalgebra::{Rotation3, Translation3, UnitQuaternion};
use rayon::prelude::*;
use supine_mesh::Scan;
use supine_space::{Point, Pose, Progress, Stopped, Vector};

/// Distance between points of the scan in the first look, mm, and in the second.
const COARSE_MM: [f64; 2] = [16.0, 8.0];
/// Distance between points of the surface in the first look, mm.
const SURFACE_MM: f64 = 6.0;
/// Turns about the direction that the scan looks, and how far that direction is tilted, degrees.
const TURNS: usize = 24;
const TILT_DEG: f64 = 22.0;
const TILTS: usize = 6;
/// Shifts along the body and across it, mm, in units of a step.
const ALONG_MM: f64 = 60.0;
const ALONG: i32 = 3;
const ACROSS_MM: f64 = 60.0;
const ACROSS: i32 = 1;
/// How many are refined, and how many of these again with more points.
const REFINED: [usize; 2] = [40, 8];
/// Reach of the loss by which the first look ranks, mm.
const REACH_MM: f64 = 40.0;
/// Poses nearer than this are one: mm at the middle, and degrees.
const SAME: (f64, f64) = (15.0, 10.0);

/// A pose and how well it fits: the mean loss of the scan's points, mm², those that belong nowhere
/// counted in full.
type Ranked = (f64, Pose);

/// Poses of a scan on a shape, best first, each with the mean loss (mm²) of the scan's points under
/// a reach of 10 mm; those that belong nowhere count in full.
///
/// The scan looks at the front of the body: the mean of its normals is brought near the mean of
/// those of the shape's points that count, with tilts and turns about it, and shifts of its middle.
/// The best are refined. Nothing random.
///
/// # Errors
/// When the user stops.
pub fn candidates(
    scan: &Scan,
    shape: &dyn Shape,
    values: &[f64],
    progress: Progress<'_>,
) -> Result<Vec<Ranked>, Stopped> {
    let posed = Posed::new(shape, values);
    let [few, more] = COARSE_MM.map(|mm| scan.thinned(mm));
    let front = Front::of(&posed, shape.weights());
    let starts = front.poses(&few);
    let rank = |scan: &Scan, pose: &Pose, (surface, reach_mm): (&Posed, f64)| {
        loss(scan, pose, surface, shape.weights(), reach_mm)
    };
    let sparse = posed.sparser(SURFACE_MM);
    let first = |pose: &Pose| (rank(&few, pose, (&sparse, REACH_MM)), *pose);
    let mut ranked: Vec<Ranked> = starts.par_iter().map(first).collect();
    progress.at(0.3)?;
    for (scan, count, reach) in [(&few, REFINED[0], [60.0, 20.0]), (&more, REFINED[1], [20.0, 6.0])]
    {
        let chosen = distinct(ranked, front.middle, count);
        let refine = |(_, pose): &Ranked| {
            let start = Start { pose: *pose, values: values.to_vec() };
            let params = Params {
                centre: front.middle,
                reach_mm: reach,
                iterations: 25,
                pose: true,
                prior_mm2: 0.0,
                counts: None,
            };
            let aligned = align(
                scan,
                &Fixed { shape, values },
                &Start { values: vec![], ..start },
                &params,
                Progress::none(),
            );
            let pose = aligned.map_or(*pose, |aligned| aligned.pose);
            (rank(scan, &pose, (&posed, 10.0)), pose)
        };
        ranked = chosen.par_iter().map(refine).collect();
        progress.at(if count == REFINED[0] { 0.7 } else { 1.0 })?;
    }
    Ok(distinct(ranked, front.middle, REFINED[1]))
}

/// A shape whose parameters stay.
struct Fixed<'a> {
    shape: &'a dyn Shape,
    values: &'a [f64],
}

impl Shape for Fixed<'_> {
    fn triangles(&self) -> &[[u32; 3]] {
        self.shape.triangles()
    }

    fn weights(&self) -> &[f64] {
        self.shape.weights()
    }

    fn points(&self, _: &[f64]) -> Vec<Point> {
        self.shape.points(self.values)
    }
}

/// The part of a surface that counts.
struct Front {
    middle: Point,
    /// Mean normal.
    towards: Vector,
}

impl Front {
    fn of(posed: &Posed, weights: &[f64]) -> Self {
        let (mut middle, mut towards, mut sum) = (Vector::zeros(), Vector::zeros(), 0.0);
        for ((p, n), w) in posed.points.iter().zip(posed.normals.iter()).zip(weights) {
            middle += p.coords * *w;
            towards += n * *w;
            sum += w;
        }
        let middle = Point::from(middle / f64::max(sum, f64::MIN_POSITIVE));
        Self { middle, towards: towards.try_normalize(0.0).unwrap_or(-Vector::y()) }
    }

    /// All poses that are looked at.
    fn poses(&self, scan: &Scan) -> Vec<Pose> {
        let n = scan.points().len().max(1) as f64;
        let own = Point::from(scan.points().iter().map(|p| p.coords).sum::<Vector>() / n);
        let looks = scan.normals().iter().sum::<Vector>().try_normalize(0.0).unwrap_or(Vector::z());
        let face = Rotation3::rotation_between(&looks, &self.towards)
            .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector::x_axis(), std::f64::consts::PI));
        let across = self.towards.cross(&Vector::z()).try_normalize(0.0).unwrap_or(Vector::x());
        let along = across.cross(&self.towards);
        let circle = |n: usize, of: usize| 2.0 * std::f64::consts::PI * n as f64 / of as f64;
        let mut tilts = vec![Rotation3::identity()];
        tilts.extend((0..TILTS).map(|n| {
            let (sin, cos) = circle(n, TILTS).sin_cos();
            Rotation3::new((across * cos + along * sin) * TILT_DEG.to_radians())
        }));
        let mut poses = Vec::new();
        for turn in (0..TURNS).map(|n| Rotation3::new(self.towards * circle(n, TURNS))) {
            for tilt in &tilts {
                let rotation = UnitQuaternion::from_rotation_matrix(&(tilt * turn * face));
                for (i, j) in (-ALONG..=ALONG).flat_map(|i| (-ACROSS..=ACROSS).map(move |j| (i, j)))
                {
                    let to = self.middle
                        + along * (f64::from(i) * ALONG_MM)
                        + across * (f64::from(j) * ACROSS_MM);
                    let shift = Translation3::from(to.coords - rotation * own.coords);
                    poses.push(Pose::from_parts(shift, rotation));
                }
            }
        }
        poses
    }
}

/// Mean loss of the points of a scan, those that belong nowhere counted in full, mm².
fn loss(scan: &Scan, pose: &Pose, posed: &Posed, weights: &[f64], reach_mm: f64) -> f64 {
    let loss = Tukey { reach_mm };
    let matches = Matches::new(scan, pose, posed, weights, reach_mm);
    let full = loss.loss(f64::INFINITY);
    let saved: f64 = matches.0.iter().map(|m| full - loss.loss(m.residual_mm)).sum();
    full - saved / scan.points().len().max(1) as f64
}

/// The best poses of which no two are the same.
fn distinct(mut ranked: Vec<Ranked>, middle: Point, count: usize) -> Vec<Ranked> {
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut kept: Vec<Ranked> = Vec::new();
    for (loss, pose) in ranked {
        let same = |other: &Ranked| {
            let own = pose.inverse() * middle;
            let apart = (other.1 * own - middle).norm();
            let turn = other.1.rotation.angle_to(&pose.rotation).to_degrees();
            apart < SAME.0 && turn < SAME.1
        };
        if kept.len() < count && !kept.iter().any(same) {
            kept.push((loss, pose));
        }
    }
    kept
}

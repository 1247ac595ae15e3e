//! The edge length at which a mesher that knows no counts comes to a count.

use crate::Error;
use std::time::Instant;
use supine_mesh::TetMesh;
use supine_space::Progress;

/// A step of the search changes the edge length by this factor at most.
const STEP: f64 = 1.5;

/// When a search ends.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Meshes made at most; 1 or more.
    pub tries: usize,
    /// A count this far off (share) is near enough.
    pub near: f64,
}

/// Near enough for our own mesher to do the rest.
impl Default for Effort {
    fn default() -> Self {
        Self { tries: 5, near: 0.02 }
    }
}

/// What a search found.
#[derive(Clone, Debug)]
pub struct Found {
    /// The mesh with the count nearest to the asked one.
    pub mesh: TetMesh,
    /// Every mesh that was made, in order.
    pub tries: Vec<Try>,
}

/// A mesh that was made on the way.
#[derive(Clone, Copy, Debug)]
pub struct Try {
    /// Edge length asked for, mm.
    pub edge_mm: f64,
    /// Tetrahedra made.
    pub tetrahedra: usize,
    /// Time it took, s.
    pub seconds: f64,
}

/// Asks for meshes by edge length (mm) until one has about the asked number of tetrahedra, and
/// returns the nearest. `volume`: of what is meshed, mm³.
///
/// # Errors
/// When a mesh cannot be made or the progress callback says stop.
pub fn by_edge_length(
    volume: f64,
    (asked, effort): (usize, Effort),
    progress: Progress<'_>,
    mut mesh: impl FnMut(f64, Progress<'_>) -> Result<TetMesh, Error>,
) -> Result<Found, Error> {
    let off = |count: usize| (count as f64 / asked as f64).ln();
    let mut edge = (72f64.sqrt() * volume / asked as f64).cbrt();
    let mut tries: Vec<Try> = Vec::new();
    let mut nearest: Option<TetMesh> = None;
    for n in 0..effort.tries.max(1) {
        let start = Instant::now();
        let made = mesh(edge, progress.part(share(n), share(n + 1)))?;
        let (count, seconds) = (made.tets().len(), start.elapsed().as_secs_f64());
        tries.push(Try { edge_mm: edge, tetrahedra: count, seconds });
        if nearest.as_ref().is_none_or(|near| off(count).abs() < off(near.tets().len()).abs()) {
            nearest = Some(made);
        }
        if off(count).abs() <= effort.near {
            break;
        }
        edge = next(&tries, off);
    }
    progress.at(1.0)?;
    // The first mesh is always kept.
    nearest.map(|mesh| Found { mesh, tries }).ok_or(Error::Stopped)
}

/// The share of the work after so many tries: half of what is left is for the next.
fn share(tries: usize) -> f64 {
    1.0 - 0.5f64.powi(tries as i32)
}

/// The next edge length: between the nearest from above and below when there are both, else by the
/// cube law. Interpolates the logarithms, within the middle nine tenths.
fn next(tries: &[Try], off: impl Fn(usize) -> f64) -> f64 {
    let points = || tries.iter().map(|t| (t.edge_mm.ln(), off(t.tetrahedra)));
    let many = points().filter(|p| p.1 > 0.0).min_by(|a, b| a.1.total_cmp(&b.1));
    let few = points().filter(|p| p.1 <= 0.0).max_by(|a, b| a.1.total_cmp(&b.1));
    let step = STEP.ln();
    match (many, few) {
        (Some((a, too_many)), Some((b, too_few))) => {
            let share = (too_many / (too_many - too_few)).clamp(0.05, 0.95);
            (a + (b - a) * share).exp()
        }
        (Some((edge, off)), None) | (None, Some((edge, off))) => {
            (edge + (off / 3.0).clamp(-step, step)).exp()
        }
        (None, None) => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_mesh::{BoundaryFace, BoundaryTag, TET_FACES};
    use supine_space::Point;

    /// Tetrahedra side by side: a mesh in nothing but number.
    fn many(count: usize) -> TetMesh {
        let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
        let (mut points, mut tets, mut faces) = (Vec::new(), Vec::new(), Vec::new());
        for n in 0..count {
            let first = points.len() as u32;
            points.extend(corners.map(|[x, y, z]| Point::new(x + 2.0 * n as f64, y, z)));
            tets.push([0, 1, 2, 3].map(|c| first + c));
            faces.extend(TET_FACES.map(|f| BoundaryFace {
                points: f.map(|c| first + c as u32),
                tag: BoundaryTag::Skin,
            }));
        }
        TetMesh::new(points, tets, faces).unwrap()
    }

    /// A mesher whose count follows a power of the edge length.
    fn by_power(scale: f64, power: f64) -> Found {
        let count = |edge: f64| (scale * edge.powf(-power)).round().max(1.0) as usize;
        by_edge_length(8000.0, (400, Effort::default()), Progress::none(), |edge, _| {
            Ok(many(count(edge)))
        })
        .unwrap()
    }

    #[test]
    fn a_count_is_found_whatever_the_law() {
        for (scale, power) in [(60_000.0, 3.0), (20_000.0, 2.4), (300_000.0, 3.3)] {
            let found = by_power(scale, power);
            let got = found.mesh.tets().len();
            assert!((392..=408).contains(&got), "{scale} {power}: {:?}", found.tries);
            assert!(found.tries.len() <= Effort::default().tries);
        }
    }

    #[test]
    fn the_nearest_is_kept_when_none_is_near() {
        let found = by_power(5000.0, 0.2);
        let off = |count: usize| (count as f64 / 400.0).ln().abs();
        let least = found.tries.iter().map(|t| off(t.tetrahedra)).fold(f64::INFINITY, f64::min);
        assert_eq!(found.tries.len(), Effort::default().tries);
        assert!((off(found.mesh.tets().len()) - least).abs() < 1e-12, "{:?}", found.tries);
    }
}

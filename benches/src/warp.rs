//! CPU time of carrying a CT through a deformed mesh, beside that of copying it:
//! `bench-warp WORKLOAD.npz CT.npy RUNS [OUT.npy]`, JSON on stdout.
//!
//! WORKLOAD is one of the reference's (shape, spacing, origin, direction, rest, disp, tets), CT its
//! volume. The mesh ends where it rests: no fade, no collar. OUT receives the result.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement reads its input and tells its result"
)]

mod cost;

use anyhow::{Context, Result, bail, ensure};
use cost::{cpu_s, memory_mb};
use ndarray::{Array1, Array2, Array3};
use ndarray_npy::{NpzReader, read_npy, write_npy};
use serde_json::json;
use std::fs::File;
use std::sync::Arc;
use std::time::Instant;
use supine_mesh::{
    BoundaryFace, BoundaryTag, Deformation, Displacement, Edges, TET_FACES, TetMesh,
};
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::{Ct, Volume};
use supine_warp::{Frames, Interpolation, Params};

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (workload, ct, runs, out) = match &words[..] {
        [workload, ct, runs] => (workload, ct, runs.parse()?, None),
        [workload, ct, runs, out] => (workload, ct, runs.parse()?, Some(out)),
        _ => bail!("bench-warp WORKLOAD.npz CT.npy RUNS [OUT.npy]"),
    };
    let Workload { ct, deformation } = Workload::read(workload, ct)?;
    // As the reference has it: one sample for each voxel.
    let with_collar = Params {
        supersample_below: 0.0,
        interpolation: Interpolation::Linear,
        ..Params::default()
    };
    let params = Params { collar_mm: 0.0, ..with_collar.clone() };
    let mut out_ct = Ct::clone(&ct);
    let volumes_mb = memory_mb("VmRSS")?;
    let (frames, prepare) = timed(|| Frames::new(ct.clone(), deformation.mesh().clone(), &params));
    let mut frames = frames?;
    let mut times: [Vec<Time>; 4] = Default::default();
    for _ in 0..runs {
        let (_, copy) = timed(|| out_ct.data_mut().copy_from_slice(ct.data()));
        frames.restore(&mut out_ct);
        let (painted, paint) = timed(|| frames.paint(&deformation, &mut out_ct));
        painted?;
        let (_, restore) = timed(|| frames.restore(&mut out_ct));
        let (framed, frame) = {
            frames.paint(&deformation, &mut out_ct)?;
            timed(|| frames.next(&deformation, &mut out_ct))
        };
        framed?;
        for (all, one) in times.iter_mut().zip([copy, paint, restore, frame]) {
            all.push(one);
        }
    }
    let peak_mb = memory_mb("VmHWM")?;
    let [copy, paint, restore, frame] = times.map(median);
    frames.restore(&mut out_ct);
    let cubic = beside_cubic(&ct, &params, &deformation, &mut frames, &mut out_ct, runs)?;
    let cubic_mb = memory_mb("VmHWM")? - peak_mb;
    // As in a session: with what is sampled beside the skin, and with edges that bend; a few, they
    // are slow.
    let runs = runs.min(3);
    frames.restore(&mut out_ct);
    let mut collared = out_ct.clone();
    let collar_frame = frame_time(&ct, &with_collar, &deformation, &mut collared, runs)?;
    let bent = bent(&deformation)?;
    let bent_frame = frame_time(&ct, &params, &bent, &mut collared, runs)?;
    let both_frame = frame_time(&ct, &with_collar, &bent, &mut collared, runs)?;
    let pieces = supine_warp::warp(&ct, &bent, &params, Progress::none())?.1.pieces;
    frames.paint(&deformation, &mut out_ct)?;
    println!(
        "{}",
        json!({
            "threads": rayon_threads(), "tetrahedra": deformation.mesh().tets().len(), "prepare_ms": prepare.cpu_ms,
            "copy_ms": copy.cpu_ms, "paint_ms": paint.cpu_ms, "restore_ms": restore.cpu_ms,
            "frame_ms": frame.cpu_ms, "frame_with_collar_ms": collar_frame.cpu_ms,
            "frame_quadratic_ms": bent_frame.cpu_ms, "quadratic_pieces": pieces,
            "frame_quadratic_with_collar_ms": both_frame.cpu_ms,
            "paint_wall_ms": paint.wall_ms, "frame_wall_ms": frame.wall_ms,
            "paint_of_copy": paint.cpu_ms / copy.cpu_ms,
            "with_copy_of_copy": (paint.cpu_ms + copy.cpu_ms) / copy.cpu_ms,
            "beyond_volumes_mb": peak_mb - volumes_mb,
            "cubic_paint_ms": cubic[1].cpu_ms, "cubic_of_linear": cubic[1].cpu_ms / cubic[0].cpu_ms,
            "cubic_frame_ms": cubic[3].cpu_ms, "cubic_frame_of_linear": cubic[3].cpu_ms / cubic[2].cpu_ms,
            "cubic_more_mb": cubic_mb,
        })
    );
    if let Some(path) = out {
        let [ni, nj, nk] = ct.grid().size();
        write_npy(path, &Array3::from_shape_vec((nk, nj, ni), out_ct.data().to_vec())?)?;
    }
    Ok(())
}

/// Median times, taken in turn: painting with linear and with cubic interpolation, and the frames
/// of both. `out` holds the CT, and does so afterwards.
fn beside_cubic(
    ct: &Arc<Ct>,
    params: &Params,
    deformation: &Deformation,
    linear: &mut Frames,
    out: &mut Ct,
    runs: usize,
) -> Result<[Time; 4]> {
    let params = Params { interpolation: Interpolation::Cubic, ..params.clone() };
    let mut cubic = Frames::new(ct.clone(), deformation.mesh().clone(), &params)?;
    let mut times: [Vec<Time>; 4] = Default::default();
    for _ in 0..runs {
        for (n, frames) in [&mut *linear, &mut cubic].into_iter().enumerate() {
            let (painted, paint) = timed(|| frames.paint(deformation, out));
            painted?;
            let (framed, frame) = timed(|| frames.next(deformation, out));
            framed?;
            frames.restore(out);
            times[n].push(paint);
            times[2 + n].push(frame);
        }
    }
    Ok(times.map(median))
}

/// The median time of a frame that follows another. `out` holds the CT, and does so afterwards.
fn frame_time(
    ct: &Arc<Ct>,
    params: &Params,
    deformation: &Deformation,
    out: &mut Ct,
    runs: usize,
) -> Result<Time> {
    let mut frames = Frames::new(ct.clone(), deformation.mesh().clone(), params)?;
    frames.paint(deformation, out)?;
    let mut times = Vec::new();
    for _ in 0..runs {
        let (framed, time) = timed(|| frames.next(deformation, out));
        framed?;
        times.push(time);
    }
    frames.restore(out);
    Ok(median(times))
}

/// The same displacement with a quadratic part: the middle of each edge moves by a hundredth more
/// than the mean of its ends, 0.13 mm at most.
fn bent(deformation: &Deformation) -> Result<Deformation> {
    let (mesh, displacement) = (deformation.mesh(), deformation.displacement());
    let edges = Edges::new(mesh);
    let mut values = displacement.values()[..mesh.points().len()].to_vec();
    let middles = edges.ends().iter().map(|ends| {
        let [a, b] = ends.map(|p| values[p as usize]);
        (a + b) * (0.5 * 1.01)
    });
    let middles: Vec<Vector> = middles.collect();
    values.extend(middles);
    let displacement = Displacement::new(mesh, &edges, values)?;
    Ok(Deformation::new(mesh.clone(), displacement)?)
}

/// What is carried.
struct Workload {
    ct: Arc<Ct>,
    deformation: Deformation,
}

impl Workload {
    fn read(workload: &str, ct: &str) -> Result<Self> {
        let mut file = NpzReader::new(File::open(workload).with_context(|| workload.to_owned())?)?;
        let vector = |a: Array1<f64>| Vector::new(a[0], a[1], a[2]);
        let spacing = vector(file.by_name("spacing")?);
        let origin = Point::from(vector(file.by_name("origin")?));
        let direction: Array2<f64> = file.by_name("direction")?;
        let direction = Matrix::from_fn(|a, b| direction[(a, b)]);
        let values: Array3<i16> = read_npy(ct)?;
        let (nk, nj, ni) = values.dim();
        let grid = Grid::new([ni, nj, nk], spacing, origin, direction)?;
        let ct = Volume::new(grid, values.into_iter().collect())?;
        let rows = |a: Array2<f64>| -> Vec<Vector> {
            a.rows().into_iter().map(|r| Vector::new(r[0], r[1], r[2])).collect()
        };
        let points = rows(file.by_name("rest")?).into_iter().map(Point::from).collect();
        let tets: Array2<i32> = file.by_name("tets")?;
        let corner = |n: i32| u32::try_from(n).context("a node below 0");
        let tets: Vec<[u32; 4]> = tets
            .rows()
            .into_iter()
            .map(|r| Ok([corner(r[0])?, corner(r[1])?, corner(r[2])?, corner(r[3])?]))
            .collect::<Result<_>>()?;
        ensure!(!tets.is_empty(), "no tetrahedra");
        let boundary = boundary(&tets);
        let mesh = TetMesh::new(points, tets, boundary)?;
        let displacement =
            Displacement::new(&mesh, &Edges::new(&mesh), rows(file.by_name("disp")?))?;
        Ok(Self { ct: ct.into(), deformation: Deformation::new(mesh.into(), displacement)? })
    }
}

/// Faces of one tetrahedron only, all of them skin.
fn boundary(tets: &[[u32; 4]]) -> Vec<BoundaryFace> {
    let faces = tets.iter().flat_map(|tet| TET_FACES.map(|f| f.map(|c| tet[c])));
    let mut faces: Vec<([u32; 3], [u32; 3])> = faces
        .map(|face| {
            let mut key = face;
            key.sort_unstable();
            (key, face)
        })
        .collect();
    faces.sort_unstable();
    let alone = faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1);
    alone.map(|same| BoundaryFace { points: same[0].1, tag: BoundaryTag::Skin }).collect()
}

/// What something took.
#[derive(Clone, Copy)]
struct Time {
    cpu_ms: f64,
    wall_ms: f64,
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Time) {
    let (cpu, wall) = (cpu_s(), Instant::now());
    let made = work();
    let time = Time { cpu_ms: (cpu_s() - cpu) * 1e3, wall_ms: wall.elapsed().as_secs_f64() * 1e3 };
    (made, time)
}

fn median(mut times: Vec<Time>) -> Time {
    let middle = times.len() / 2;
    let mut of = |key: fn(&Time) -> f64| {
        times.sort_by(|a, b| key(a).total_cmp(&key(b)));
        times.get(middle).map_or(f64::NAN, key)
    };
    Time { cpu_ms: of(|t| t.cpu_ms), wall_ms: of(|t| t.wall_ms) }
}

fn rayon_threads() -> usize {
    std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()).unwrap_or(0)
}

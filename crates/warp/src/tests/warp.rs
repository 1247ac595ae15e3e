//! What must hold for every mesh and displacement.

use super::fixture::{lattice, moved, patterned_ct, still};
use crate::pieces::{Curve, Pieces};
use crate::{
    Error, Faded, Frames, Interpolation, Origin, Origins, Params, carry_points, fade, fields, warp,
    warp_onto,
};
use proptest::prelude::*;
use std::sync::Arc;
use supine_mesh::{BoundaryTag, Deformation, Displacement, Edges, Locator, Order, TetMesh};
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::{Ct, Volume, sample_trilinear_at};

const TAG: fn(Point) -> BoundaryTag = |p| {
    if p.x < 0.1 {
        BoundaryTag::Cut
    } else if p.y > 15.9 {
        BoundaryTag::ChestWall
    } else {
        BoundaryTag::Skin
    }
};

/// A box of 24 x 16 x 20 mm from the origin: skin, chest wall at y = 16, cut at x = 0.
fn block() -> Arc<TetMesh> {
    lattice([6, 4, 5], 4.0, Point::origin(), TAG)
}

fn grid(direction: Matrix) -> Grid {
    let size = [40, 30, 26];
    Grid::new(size, Vector::new(1.0, 1.25, 1.5), Point::new(-8.0, -9.0, -7.0), direction).unwrap()
}

fn ct() -> Ct {
    let grid = grid(Matrix::identity());
    let data = patterned_ct(grid.size(), 7);
    Volume::new(grid, data).unwrap()
}

fn min_det(u: &Deformation) -> f64 {
    crate::element::min_dets(u.mesh(), &Edges::new(u.mesh()), u.displacement())
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

fn bent(p: Point) -> Vector {
    let hang = (16.0 - p.y) / 16.0;
    Vector::new(2.0, 0.8, -3.0) * hang * hang
}

fn no_fade() -> Params {
    Params { fade_mm: Some(0.0), ..Params::default() }
}

#[test]
fn without_displacement_every_byte_stays() {
    let (mesh, ct) = (block(), ct());
    for order in [Order::Linear, Order::Quadratic] {
        let still = moved(&mesh, order, |_| Vector::zeros());
        for interpolation in Interpolation::ALL {
            let params = Params { interpolation, ..Params::default() };
            let (out, info) = warp(&ct, &still, &params, Progress::none()).unwrap();
            assert!(out == ct, "{order:?}, {interpolation:?}");
            assert_eq!((info.facts.vacated_voxels, info.facts.folded_voxels), (0, 0));
            assert!((info.facts.jacobian.min - 1.0).abs() < 1e-12 && info.warnings.is_empty());
        }
    }
}

#[test]
fn a_shift_by_whole_voxels_shifts_the_values() {
    let (mesh, ct) = (lattice([6, 4, 5], 4.0, Point::origin(), |_| BoundaryTag::Skin), ct());
    let shift = moved(&mesh, Order::Linear, |_| Vector::new(3.0, -2.5, 1.5));
    let params = Params { collar_mm: 0.0, ..no_fade() };
    let (out, info) = warp(&ct, &shift, &params, Progress::none()).unwrap();
    let mut sampled = 0;
    for n in 0..ct.data().len() {
        let v = ct.grid().voxel(n);
        // The block holds its lower faces and not its upper ones: the half-open rule.
        let inside = |v: [usize; 3], s: [usize; 3]| {
            let p = ct.grid().centre([v[0] - s[0], v[1] + s[1], v[2] - s[2]]);
            (0..3).all(|a| p[a] >= 0.0 && p[a] < [24.0, 16.0, 20.0][a])
        };
        let far = v[0] < 3 || v[1] + 2 >= 30 || v[2] < 1;
        let want = if !far && inside(v, [3, 2, 1]) {
            sampled += 1;
            ct.at([v[0] - 3, v[1] + 2, v[2] - 1])
        } else if inside(v, [0; 3]) {
            -1000
        } else {
            ct.at(v)
        };
        assert_eq!(out.at(v), want, "voxel {v:?}");
    }
    assert_eq!(info.facts.moved_voxels, sampled);
}

#[test]
fn one_and_two_threads_give_the_same_bytes() {
    let (mesh, ct) = (block(), ct());
    let u = moved(&mesh, Order::Quadratic, bent);
    for interpolation in Interpolation::ALL {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let params = Params { interpolation, ..Params::default() };
            pool.install(|| warp(&ct, &u, &params, Progress::none()).unwrap())
        };
        let (one, two) = (run(1), run(2));
        assert!(one == two, "{interpolation:?}: volume and info");
        assert!(one.1.facts.moved_voxels > 3000 && one.1.facts.vacated_voxels > 0, "{:?}", one.1);
    }
}

#[test]
fn a_stop_is_obeyed() {
    let (mesh, ct) = (block(), ct());
    let u = moved(&mesh, Order::Linear, bent);
    let stop = |share: f64| share < 0.5;
    let result = warp(&ct, &u, &Params::default(), Progress::new(&stop));
    assert!(matches!(result, Err(Error::Stopped(_))), "{result:?}");
}

#[test]
fn what_cannot_be_used_is_refused() {
    let (mesh, ct) = (block(), ct());
    let u = moved(&mesh, Order::Linear, bent);
    let refuse =
        |ct: &Ct, params: &Params| warp(ct, &u, params, Progress::none()).unwrap_err().to_string();
    let thin = Grid::new([9, 9, 1], Vector::repeat(1.0), Point::origin(), Matrix::identity());
    let message = refuse(&Volume::from_fn(thin.unwrap(), |_| 0), &Params::default());
    assert!(message.contains("[9, 9, 1]"), "{message}");
    let nan = Params { collar_mm: f64::NAN, ..Params::default() };
    let message = refuse(&ct, &nan);
    assert!(message.contains("collar_mm"), "{message}");
}

#[test]
fn the_fade_holds_the_cut_and_keeps_the_tissue_unfolded() {
    let mesh = lattice([12, 4, 4], 5.0, Point::origin(), TAG);
    for order in [Order::Linear, Order::Quadratic] {
        let u = moved(&mesh, order, |_| Vector::new(-6.0, 0.0, 0.0));
        let Faded { deformation: faded, width_mm: width, .. } =
            fade(&u, &Params::default()).unwrap();
        assert!((18.0..=60.0).contains(&width), "{width} mm");
        let det = min_det(&faded);
        assert!(det >= 0.2, "{order:?}: det F {det}");
        for (p, v) in mesh.points().iter().zip(faded.displacement().values()) {
            let want = if p.x == 0.0 { Some(0.0) } else { (p.x >= width).then_some(-6.0) };
            assert!(want.is_none_or(|w| (v.x - w).abs() < 1e-12), "{p}: {v}");
        }
        let given = Params { fade_mm: Some(10.0), ..Params::default() };
        assert_eq!(fade(&u, &given).unwrap().width_mm, 10.0);
    }
}

#[test]
fn a_cut_that_rests_needs_no_fade() {
    let mesh = block();
    let u = moved(&mesh, Order::Quadratic, |p| Vector::new(0.0, 0.1, 0.2) * p.x);
    let Faded { deformation: same, width_mm, .. } = fade(&u, &Params::default()).unwrap();
    assert!(same == u && width_mm == 0.0, "{width_mm}");
}

#[test]
fn forward_and_backward_fields_belong_together() {
    let turn = turned();
    let mesh = block();
    let u = moved(&mesh, Order::Quadratic, bent);
    let grid = grid(turn);
    let f = fields(&grid, &u, &no_fade(), Progress::none()).unwrap();
    let locator = Locator::new(mesh.clone());
    let (mut seen, mut worst) = (0, 0.0f64);
    for n in 0..grid.len() {
        let p = grid.centre(grid.voxel(n));
        let forward = Vector::from(f.ct_to_deformed().data()[n].map(f64::from));
        let back = Vector::from(f.deformed_to_ct().data()[n].map(f64::from));
        if locator.locate(&p).is_none() {
            assert_eq!((forward.norm(), f.jacobian().data()[n]), (0.0, 1.0), "{p}");
        } else if p.iter().all(|c| c.fract().abs() > 1e-3) {
            assert!((forward - bent(p)).norm() < 0.05, "{p}: {forward} for {}", bent(p));
        }
        let source = p + back;
        if back.norm() > 0.0 && locator.locate(&source).is_some() {
            worst = worst.max((source + bent(source) - p).norm());
            seen += 1;
        }
    }
    assert!(seen > 2000 && worst < 0.05, "{seen} voxels, {worst} mm");
}

fn turned() -> Matrix {
    let (s, c) = 0.2f64.sin_cos();
    Matrix::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

#[test]
fn the_jacobian_of_a_stretch_is_its_factor() {
    let mesh = block();
    let u = moved(&mesh, Order::Quadratic, |p| Vector::new(0.1 * p.x, 0.0, -0.2 * p.z));
    let f = fields(&grid(Matrix::identity()), &u, &no_fade(), Progress::none()).unwrap();
    let stretched = f.jacobian().data().iter().filter(|&&j| (j - 1.1 * 0.8).abs() < 1e-5).count();
    let ones = f.jacobian().data().iter().filter(|&&j| j == 1.0).count();
    assert_eq!(stretched + ones, f.jacobian().data().len());
    assert!(stretched > 3000, "{stretched}");
    let (_, info) = warp(&ct(), &u, &no_fade(), Progress::none()).unwrap();
    for j in [
        info.facts.jacobian.min,
        info.facts.jacobian.p01,
        info.facts.jacobian.mean,
        info.facts.jacobian.max,
    ] {
        assert!((j - 0.88).abs() < 1e-9, "{info:?}");
    }
}

#[test]
fn points_follow_the_tissue_and_the_ct() {
    let mesh = block();
    let u = moved(&mesh, Order::Quadratic, bent);
    let inside = Point::new(10.3, 5.1, 11.7);
    let outside = Point::new(-3.0, 5.0, 5.0);
    let carried = carry_points(&u, &no_fade(), &[inside, outside]).unwrap();
    let there = carried[0].unwrap();
    assert!((there - inside - bent(inside)).norm() < 1e-12, "{there}");
    assert_eq!(carried[1], None);
    // A CT that is linear in space shows at the new place what was at the old one.
    let smooth = Volume::from_fn(grid(Matrix::identity()), |v| {
        let p = grid(Matrix::identity()).centre(v);
        (20.0 * p.x + 30.0 * p.y - 25.0 * p.z).round() as i16
    });
    let (out, _) = warp(&smooth, &u, &no_fade(), Progress::none()).unwrap();
    let (got, want) = (sample_trilinear_at(&out, &there), sample_trilinear_at(&smooth, &inside));
    assert!((got - want).abs() < 4.0, "{got} for {want}");
}

#[test]
fn too_many_pieces_are_not_made() {
    let mesh = block();
    let edges = Edges::new(&mesh);
    let u = moved(&mesh, Order::Quadratic, bent);
    let curve = Curve { mesh: &mesh, edges: &edges, displacement: u.displacement() };
    let free = Pieces::new(&curve, 0.002, Progress::none()).unwrap();
    assert!(free.tets.len() > 3000 && free.missed_mm.is_none(), "{}", free.tets.len());
    let bound = Pieces::at_most(3000, &curve, 0.002, Progress::none()).unwrap();
    assert!(bound.tets.len() <= 3000 && bound.missed_mm.unwrap() > 0.002, "{}", bound.tets.len());
    let volume = |p: &Pieces| -> f64 {
        let at = |v: u32| p.rest[v as usize] + p.displacement[v as usize];
        let tets = p.tets.iter().map(|t| t.map(at));
        tets.map(|[a, b, c, d]| (b - a).dot(&(c - a).cross(&(d - a))) / 6.0).sum()
    };
    assert!((volume(&free) - volume(&bound)).abs() < 1e-3 * volume(&free));
}

/// A grid twice as fine and larger all round: where it has a voxel of the CT it has the same value,
/// beyond the CT it is air.
#[test]
fn another_grid_holds_the_same_tissue() {
    let (mesh, ct) = (block(), ct());
    let u = moved(&mesh, Order::Quadratic, bent);
    let params = Params { supersample_below: 0.0, ..Params::default() };
    let (own, _) = warp(&ct, &u, &params, Progress::none()).unwrap();
    let spacing = ct.grid().spacing();
    let size = ct.grid().size().map(|n| 2 * n + 7);
    let first = ct.grid().patient_from_index([-2.0; 3]);
    let fine = Grid::new(size, spacing * 0.5, first, Matrix::identity()).unwrap();
    let (made, info) = warp_onto(&fine, &ct, &u, &params, Progress::none()).unwrap();
    assert_eq!(made.grid(), &fine);
    assert!(info.facts.moved_voxels > 1000 && info.facts.folded_voxels == 0, "{info:?}");
    let mut off = 0;
    for (n, value) in made.data().iter().enumerate() {
        let voxel = fine.voxel(n).map(|n| n as f64 / 2.0 - 2.0);
        let last = ct.grid().size().map(|n| n as f64 - 1.0);
        if (0..3).any(|a| voxel[a] < -0.5 || voxel[a] > last[a] + 0.5) {
            assert_eq!(*value, params.air_hu);
        } else if (0..3).all(|a| voxel[a].fract() == 0.0 && (0.0..=last[a]).contains(&voxel[a])) {
            let at = voxel.map(|v| v as usize);
            let there =
                own.data()[(at[2] * ct.grid().size()[1] + at[1]) * ct.grid().size()[0] + at[0]];
            // Faces lie elsewhere in the last digits, so that an owner may be its neighbour.
            assert!((i32::from(*value) - i32::from(there)).abs() <= 1, "{at:?} {value} {there}");
            off += usize::from(*value != there);
        }
    }
    assert!(off < 20, "{off}");
    let (again, _) = warp_onto(ct.grid(), &ct, &u, &params, Progress::none()).unwrap();
    assert_eq!(again.data(), own.data());
}

/// On a coarser grid a voxel is the mean of what it covers: the noise falls.
#[test]
fn a_coarser_grid_is_averaged() {
    let (mesh, ct) = (block(), ct());
    let still = still(&mesh);
    let own = ct.grid();
    let size = own.size().map(|n| n / 2);
    let first = own.patient_from_index([0.0; 3]);
    let coarse = Grid::new(size, own.spacing() * 2.0, first, Matrix::identity()).unwrap();
    // The pattern is a ramp with noise of 0 to 15, of variance 21.25: the ramp taken off, the noise
    // is left.
    let noise = |supersample_below: f64| {
        let params = Params { supersample_below, ..no_fade() };
        let (made, _) = warp_onto(&coarse, &ct, &still, &params, Progress::none()).unwrap();
        let inner = (0..coarse.len()).filter(|&n| {
            let place = coarse.voxel(n);
            (0..3).all(|a| place[a] > 0 && place[a] + 1 < size[a])
        });
        let left = inner.map(|n| {
            let [i, j, k] = coarse.voxel(n).map(|v| 2.0 * v as f64);
            f64::from(made.data()[n]) - (i * 9.0 + j * 5.0 + k * 11.0) + 1000.0
        });
        let left: Vec<f64> = left.collect();
        let mean = left.iter().sum::<f64>() / left.len() as f64;
        (mean, left.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / left.len() as f64)
    };
    let ((mean, averaged), (_, single)) = (noise(0.7), noise(0.0));
    assert!((mean - 7.5).abs() < 0.2, "{mean}");
    assert!((single - 21.25).abs() < 1.0 && averaged < 0.4 * single, "{averaged} {single}");
}

/// Frames one after the other give what each displacement gives alone, and the CT is there again
/// after them.
#[test]
fn each_frame_is_as_if_it_were_the_only_one() {
    let mesh = lattice([3, 2, 2], 4.0, Point::origin(), |_| BoundaryTag::Skin);
    let ct = Arc::new(ct());
    for order in [Order::Linear, Order::Quadratic] {
        let params = Params { collar_mm: 2.0, ..no_fade() };
        let mut frames = Frames::new(ct.clone(), mesh.clone(), &params).unwrap();
        let mut frame = Ct::clone(&ct);
        for share in [0.3, 1.0, 0.6] {
            let u = moved(&mesh, order, |p| bent(p) * share);
            frames.next(&u, &mut frame).unwrap();
            let (alone, _) = warp(&ct, &u, &params, Progress::none()).unwrap();
            let differ = frame.data().iter().zip(alone.data()).filter(|(a, b)| a != b).count();
            assert_eq!(differ, 0, "{order:?} {share}");
        }
        assert_ne!(frame.data(), ct.data());
        frames.restore(&mut frame);
        assert_eq!(frame.data(), ct.data());
    }
    let other = lattice([2, 2, 2], 4.0, Point::origin(), |_| BoundaryTag::Skin);
    let mut frames = Frames::new(ct.clone(), mesh.clone(), &no_fade()).unwrap();
    let u = moved(&other, Order::Linear, bent);
    assert!(matches!(frames.next(&u, &mut Ct::clone(&ct)), Err(Error::Displacement(_))));
}

/// On a part of the space, finer or turned, frames are what each displacement gives there alone.
#[test]
fn frames_on_another_grid_are_warps_onto_it() {
    let mesh = lattice([3, 2, 2], 4.0, Point::origin(), |_| BoundaryTag::Skin);
    let ct = Arc::new(ct());
    let turn = Matrix::new(0.8, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 1.0);
    for direction in [Matrix::identity(), turn] {
        let spacing = Vector::repeat(0.8);
        let grid = Grid::new([9, 8, 7], spacing, Point::new(1.0, 0.5, 1.5), direction).unwrap();
        let params = Params { collar_mm: 2.0, ..no_fade() };
        let mut frames = Frames::onto(ct.clone(), &grid, mesh.clone(), &params).unwrap();
        let mut frame = Ct::clone(frames.still());
        for share in [0.3, 1.0, 0.6] {
            let u = moved(&mesh, Order::Linear, |p| bent(p) * share);
            frames.next(&u, &mut frame).unwrap();
            let (alone, _) = warp_onto(&grid, &ct, &u, &params, Progress::none()).unwrap();
            assert_eq!(frame.data(), alone.data(), "{share}");
        }
        assert_ne!(frame.data(), frames.still().data());
        frames.restore(&mut frame);
        assert_eq!(frame.data(), frames.still().data());
    }
}

/// Where planes are seen a frame is the whole one's, and the next whole frame is right everywhere.
#[test]
fn planes_that_are_seen_are_those_of_the_whole_frame() {
    let mesh = lattice([3, 2, 2], 4.0, Point::origin(), |_| BoundaryTag::Skin);
    let ct = Arc::new(ct());
    let params = Params { collar_mm: 2.0, ..no_fade() };
    let mut frames = Frames::new(ct.clone(), mesh.clone(), &params).unwrap();
    let (mut whole, mut seen) = (Ct::clone(&ct), Ct::clone(&ct));
    let mut others = Frames::new(ct.clone(), mesh.clone(), &params).unwrap();
    let size = ct.grid().size();
    for share in [0.4, 1.0] {
        let u = moved(&mesh, Order::Linear, |p| bent(p) * share);
        frames.next(&u, &mut whole).unwrap();
        let planes = [(0, size[0] / 2), (1, size[1] / 3), (2, size[2] / 2)];
        others.next_seen(&u, &planes, &mut seen).unwrap();
        for (axis, n) in planes {
            let in_plane = |at: &usize| ct.grid().voxel(*at)[axis] == n;
            for at in (0..ct.data().len()).filter(in_plane) {
                assert_eq!(seen.data()[at], whole.data()[at], "{axis} {:?}", ct.grid().voxel(at));
            }
        }
    }
    let u = moved(&mesh, Order::Linear, |p| bent(p) * 0.7);
    frames.next(&u, &mut whole).unwrap();
    others.next(&u, &mut seen).unwrap();
    assert_eq!(seen.data(), whole.data());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Vertices on voxel centres, on a quarter lattice or anywhere; linear and curved: each voxel
    /// of the deformed mesh has one owner, and the pieces fill the mesh without a crack.
    #[test]
    fn each_voxel_is_written_once(
        shifts in prop::collection::vec(prop::array::uniform3(-3i8..=3), 36),
        scale in prop::sample::select(vec![0.25, 0.2, 0.1371]),
        curved in any::<bool>(),
    ) {
        let mesh = lattice([3, 2, 2], 4.0, Point::origin(), |_| BoundaryTag::Skin);
        let edges = Edges::new(&mesh);
        let at = |n: usize| Vector::from(shifts[n % 36].map(f64::from)) * scale;
        let nodes = mesh.points().len() + if curved { edges.ends().len() } else { 0 };
        let on_surface = |p: Point| {
            (0..3).any(|a| p[a] == 0.0 || p[a] == [12.0, 8.0, 8.0][a])
        };
        let place = |n: usize| match n.checked_sub(mesh.points().len()) {
            None => mesh.points()[n],
            Some(e) => {
                let [a, b] = edges.ends()[e].map(|p| mesh.points()[p as usize]);
                a + (b - a) * 0.5
            }
        };
        // The surface rests: the deformed mesh is the same box, whatever happens within.
        let values = (0..nodes)
            .map(|n| if on_surface(place(n)) { Vector::zeros() } else { at(n) * 0.5 })
            .collect();
        let u = Displacement::new(&mesh, &edges, values).unwrap();
        let u = Deformation::new(mesh.clone(), u).unwrap();
        prop_assume!(min_det(&u) > 0.05);
        let grid = Grid::new(
            [16, 12, 12], Vector::repeat(1.0), Point::new(-2.0, -2.0, -2.0), Matrix::identity(),
        ).unwrap();
        let ct = Volume::new(grid.clone(), patterned_ct(grid.size(), 3)).unwrap();
        let (out, info) = warp(&ct, &u, &no_fade(), Progress::none()).unwrap();
        prop_assert_eq!(info.facts.moved_voxels, 12 * 8 * 8);
        prop_assert_eq!((info.facts.folded_voxels, info.facts.vacated_voxels), (0, 0));
        for n in 0..grid.len() {
            let p = grid.centre(grid.voxel(n));
            if (0..3).any(|a| p[a] < 0.0 || p[a] >= [12.0, 8.0, 8.0][a]) {
                prop_assert_eq!(out.data()[n], ct.data()[n]);
            }
        }
    }
}

/// Tissue that leaves a bump of the wall along which it slid leaves no air there; at the skin it
/// does.
#[test]
fn no_air_gets_between_a_wall_and_what_slid_along_it() {
    for wall in [BoundaryTag::ChestWall, BoundaryTag::Skin] {
        let tag = |p: Point| if p.y > 15.9 { wall } else { BoundaryTag::Skin };
        let mesh = lattice([6, 4, 5], 4.0, Point::origin(), tag);
        let (grid, ct) = (grid(Matrix::identity()), ct());
        let slid = moved(&mesh, Order::Linear, |_| Vector::new(0.0, -2.6, 0.0));
        let params = Params { interpolation: Interpolation::Linear, ..Params::default() };
        let (out, _) = warp(&ct, &slid, &params, Progress::none()).unwrap();
        let origins = Origins::new(&grid, &slid, &params, 1.0, Progress::none()).unwrap();
        let (mut kept, mut air) = (0, 0);
        for n in 0..grid.len() {
            let (voxel, p) = (grid.voxel(n), grid.centre(grid.voxel(n)));
            // Apart from the skin by a tetrahedron.
            let within = (4.1..19.9).contains(&p.x) && (4.1..15.9).contains(&p.z);
            if within && (13.6..15.9).contains(&p.y) {
                kept +=
                    usize::from(out.data()[n] == ct.data()[n] && origins.at(voxel) == Origin::Here);
                air += usize::from(out.data()[n] == params.air_hu);
            }
        }
        assert!(kept + air > 100);
        match wall {
            BoundaryTag::ChestWall => assert_eq!(air, 0, "{kept}"),
            _ => assert_eq!(kept, 0, "{air}"),
        }
    }
}

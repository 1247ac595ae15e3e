//! The workloads of the exact reference (fixtures/warp): owner and value of every voxel.

use super::fixture::{Archive, patterned_ct};
use crate::kernel::{Kernel, Source};
use crate::map::Map;
use crate::pieces::{Curve, Pieces};
use crate::predicate::Index;
use crate::pullback::Pullback;
use crate::raster::{Raster, SLAB};
use crate::resample::Resampling;
use crate::rows::Span;
use crate::rules::{Counts, Rules};
use crate::{Interpolation, Params, filter, warp};
use supine_mesh::{BoundaryTag, Deformation, Displacement, Edges};
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::{Ct, Volume};

const AIR: i16 = -1000;
/// Marks voxels of the owner map that the tissue left.
const VACATED: i32 = -2;

/// Owner and number of claims of every voxel.
fn owners(map: &Map, size: [usize; 3]) -> (Vec<i32>, Vec<u8>) {
    let raster = Raster::new(&map.deformed, &map.tets, size);
    let mut owner = vec![-1i32; size.iter().product()];
    let mut claims = vec![0u8; owner.len()];
    for slab in 0..size[2].div_ceil(SLAB) {
        raster.scan(slab, &mut |tet: usize, spans: &[Span]| {
            for s in spans.iter().flat_map(Span::voxels) {
                let [i, j, k] = [s.from, s.j, s.k].map(|n| n as usize);
                let n = (k * size[1] + j) * size[0] + i;
                // The lowest owns.
                owner[n] = if claims[n] == 0 { tet as i32 } else { owner[n] };
                claims[n] = claims[n].saturating_add(1);
            }
        });
    }
    (owner, claims)
}

/// The stored result of a workload.
struct Reference {
    owner: Vec<i32>,
    value: Vec<i16>,
    /// 1 where the value before rounding is within 0.02 HU of a half: the last bit decides.
    tie: Vec<i8>,
}

/// Compares with the reference; `ct` is what lies outside the mesh. The number off by one.
fn compare(name: &str, got: &[i16], ct: &[i16], want: &Reference) -> usize {
    let mut by_one = 0;
    for n in 0..got.len() {
        match want.owner[n] {
            VACATED => assert_eq!(got[n], AIR, "{name}: voxel {n} was left"),
            -1 => assert_eq!(got[n], ct[n], "{name}: voxel {n} is none of ours"),
            _ => {
                let off = (i32::from(got[n]) - i32::from(want.value[n])).abs();
                let allowed = i32::from(want.tie[n]);
                assert!(off <= allowed, "{name}: voxel {n} is {} for {}", got[n], want.value[n]);
                by_one += off as usize;
            }
        }
    }
    by_one
}

/// What every kernel makes of a map, the same.
fn by_all_kernels(
    name: &str,
    map: &Map,
    ct: &[i16],
    size: [usize; 3],
    interpolation: Interpolation,
) -> (Counts, Vec<i16>) {
    let by_kernel = Kernel::all().into_iter().map(|kernel| {
        let rules =
            Rules { air_hu: AIR, body_hu: -500, kernel, interpolation, supersample_below: 0.0 };
        let source = Source::new(ct, size);
        let work = Resampling::new(&source, size, map, rules);
        let mut values = ct.to_vec();
        let (_, counts) = work.run(source, map, &mut values, Progress::none()).unwrap();
        (counts, values)
    });
    let mut by_kernel: Vec<(Counts, Vec<i16>)> = by_kernel.collect();
    assert!(by_kernel.iter().all(|result| *result == by_kernel[0]), "{name}: kernels differ");
    by_kernel.swap_remove(0)
}

#[test]
fn hostile_meshes_have_the_owners_and_values_of_the_reference() {
    let names = [
        "lattice_on_centres",
        "lattice_sheared",
        "lattice_half",
        "tiny_tets",
        "quarter_jitter",
        "slivers",
        "border",
        "random_overlap",
        "flat_tets",
        "one_huge",
        "oblique",
        "left_handed",
    ];
    let mut archive = Archive::open("w4.npz");
    for (n, name) in names.into_iter().enumerate() {
        let size = archive.size(&format!("{name}/shape"));
        let tets = archive.tets(&format!("{name}/tets"));
        let map = Map {
            rest: archive.vectors(&format!("{name}/rest_idx")),
            before: archive.vectors(&format!("{name}/rest_idx")),
            deformed: archive.vectors(&format!("{name}/def_idx")),
            collar_from: tets.len(),
            stays: None,
            tets,
        };
        let want = Reference {
            owner: archive.integers(&format!("{name}/owner")),
            value: archive.hu(&format!("{name}/ref")),
            tie: archive.flags(&format!("{name}/tie")),
        };
        let folded = archive.integers(&format!("{name}/folded"))[0] as usize;
        let (got, claims) = owners(&map, size);
        let wrong = (0..got.len()).filter(|&v| got[v] != want.owner[v].max(-1)).count();
        assert_eq!(wrong, 0, "{name}: voxels with another owner");
        assert_eq!(claims.iter().filter(|&&c| c > 1).count(), folded, "{name}: claimed twice");
        let ct = patterned_ct(size, n as u64 + 1);
        let (counts, values) = by_all_kernels(name, &map, &ct, size, Interpolation::Linear);
        compare(name, &values, &ct, &want);
        let (cubic, _) = by_all_kernels(name, &map, &ct, size, Interpolation::Cubic);
        assert_eq!(cubic, counts, "{name}, cubic");
        let count = |f: fn(i32) -> bool| want.owner.iter().filter(|&&o| f(o)).count();
        let expected =
            Counts { mesh: count(|o| o >= 0), collar: 0, vacated: count(|o| o == VACATED), folded };
        assert_eq!(counts, expected, "{name}");
    }
}

#[test]
fn the_breast_of_workload_w1_is_carried_as_by_the_reference() {
    let mut archive = Archive::open("w1.npz");
    let size = archive.size("shape");
    let spacing = Vector::from_row_slice(&archive.floats("spacing"));
    let origin = Point::from(Vector::from_row_slice(&archive.floats("origin")));
    let grid = Grid::new(size, spacing, origin, Matrix::identity()).unwrap();
    let points: Vec<Point> = archive.vectors("rest").into_iter().map(Point::from).collect();
    let mesh = super::fixture::mesh(points, archive.tets("tets"), |_| BoundaryTag::Skin);
    let values = archive.vectors("disp").into_iter().map(Vector::from).collect();
    let displacement = Displacement::new(&mesh, &Edges::new(&mesh), values).unwrap();
    let deformation = Deformation::new(mesh.clone(), displacement.clone()).unwrap();
    let ct = Volume::new(grid, patterned_ct(size, 100)).unwrap();
    let params = Params {
        collar_mm: 0.0,
        supersample_below: 0.0,
        interpolation: Interpolation::Linear,
        ..Params::default()
    };
    let (got, info) = warp(&ct, &deformation, &params, Progress::none()).unwrap();

    let corners = archive.integers("box");
    let stored = Reference {
        owner: archive.integers("owner"),
        value: archive.hu("ref"),
        tie: archive.flags("tie"),
    };
    let voxels = ct.data().len();
    let mut want =
        Reference { owner: vec![-1; voxels], value: vec![0; voxels], tie: vec![0; voxels] };
    let axis = |a: usize| corners[a] as usize..corners[3 + a] as usize;
    let mut n = 0;
    for k in axis(0) {
        for j in axis(1) {
            for i in axis(2) {
                let v = ct.grid().offset([i, j, k]);
                want.owner[v] = stored.owner[n];
                (want.value[v], want.tie[v]) = (stored.value[n], stored.tie[n]);
                n += 1;
            }
        }
    }
    let by_one = compare("W1", got.data(), ct.data(), &want);
    assert!(by_one * 10_000 <= info.facts.moved_voxels, "{by_one} voxels off by one");
    assert_eq!(
        (info.facts.moved_voxels, info.facts.vacated_voxels, info.facts.folded_voxels),
        (205_714, 7_287, 0)
    );
    let edges = Edges::new(&mesh);
    let curve = Curve { mesh: &mesh, edges: &edges, displacement: &displacement };
    let pieces = Pieces::new(&curve, 1.0, Progress::none()).unwrap();
    let map = Map::new([ct.grid(); 2], &pieces, &crate::collar::Collar::default());
    let (map_owner, _) = owners(&map, size);
    assert!(map_owner.iter().zip(&want.owner).all(|(a, b)| *a == (*b).max(-1)), "owners of W1");
    let (_, cubic) = by_all_kernels("W1", &map, ct.data(), size, Interpolation::Cubic);
    cubic_is_that_of_f64(&map, &map_owner, &ct, &cubic);
}

/// Cubic values of a volume against those of f64, voxel by voxel.
fn cubic_is_that_of_f64(map: &Map, owner: &[i32], ct: &Ct, got: &[i16]) {
    let source = Source::new(ct.data(), ct.grid().size());
    let (mut seen, mut differ) = (0, 0);
    for (n, tet) in owner.iter().enumerate() {
        let Some(tet) = usize::try_from(*tet).ok().map(|tet| map.tets[tet]) else { continue };
        let corners = |of: &[Index]| tet.map(|v| of[v as usize]);
        let pullback = Pullback::new(corners(&map.deformed), corners(&map.rest));
        let p = ct.grid().voxel(n).map(|v| v as f64);
        let exact = filter::mean(&source, Interpolation::Cubic, &pullback, p, 1);
        let by = exact.abs_diff(got[n]);
        assert!(by <= 1, "{p:?}: {} for {exact}", got[n]);
        (seen, differ) = (seen + 1, differ + usize::from(by > 0));
    }
    assert!(seen > 200_000 && differ * 1000 < seen, "{differ} of {seen}");
}

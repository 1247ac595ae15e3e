//! A breast on a round chest, whose scan is the skin that the mechanics itself moves.

use super::*;
use std::sync::Arc;
use supine_fem::{Law, Tissue, solve};
use supine_mesh::TetMesh;
use supine_record::Addition;
use supine_register::{Rigid, Shape};
use supine_space::{Grid, Matrix, Point, Vector};
use supine_tetrahedralise::Domain;
use supine_volume::{LabelMap, Region, SignedDistance, label};

/// Radius of the breast about the origin, mm.
const RADIUS_MM: f64 = 42.0;
/// Radius of the chest, whose skin passes through the origin, and the depth of its wall, mm.
const CHEST_MM: [f64; 2] = [130.0, 10.0];

/// Distance from the axis of the chest, mm.
fn from_axis(p: &Point) -> f64 {
    p.x.hypot(p.y - CHEST_MM[0])
}

/// Negative inside the body: a cylinder and a dome on it.
fn body(p: &Point) -> f64 {
    let chest = from_axis(p) - CHEST_MM[0];
    let dome = p.coords.component_div(&Vector::new(1.0, 0.8, 1.0)).norm() - RADIUS_MM;
    let h = (0.5 + 0.5 * (chest - dome) / 10.0).clamp(0.0, 1.0);
    dome * h + chest * (1.0 - h) - 10.0 * h * (1.0 - h)
}

fn grid() -> Grid {
    let origin = Point::new(-120.0, -51.0, -99.0);
    Grid::new([81, 45, 67], Vector::repeat(3.0), origin, Matrix::identity()).unwrap()
}

fn labels() -> Arc<LabelMap> {
    let grid = grid();
    let at = |n: usize| {
        let p = grid.centre(grid.voxel(n));
        match (body(&p) < 0.0, from_axis(&p) < CHEST_MM[0] - CHEST_MM[1]) {
            (false, _) => label::OUTSIDE,
            (true, true) => label::CHEST_WALL,
            (true, false) => label::SOFT_TISSUE,
        }
    };
    let data = (0..grid.len()).map(at).collect();
    Arc::new(LabelMap::new(grid.clone(), data).unwrap())
}

fn skin() -> Skin {
    let grid = grid();
    let at = |n: usize| body(&grid.centre(grid.voxel(n)));
    let share = |n: usize, m: usize| (at(n) / (at(n) - at(m))) as f32;
    Skin::of(&SignedDistance::new(&grid, 12.0, |n| at(n) < 0.0, share))
}

fn meshes() -> [Arc<TetMesh>; 2] {
    let sphere = Sphere::new(Point::new(0.0, 0.0, 0.0), 70.0).unwrap();
    let region = Region::new(labels(), sphere).unwrap();
    let params = supine_tetrahedralise::Params::default();
    let domain = Domain::new(&region, &params, Progress::none()).unwrap();
    [1500, 600].map(|count| Arc::new(domain.mesh(count, Progress::none()).unwrap().0))
}

fn load() -> Load {
    Load { ct: supine_space::supine(), target: supine_space::sitting() }
}

/// The front of the skin that a body moves, in a frame of its own, with noise.
fn scan(
    carried: &Carried,
    body: &Body,
    (rest, lean_deg): (RestState, f64),
    from_scan: &Pose,
) -> Scan {
    let params = Params { rest, ..Params::default() };
    let lean = lean_deg.to_radians();
    let load = Load { target: Vector::new(0.0, lean.sin(), -lean.cos()), ..load() };
    let (deformation, _) = solve(body, &load, &params, Progress::none()).unwrap();
    let moved = carried.displaced(&carried.carry(deformation.displacement()));
    let shape = Rigid {
        points: moved,
        triangles: carried.triangles.clone(),
        weights: carried.weights.clone(),
    };
    let posed = supine_register::Posed::new(&shape, &[]);
    let front = |n: &usize| posed.normals()[*n].y < -0.05 && shape.weights()[*n] > 0.0;
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    for n in (0..posed.points().len()).filter(front) {
        let noise = 0.3 * (12.9898 * n as f64).sin();
        points.push(from_scan.inverse() * (posed.points()[n] + posed.normals()[n] * noise));
        normals.push(from_scan.rotation.inverse() * posed.normals()[n]);
    }
    Scan::new(points, Some(normals), vec![]).unwrap().0
}

/// What is fitted to the scan of a breast of a modulus in one state.
fn fitted(young_kpa: f64, truth: (RestState, f64), start: &Pose) -> Result<Fit, Error> {
    fitted_where(young_kpa, truth, start, |_| true)
}

/// The same to a part of the scan.
fn fitted_where(
    young_kpa: f64,
    truth: (RestState, f64),
    start: &Pose,
    shown: impl Fn(&Point) -> bool,
) -> Result<Fit, Error> {
    let tissue = Tissue { young_kpa, ..Tissue::default() };
    asked(tissue, truth, start, shown, |question| fit(question, Progress::none()))
}

/// What is asked of the scan of a breast of some tissue.
fn asked<T>(
    truth: Tissue,
    posed: (RestState, f64),
    start: &Pose,
    shown: impl Fn(&Point) -> bool,
    ask: impl FnOnce(&FitQuestion<'_>) -> T,
) -> T {
    let (skin, [mesh, coarse]) = (skin(), meshes());
    let tissue = Tissue::default();
    let true_body = Body::new(Arc::clone(&mesh), truth);
    let (body, coarse) = (Body::new(mesh, tissue), Body::new(coarse, tissue));
    let from_scan = Pose::translation(30.0, -20.0, 10.0);
    let carried = Carried::new(&skin, &body.mesh, None);
    let scan = scan(&carried, &true_body, posed, &from_scan);
    let all = scan.points().iter().zip(scan.normals());
    let (points, normals) = all.filter(|(p, _)| shown(&(from_scan * *p))).unzip();
    let scan = Scan::new(points, Some(normals), vec![]).unwrap().0;
    let question = FitQuestion {
        body: &body,
        coarse: &coarse,
        load: &load(),
        params: &Params::default(),
        states: &RestState::ALL,
        skin: &skin,
        centre: Point::origin(),
        other: None,
        scan: &scan,
        poses: &[start * from_scan],
        wall_mm: 0.0,
        tissues: None,
    };
    ask(&question)
}

/// A scan on the table that lies far off all laws but one makes that the first; one that tells
/// nothing leaves them as they are.
fn table_counts(laws: &RankedLaws) {
    let last = laws.tried.len() - 1;
    let wanted = laws.tried[last].fit.additions.clone();
    let off: Vec<_> = (0..=last).map(|n| Some(if n == last { 0.3 } else { 30.0 })).collect();
    let found = laws.clone().with_table(&off);
    let first = &found.tried[0].fit;
    assert!(first.additions == wanted && first.table_mm == Some(0.3), "{first:?}");
    assert!(first.against.abs() < 1e-9 && first.probability > 0.99, "{first:?}");
    let mut off = vec![Some(0.7); last + 1];
    off[last] = None;
    let alike = laws.clone().with_table(&off);
    assert!(alike.tried.len() == last && alike.tried[0].fit.table_mm == Some(0.7));
    let additions = |laws: &RankedLaws| laws.tried[0].fit.additions.clone();
    assert_eq!(additions(&alike), additions(laws));
}

/// The law that a scan supports, for tissue that stiffens and for plain tissue, and how the places
/// of both in the list are held against each other.
#[test]
fn the_law_of_a_scan_is_known_from_others() {
    let start = Pose::translation(1.0, -1.0, 1.0);
    let laws_of = |tissue: Tissue| {
        let sits = (RestState::Unloaded, 0.0);
        asked(
            tissue,
            sits,
            &start,
            |_| true,
            |question| {
                let states = &[RestState::Unloaded];
                let question = FitQuestion { states, ..*question };
                let mut laws = Laws::new(&question, Progress::none()).unwrap();
                laws.look_about(Progress::none()).unwrap();
                let shares = gland(&question.coarse.mesh);
                let tissues =
                    Tissues { shares: &[], coarse: &shares, likely: [1.0, 1.5, 16.0, 6.0] };
                laws.by_tissue(tissues, Progress::none()).unwrap();
                let tried = laws.ranked();
                let fitted = fit_law(&question, &[&tried.tried[0]], Progress::none()).unwrap();
                table_counts(&tried);
                let laws = tried.tried.into_iter().map(|law| law.fit).collect::<Vec<_>>();
                (laws, fitted.states[0].fit.clone())
            },
        )
    };
    let soft = Tissue { young_kpa: 0.6, ..Tissue::default() };
    let (stiffens, fitted) = laws_of(Tissue { law: Law::Exponential, stiffening: 1.5, ..soft });
    let [Addition::Stiffening(by)] = stiffens[0].additions[..] else { panic!("{stiffens:?}") };
    assert!((by - 1.5).abs() < 0.5, "{stiffens:?}");
    assert!((fitted.young_kpa / 0.6 - 1.0).abs() < 0.1, "{fitted:?}");
    let plain = stiffens.iter().find(|law| law.additions.is_empty()).unwrap();
    assert!(plain.against > DECIDES && plain.probability < 0.01, "{stiffens:?}");

    let (plain, fitted) = laws_of(soft);
    assert!((fitted.young_kpa / 0.6 - 1.0).abs() < 0.01, "{fitted:?}");
    assert!(plain[0].additions.is_empty() && plain[0].probability > 0.5, "{plain:?}");
    assert!((plain[0].young_kpa / 0.6 - 1.0).abs() < 0.03, "{plain:?}");
    for laws in [&stiffens, &plain] {
        let whole: f64 = laws.iter().map(|law| law.probability).sum();
        assert!((whole - 1.0).abs() < 1e-12 && laws.len() > 3, "{laws:?}");
        // Nothing speaks for its two parameters.
        assert!(laws.iter().all(|law| law.additions != [Addition::Tissues]), "{laws:?}");
    }
}

#[test]
fn the_modulus_and_the_rest_state_of_a_scan_come_back() {
    let start = Pose::translation(3.0, -2.0, 4.0);
    for (kpa, truth) in [(0.9, RestState::Net), (1.1, RestState::Unloaded)] {
        let found = fitted(kpa, (truth, 0.0), &start).unwrap();
        assert_eq!(found.choice.rest(), truth, "{:?}", found.choice);
        assert!(matches!(found.choice, Choice::Decided { .. }), "{:?}", found.choice);
        let own = found.states.iter().find(|state| state.fit.rest == truth).unwrap();
        let error = own.fit.young_kpa / kpa - 1.0;
        assert!(error.abs() < 0.01, "{truth:?}: {} kPa", own.fit.young_kpa);
        assert!(
            error.abs() < 1.96 * own.fit.deviation && own.fit.deviation < 0.02,
            "{}",
            own.fit.deviation
        );
        assert!(own.fit.misfit_mm < 0.35, "{}", own.fit.misfit_mm);
        let shift = own.aligned.pose.translation.vector - Vector::new(30.0, -20.0, 10.0);
        assert!(shift.norm() < 0.3, "{shift}");
    }
}

#[test]
fn a_patient_who_leans_has_her_modulus_all_the_same() {
    let start = Pose::translation(3.0, -2.0, 4.0);
    let found = fitted(0.9, (RestState::Net, 9.0), &start).unwrap();
    assert_eq!(found.choice.rest(), RestState::Net, "{:?}", found.choice);
    let own = found.states.iter().find(|state| state.fit.rest == RestState::Net).unwrap();
    // A small breast tells little: that she sits upright is taken for likely.
    assert!((4.0..11.0).contains(&own.fit.lean_deg), "{}", own.fit.lean_deg);
    let error = own.fit.young_kpa / 0.9 - 1.0;
    assert!(error.abs() < 1.96 * own.fit.deviation, "{error} of {}", own.fit.deviation);
}

#[test]
fn a_scan_without_the_breast_or_of_a_patient_who_lies_is_refused() {
    let start = Pose::identity();
    let torso = |p: &Point| (p - Point::origin()).norm() > 62.0;
    let error =
        fitted_where(0.9, (RestState::Net, 0.0), &start, torso).map(|fit| fit.choice).unwrap_err();
    assert!(matches!(error, Error::NotSeen { share } if share < 0.35), "{error}");
    let error = fitted(0.9, (RestState::Net, 38.0), &start).map(|fit| fit.choice).unwrap_err();
    assert!(matches!(error, Error::Posture { .. } | Error::AtEnd { .. }), "{error}");
}

/// Shares of tissues: gland in the middle of the breast, fat around it.
fn gland(mesh: &TetMesh) -> Vec<[f64; 4]> {
    let of = |t: usize| {
        let middle = mesh.corners(t).iter().map(|p| p.coords).sum::<Vector>() / 4.0;
        if middle.norm() < 30.0 { [0.0, 1.0, 0.0, 0.0] } else { [1.0, 0.0, 0.0, 0.0] }
    };
    (0..mesh.tets().len()).map(of).collect()
}

#[test]
fn the_proportion_of_gland_to_fat_comes_back_and_one_modulus_is_found_worse() {
    let (skin, [mesh, coarse]) = (skin(), meshes());
    let [shares, of_coarse] = [&mesh, &coarse].map(|mesh| gland(mesh));
    let tissue = Tissue::default();
    let body = |mesh: &Arc<TetMesh>, shares: &[[f64; 4]], ratio: f64| Body {
        young_kpa: Some(Arc::from(moduli(shares, &[1.0, ratio, 1.0, 1.0]))),
        ..Body::new(Arc::clone(mesh), tissue)
    };
    let carried = Carried::new(&skin, &mesh, None);
    let truth = body(&mesh, &shares, 4.0).with_mean(1.0);
    let from_scan = Pose::translation(30.0, -20.0, 10.0);
    let scan = scan(&carried, &truth, (RestState::Net, 0.0), &from_scan);
    let likely = [1.0, 1.5, 16.0, 6.0];
    let question = FitQuestion {
        body: &body(&mesh, &shares, 1.5),
        coarse: &body(&coarse, &of_coarse, 1.5),
        load: &load(),
        params: &Params::default(),
        states: &[RestState::Net],
        skin: &skin,
        centre: Point::origin(),
        other: None,
        scan: &scan,
        poses: &[from_scan],
        wall_mm: 0.0,
        tissues: Some(Tissues { shares: &shares, coarse: &of_coarse, likely }),
    };
    let found = fit(&question, Progress::none()).unwrap();
    let by_tissue = &found.states[0];
    let of = by_tissue.fit.tissues.as_ref().unwrap();
    let error = (of.gland / 4.0).ln();
    assert!(error.abs() < 0.1 && error.abs() < 1.96 * of.deviations[0], "{of:?}");
    assert!(
        (by_tissue.fit.young_kpa - 1.0).abs() < 1.96 * by_tissue.fit.deviation,
        "{by_tissue:?}"
    );
    // There is no skin: what is taken for likely stays, and is said to be no better known.
    assert!((of.skin / 16.0).ln().abs() < 0.01 && of.deviations[1] > 1.0, "{of:?}");
    let bare = |body: &Body| Body { young_kpa: None, ..body.clone() };
    let (one, coarse) = (bare(question.body), bare(question.coarse));
    let alone = FitQuestion { body: &one, coarse: &coarse, tissues: None, ..question };
    let fitted = fit(&alone, Progress::none()).unwrap();
    assert!(compare(&question, by_tissue, &fitted.states[0]) > DECIDES);

    // As one law among those that are held against the scan.
    let mut laws = Laws::new(&alone, Progress::none()).unwrap();
    laws.by_tissue(Tissues { shares: &shares, coarse: &of_coarse, likely }, Progress::none())
        .unwrap();
    let RankedLaws { tried, .. } = laws.ranked();
    assert_eq!(tried[0].fit.additions, [Addition::Tissues]);
    assert!(tried[1..].iter().all(|law| law.fit.against > DECIDES && law.tissues.is_none()));
    let tissues = tried[0].tissues.clone().unwrap();
    // 600 tetrahedra show the border of gland roughly.
    assert!((tissues.gland / 4.0).ln().abs() < 0.3, "{tissues:?}");
    let of_tissues = body(&mesh, &shares, tissues.gland);
    let asked = FitQuestion { body: &of_tissues, ..alone };
    let by_law = &fit_law(&asked, &[&tried[0]], Progress::none()).unwrap().states[0];
    assert_eq!(by_law.fit.tissues.as_ref().map(|own| own.gland), Some(tissues.gland));
    let misfits = [by_law, by_tissue, &fitted.states[0]].map(|state| state.fit.misfit_mm);
    assert!(misfits[0] < 1.2 * misfits[1] && misfits[0] < 0.8 * misfits[2], "{misfits:?}");
}

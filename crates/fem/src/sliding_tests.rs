use super::tests::{TOLERANCE, attach_with, pose, potential, sphere, turn_about};
use super::*;
use crate::RestState;
use crate::rigid::SphereOnShaft;
use crate::test_mesh::{ball, block, icosphere};
use supine_mesh::{SurfaceDistance, TriSurface};
use supine_space::{sitting, supine};

fn sliding(order: Order, rest: RestState) -> Applicator {
    attach_with(order, rest, (&sphere(), Contact::Frictionless)).unwrap()
}

fn values(applicator: &Applicator) -> Vec<Vector> {
    applicator.deformation().unwrap().displacement().values().to_vec()
}

/// Largest difference at nodes of tissue, mm.
fn apart(applicator: &Applicator, a: &[Vector], b: &[Vector]) -> f64 {
    let followed = either!(&applicator.coupling, c => c.site.coupled.iter().map(|(n, _)| *n as usize).collect::<Vec<_>>());
    let tissue = (0..a.len()).filter(|n| !followed.contains(n));
    tissue.map(|n| (a[n] - b[n]).norm()).fold(0.0, f64::max)
}

/// How far the nodes that slide are off their first distance from `rigid`, near its surface and at
/// all, and how far they have slid, mm.
fn sliders(applicator: &Applicator, rigid: &dyn RigidBody, first: &[Vector]) -> [f64; 3] {
    either!(&applicator.coupling, c => {
        let mut found = [0.0f64; 3];
        for slider in &c.site.sliding.as_ref().unwrap().nodes {
            let n = slider.node as usize;
            let now = c.place.pose.inverse_transform_point(&(slider.rest + c.place.u[n]).into());
            let before = Point::from(slider.rest + first[n] + c.site.to_ct[n]);
            let distance = rigid.distance(&before);
            let off = (rigid.distance(&now) - distance).abs();
            let near = if distance > -2.0 { off } else { 0.0 };
            let now_off = [near, off, (now - before).norm()];
            found.iter_mut().zip(now_off).for_each(|(found, now_off)| *found = found.max(now_off));
        }
        found
    })
}

/// A block on its wall.
fn fine(order: Order, applicator: (&dyn RigidBody, Contact)) -> Result<Applicator, Error> {
    let cells = if order == Order::Linear { 6 } else { 4 };
    let mesh = block([cells; 3], 60.0 / cells as f64, 0.1);
    let tissue = crate::Tissue { young_kpa: 3.0, ..crate::Tissue::default() };
    let load = Load { ct: supine(), target: sitting() };
    let params = Params { order, tolerance: TOLERANCE, ..Params::default() };
    let body = Body::new(mesh.clone(), tissue);
    Ok(Applicator::attach(
        &body,
        &load,
        &params,
        &Insertion::new(applicator.0, applicator.1),
        Progress::none(),
    )?
    .0)
}

/// Trap: tissue tied to a sphere turns with it.
#[test]
fn a_sphere_that_turns_about_its_centre_leaves_sliding_tissue_alone() {
    let shift = [3.0, -2.0, 4.0];
    let (there, turned) = (pose(shift, [0.0; 3]), pose(shift, [0.3, -0.2, 0.5]));
    for order in [Order::Linear, Order::Quadratic] {
        let moved = |contact: Contact| {
            let mut applicator = fine(order, (&sphere(), contact)).unwrap();
            applicator.settle(&there, TOLERANCE, Progress::none()).unwrap();
            let before = values(&applicator);
            applicator.step(&turned).unwrap();
            let reaction = applicator.reaction();
            let arm = reaction.force_n.norm() * sphere().radius_mm;
            (apart(&applicator, &before, &values(&applicator)), reaction.moment_n_mm.norm() / arm)
        };
        let (sliding, tied) = (moved(Contact::Frictionless), moved(Contact::Tied));
        assert!(sliding.0 < 1e-6 && sliding.1 < 1e-6, "{order:?} {sliding:?}");
        assert!(tied.0 > 0.5 && tied.1 > 0.1, "{order:?} {tied:?}");
    }
}

/// The cavity bears and weighs nothing, and nodes of nothing else follow the pose.
#[test]
fn the_cavity_is_switched_off() {
    let (mesh, _) = ball(10.0, 40.0, 4, 1);
    let (tissue, load) = (crate::Tissue::default(), Load { ct: supine(), target: supine() });
    let params = Params { order: Order::Linear, ..Params::default() };
    let rigid = SphereOnShaft { centre: Point::origin(), radius_mm: 10.0, shaft: None };
    let body = Body::new(mesh.clone(), tissue);
    let sliding = (&rigid as &dyn RigidBody, Contact::Frictionless);
    let (mut applicator, _) = Applicator::attach(
        &body,
        &load,
        &params,
        &Insertion::new(sliding.0, sliding.1),
        Progress::none(),
    )
    .unwrap();
    let turn = turn_about(Vector::x() * 0.2, Point::new(0.0, 1.0, 0.0));
    applicator.step(&turn).unwrap();
    let Either::Linear(coupling) = &applicator.coupling else { panic!("linear") };
    // The point in the middle is the only one within; all others of the cavity lie on the sphere.
    let site = &coupling.site;
    assert_eq!((site.coupled.len(), applicator.coupled_nodes()), (1, 43));
    let to = turn.transform_point(&Point::origin()).coords;
    assert!((values(&applicator)[0] - to).norm() < 1e-12);
    assert_eq!(site.load[0], Vector::zeros());
    let bearing: f64 = site.model.elements.weights.iter().flatten().sum();
    let of = |tets: std::ops::Range<usize>| tets.map(|t| mesh.volume(t)).sum::<f64>();
    assert!((bearing / of(80..mesh.tets().len()) - 1.0).abs() < 1e-12);
}

/// The prediction is right to first order: half the way leaves a quarter of the error.
#[test]
fn predictions_of_sliding_are_of_first_order() {
    for (order, rigid) in [(Order::Linear, sphere()), (Order::Linear, on_shaft())] {
        let mut applicator = fine(order, (&rigid, Contact::Frictionless)).unwrap();
        let start = pose([2.0, -1.0, 3.0], [0.1, 0.0, 0.1]);
        applicator.settle(&start, TOLERANCE, Progress::none()).unwrap();
        applicator.renew().unwrap();
        let mut lacks = |share: f64| {
            let to = pose([2.0 + 0.4 * share, -1.0, 3.0 - 0.2 * share], [0.1, 0.02 * share, 0.1]);
            let predicted = either!(&applicator.coupling, c => {
                let motion = c.site.motion(&c.place.pose, &to);
                c.predicted(&to, &motion).unwrap().0
            });
            applicator.settle(&to, TOLERANCE, Progress::none()).unwrap();
            let found = either!(&applicator.coupling, c => c.place.u.clone());
            let lack = apart(&applicator, &predicted, &found);
            applicator.settle(&start, TOLERANCE, Progress::none()).unwrap();
            applicator.renew().unwrap();
            lack
        };
        let (whole, half) = (lacks(1.0), lacks(0.5));
        assert!((3.5..4.5).contains(&(whole / half)), "{whole} {half}");
    }
}

fn on_shaft() -> SphereOnShaft {
    let direction = Vector::new(0.2, 0.3, 1.0);
    let shaft = crate::Shaft { direction, radius_mm: 9.0, length_mm: 60.0 };
    SphereOnShaft { shaft: Some(shaft), ..sphere() }
}

#[test]
fn the_reaction_to_sliding_tissue_is_the_slope_of_the_potential() {
    // A body that is no sphere has moments as well.
    let (shift, turn) = ([2.0, -1.0, 1.5], [0.05, 0.1, -0.05]);
    for (order, rigid) in
        [(Order::Linear, sphere()), (Order::Quadratic, sphere()), (Order::Linear, on_shaft())]
    {
        let mut applicator =
            attach_with(order, RestState::Net, (&rigid, Contact::Frictionless)).unwrap();
        applicator.settle(&pose(shift, turn), TOLERANCE, Progress::none()).unwrap();
        let reaction = applicator.reaction();
        let h = 1e-3;
        for axis in 0..3 {
            let mut at = |by: Vector, turned: Vector| {
                let centre = sphere().centre + Vector::from(shift);
                let moved = Pose::translation(by.x, by.y, by.z)
                    * turn_about(turned, centre)
                    * pose(shift, turn);
                applicator.settle(&moved, TOLERANCE, Progress::none()).unwrap();
                potential(&applicator) * 1e-3
            };
            let (along, still) = (Vector::ith(axis, h), Vector::zeros());
            let force = -(at(along, still) - at(-along, still)) / (2.0 * h);
            let moment = -(at(still, along) - at(still, -along)) / (2.0 * h);
            let (force_size, moment_size) =
                (reaction.force_n.norm(), reaction.force_n.norm() * 16.0);
            let off = [force - reaction.force_n[axis], moment - reaction.moment_n_mm[axis]];
            assert!(off[0].abs() < 1e-5 * force_size, "{order:?} {axis}: {off:?} {reaction:?}");
            assert!(off[1].abs() < 1e-5 * moment_size, "{order:?} {axis}: {off:?} {reaction:?}");
        }
    }
}

#[test]
fn sliding_steps_agree_with_cold_solutions_and_keep_the_distance() {
    for rest in [RestState::Net, RestState::Unloaded] {
        for order in [Order::Linear, Order::Quadratic] {
            let mut live = sliding(order, rest);
            let first = values(&live);
            for k in 1..=8 {
                let k = f64::from(k);
                let to = pose([0.6 * k, 0.3 * k, -0.2 * k], [0.0, 0.04 * k, 0.0]);
                let step = live.step(&to).unwrap();
                assert!(!step.by_newton, "{rest:?} {order:?} {k}: {step:?}");
                live.renew_beside();
                if k == 3.0 || k == 8.0 {
                    let mut cold = sliding(order, rest);
                    cold.settle(&to, TOLERANCE, Progress::none()).unwrap();
                    let error = apart(&live, &values(&live), &values(&cold));
                    assert!(error < 0.01, "{rest:?} {order:?} {k}: {error}");
                }
                let [_, off, slip] = sliders(&live, &sphere(), &first);
                assert!(off < 1e-9, "{off}");
                assert!(slip > 0.1 * k, "{slip}");
            }
        }
    }
}

/// An ellipsoid with half axes 18, 12 and 15 mm.
fn ellipsoid() -> SurfaceDistance {
    let (points, triangles) = icosphere(2);
    let axes = Vector::new(18.0, 12.0, 15.0);
    let points = points.iter().map(|p| sphere().centre + p.component_mul(&axes)).collect();
    SurfaceDistance::new(TriSurface::new(points, triangles).unwrap())
}

#[test]
fn tissue_slides_on_any_closed_surface() {
    let rigid = ellipsoid();
    for order in [Order::Linear, Order::Quadratic] {
        let mut applicator = fine(order, (&rigid, Contact::Frictionless)).unwrap();
        let first = values(&applicator);
        for k in 1..=4 {
            let k = f64::from(k);
            let to = pose([0.8 * k, -0.4 * k, 0.6 * k], [0.05 * k, 0.0, 0.1 * k]);
            applicator.step(&to).unwrap();
            applicator.renew().unwrap();
        }
        // The edges of the surface are rounded, and so is what lies between its sides.
        let [near, off, slip] = sliders(&applicator, &rigid, &first);
        assert!(near < 0.05 && off < 0.2 && slip > 1.0, "{order:?} {near} {off} {slip}");
        let ratio =
            either!(&applicator.coupling, c => c.site.model.volume_ratio(&c.place.u).unwrap());
        assert!(ratio.min > 0.1, "{ratio:?}");
        let reaction = applicator.reaction();
        let arm = reaction.force_n.norm() * 15.0;
        assert!(reaction.moment_n_mm.norm() > 0.05 * arm, "{reaction:?}");
        let live = values(&applicator);
        let pose = *applicator.pose();
        let mut cold = fine(order, (&rigid, Contact::Frictionless)).unwrap();
        let made = cold.settle(&pose, TOLERANCE, Progress::none()).unwrap();
        assert!(made.corrections < 20, "{made:?}");
        let error = apart(&applicator, &live, &values(&cold));
        assert!(error < 0.01, "{order:?} {error}");
    }
}

/// Force on a rigid sphere of radius 1 in an elastic ball of radius `outer` that is held outside,
/// per shear modulus and displacement.
///
/// With e the direction and θ the angle from it, Navier's equation has the solutions u = A ((3 −
/// 4ν) e / r + (e · r) r / r³) (Kelvin, of force 16 π μ (1 − ν) A), B (e / r³ − 3 (e · r) r / r⁵),
/// C e and D ((3 − 2ν) r² e − (4 − 6ν) (e · r) r). Of u_r = cos θ …, u_θ = −sin θ … and σ_rθ = μ
/// sin θ … the factors are below. Without end (C = D = 0): 24 π μ (1 − ν) / (5 − 6ν) tied and 24 π
/// μ (1 − ν) / (7 − 8ν) sliding, at ν = ½ the 6 π μ and 4 π μ of Stokes' flow.
fn drag(nu: f64, outer: f64, contact: Contact) -> f64 {
    let radial = |r: f64| [(4.0 - 4.0 * nu) / r, -2.0 / r.powi(3), 1.0, (4.0 * nu - 1.0) * r * r];
    let across = |r: f64| [(3.0 - 4.0 * nu) / r, 1.0 / r.powi(3), 1.0, (3.0 - 2.0 * nu) * r * r];
    let shear = [2.0 - 4.0 * nu, 6.0, 0.0, -(2.0 + 2.0 * nu)];
    let (second, value) = match contact {
        Contact::Tied => (across(1.0), 1.0),
        Contact::Frictionless | Contact::Unilateral => (shear, 0.0),
    };
    let rows = [radial(1.0), second, radial(outer), across(outer)];
    let matrix = nalgebra::Matrix4::from_fn(|i, k| rows[i][k]);
    let found = matrix.lu().solve(&nalgebra::Vector4::new(1.0, value, 0.0, 0.0)).unwrap();
    16.0 * std::f64::consts::PI * (1.0 - nu) * found[0]
}

#[test]
fn the_force_on_a_sphere_in_a_ball_is_that_of_the_theory() {
    let far = |contact| drag(0.3, 1e6, contact) / (24.0 * std::f64::consts::PI * 0.7);
    assert!((far(Contact::Tied) * 3.2 - 1.0).abs() < 1e-5);
    assert!((far(Contact::Frictionless) * 4.6 - 1.0).abs() < 1e-5);
    let (radius, outer, by) = (10.0, 40.0, 0.05);
    let (mesh, curved) = ball(radius, outer, 6, 1);
    let load = Load { ct: supine(), target: supine() };
    let params = Params { order: Order::Quadratic, tolerance: TOLERANCE, ..Params::default() };
    let rigid = SphereOnShaft { centre: Point::origin(), radius_mm: radius, shaft: None };
    for poisson in [0.3, 0.45] {
        let tissue = crate::Tissue { poisson, ..crate::Tissue::default() };
        let body = Body { curved: Some(curved.clone()), ..Body::new(mesh.clone(), tissue) };
        let mu = tissue.young_kpa / (2.0 + 2.0 * poisson);
        let force = |contact: Contact| {
            let (mut applicator, _) = Applicator::attach(
                &body,
                &load,
                &params,
                &Insertion::new(&rigid, contact),
                Progress::none(),
            )
            .unwrap();
            applicator.step(&Pose::translation(0.0, 0.0, by)).unwrap();
            let found = applicator.reaction().force_n / (-1e-3 * mu * radius * by);
            assert!(found.xy().norm() < 0.01 * found.z, "{found}");
            found.z / drag(poisson, outer / radius, contact)
        };
        let (tied, sliding) = (force(Contact::Tied), force(Contact::Frictionless));
        assert!((tied - 1.0).abs() < 0.02 && (sliding - 1.0).abs() < 0.02, "{tied} {sliding}");
    }
}

#[test]
fn what_cannot_slide_is_refused() {
    // A node in the middle of the sphere has no normal.
    let mesh = block([4; 3], 15.0, 0.0);
    let tissue = crate::Tissue::default();
    let load = Load { ct: supine(), target: supine() };
    let params = Params { order: Order::Linear, ..Params::default() };
    let middle =
        SphereOnShaft { centre: Point::new(30.0, 30.0, 30.0), radius_mm: 5.0, shaft: None };
    let attach = |contact: Contact| {
        let body = Body::new(mesh.clone(), tissue);
        Applicator::attach(
            &body,
            &load,
            &params,
            &Insertion::new(&middle, contact),
            Progress::none(),
        )
    };
    let found = attach(Contact::Frictionless);
    assert!(
        matches!(found, Err(Error::ApplicatorMiddle { place: [30.0, 30.0, 30.0] })),
        "{found:?}"
    );
    assert!(attach(Contact::Tied).is_ok());
    let away = SphereOnShaft { centre: Point::new(200.0, 0.0, 0.0), ..sphere() };
    let found = attach_with(Order::Linear, RestState::Net, (&away, Contact::Frictionless));
    assert!(matches!(found, Err(Error::ApplicatorOutside { .. })), "{found:?}");
    let mut applicator = sliding(Order::Linear, RestState::Net);
    let bad = pose([f64::NAN, 0.0, 0.0], [0.0; 3]);
    assert!(matches!(applicator.step(&bad), Err(Error::ApplicatorPose)));
    let through = pose([0.0, 0.0, -60.0], [0.0; 3]);
    assert!(matches!(applicator.step(&through), Err(Error::ApplicatorStuck { .. })));
    applicator.step(&pose([0.0, 0.0, -1.0], [0.0; 3])).unwrap();
}

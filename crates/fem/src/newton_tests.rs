//! Newton's method where it is easily led astray: rounding, indefinite stiffness, failures before.

use super::*;
use crate::element::{Elements, element_nodes};
use crate::material::Material;
use crate::pattern::Storage;
use crate::test_mesh::block;
use supine_mesh::Edges;

/// A block that sits, hanging from its wall.
struct Problem {
    model: Model<10, 4>,
    pattern: Arc<Pattern>,
    held: Vec<bool>,
    load: Vec<Vector>,
}

fn problem(young_kpa: f64) -> Problem {
    let mesh = block([3, 2, 3], 12.0, 0.15);
    let edges = Edges::new(&mesh);
    let mut positions: Vec<Vector> = mesh.points().iter().map(|p| p.coords).collect();
    for [a, b] in edges.ends() {
        positions.push((positions[*a as usize] + positions[*b as usize]) / 2.0);
    }
    let held: Vec<bool> = positions.iter().map(|p| p.z == 0.0).collect();
    let elements = Elements::new(&positions, element_nodes(&mesh, &edges)).unwrap();
    let tissue = crate::Tissue { young_kpa, ..crate::Tissue::default() };
    let turned = supine_space::sitting() - supine_space::supine();
    let load = elements.load(positions.len(), turned * tissue.weight());
    let materials = vec![Material::new(&tissue); mesh.tets().len()];
    let model = Model::new(elements, materials, None);
    let pattern = Arc::new(Pattern::new(&model.elements.nodes, &held, Storage::Lower));
    Problem { model, pattern, held, load }
}

impl Problem {
    fn newton(&self) -> Newton<'_, 10, 4> {
        let tangent = Tangent::new(&self.pattern).unwrap();
        Newton::new(&self.model, tangent, &self.held, norm(&self.load), 60)
    }

    fn zero(&self) -> Vec<Vector> {
        vec![Vector::zeros(); self.held.len()]
    }

    /// Shaken by so much at every free node, mm.
    fn shaken(&self, u: &[Vector], mm: f64) -> Vec<Vector> {
        let shake = |n: usize| Vector::from([1.0, 2.0, 3.0].map(|k| (7.3 * k * n as f64).sin()));
        let all = u.iter().enumerate().zip(&self.held);
        all.map(|((n, u), held)| if *held { *u } else { u + shake(n) * mm }).collect()
    }
}

fn apart(a: &[Vector], b: &[Vector]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// Trap: near the equilibrium changes of the energy are rounding, and a search by energy alone
/// refuses good steps.
#[test]
fn the_last_steps_are_made_where_the_energy_is_rounding() {
    let problem = problem(2.0);
    let mut newton = problem.newton();
    let goal = 1e-12;
    let exact = newton
        .minimise(&problem.load, problem.zero(), Limits { goal, iterations: 60 }, Progress::none())
        .expect("an equilibrium");
    let mut rises = 0;
    for mm in [1e-5, 1e-6, 1e-7, 1e-8, 1e-9] {
        let start = problem.shaken(&exact.u, mm);
        let before = newton.state(start.clone(), &problem.load).unwrap();
        let iterations = if mm > 1e-7 { 4 } else { 3 };
        let found = newton
            .minimise(&problem.load, start, Limits { goal, iterations }, Progress::none())
            .unwrap_or_else(|halt| panic!("from {mm} mm: {}", told(&halt)));
        assert!(found.residual <= goal && before.residual > goal);
        assert!(apart(&found.u, &exact.u) < 1e-9, "from {mm} mm");
        let after = newton.state(found.u, &problem.load).unwrap();
        rises += usize::from(after.potential >= before.potential);
    }
    // By their energies alone some of these steps led upwards.
    assert!(rises > 0);
}

/// Trap: the stiffness on the way to a stable equilibrium may be indefinite. Its missing Cholesky
/// factor is no error, and steps of the shifted one go farther than it says while the energy falls.
#[test]
fn an_indefinite_stiffness_on_the_way_is_no_failure() {
    for (young_kpa, iterations) in [(0.6, 20), (0.35, 50)] {
        let problem = problem(young_kpa);
        let mut newton = problem.newton();
        let start = problem.zero();
        let found = newton
            .minimise(&problem.load, start, Limits { goal: 1e-10, iterations }, Progress::none())
            .unwrap_or_else(|halt| panic!("{young_kpa} kPa: {}", told(&halt)));
        assert!(newton.effort.indefinite > 0, "{young_kpa} kPa: {:?}", newton.effort);
        assert!(newton.is_stable(&found.u).unwrap());
    }
}

/// Without an equilibrium within reach the search ends, and says how far it came.
#[test]
fn a_hopeless_load_is_given_up_in_bounded_time() {
    let problem = problem(0.35);
    let heavy: Vec<Vector> = problem.load.iter().map(|l| l * 30.0).collect();
    let tangent = Tangent::new(&problem.pattern).unwrap();
    let mut newton = Newton::new(&problem.model, tangent, &problem.held, norm(&problem.load), 12);
    let zero = problem.zero();
    let failed = newton.equilibrium(
        &heavy,
        &zero,
        KnownEquilibrium { u: &zero, load: &zero },
        1e-10,
        Progress::none(),
    );
    let Err(SolveError::NotConverged(stall)) = failed else { panic!("an equilibrium") };
    assert!(stall.load_share < 1.0 && stall.residual > 1e-10);
    assert!(newton.effort.iterations <= (1 + STEPS_ITERATIONS) * 12, "{:?}", newton.effort);
}

/// A failure without its thousand nodes.
fn told(halt: &SolveError) -> String {
    match halt {
        SolveError::NotConverged(stall) => {
            format!("{:?} at residual {:e}", stall.cause, stall.residual)
        }
        other => format!("{other:?}"),
    }
}

/// Trap: what a failure leaves in the solver spoils the solutions after it.
#[test]
fn a_failure_leaves_nothing_behind() {
    let problem = problem(1.0);
    let goal = 1e-12;
    let fresh = problem
        .newton()
        .minimise(&problem.load, problem.zero(), Limits { goal, iterations: 60 }, Progress::none())
        .expect("an equilibrium");
    let nan = vec![Vector::repeat(f64::NAN); problem.held.len()];
    let folded = problem.shaken(&problem.zero(), 30.0);
    let heavy: Vec<Vector> = problem.load.iter().map(|l| l * 1e4).collect();
    let failures: [(&str, &[Vector], &[Vector], usize); 4] = [
        ("a load that is no number", &nan, &problem.zero(), 60),
        ("a start that is no number", &problem.load, &nan, 60),
        ("a folded start", &problem.load, &folded, 60),
        ("a load far too heavy", &heavy, &problem.zero(), 2),
    ];
    let mut newton = problem.newton();
    for (what, load, start, iterations) in failures {
        let failed =
            newton.minimise(load, start.to_vec(), Limits { goal, iterations }, Progress::none());
        assert!(matches!(failed, Err(SolveError::NotConverged(_))), "{what}");
        let after = newton
            .minimise(
                &problem.load,
                problem.zero(),
                Limits { goal, iterations: 60 },
                Progress::none(),
            )
            .unwrap_or_else(|halt| panic!("after {what}: {}", told(&halt)));
        assert!(apart(&after.u, &fresh.u) < 1e-10, "after {what}");
        // Neither does the way that was gone before.
        let zero = problem.zero();
        let known = KnownEquilibrium { u: &zero, load: &zero };
        let stepped = newton
            .step_by_step(&problem.load, known, goal, Progress::none())
            .unwrap_or_else(|halt| panic!("steps after {what}: {}", told(&halt)));
        assert!(apart(&stepped.u, &fresh.u) < 1e-10, "steps after {what}");
    }
}

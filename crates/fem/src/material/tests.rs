use super::*;
use nalgebra::{Rotation3, SMatrix};
use proptest::prelude::*;

const TISSUE: NeoHookean = NeoHookean { mu: 0.21, lambda: 1.89 };

/// dP of the docstrings: μ dF − c F^-T dFᵀ F^-T + λ (F^-T : dF) F^-T.
fn tangent(m: &NeoHookean, d: &Gradient, df: &Matrix) -> Matrix {
    let it = d.inverse_transpose;
    df * m.mu - it * df.transpose() * it * m.c(d) + it * (m.lambda * it.dot(df))
}

fn gradients() -> impl Strategy<Value = Matrix> {
    prop::array::uniform9(-0.4..0.4f64)
        .prop_map(|v| Matrix::from_row_slice(&v))
        .prop_filter("inside out", |h| (h + Matrix::identity()).determinant() > 0.1)
}

fn directions() -> impl Strategy<Value = Matrix> {
    prop::array::uniform9(-1.0..1.0f64).prop_map(|v| Matrix::from_row_slice(&v))
}

fn turns() -> impl Strategy<Value = Matrix> {
    prop::array::uniform3(-3.0..3.0f64)
        .prop_map(|v| Rotation3::from_scaled_axis(Vector::from(v)).into_inner())
}

proptest! {
    #[test]
    fn stress_is_the_slope_of_energy(h in gradients(), dh in directions()) {
        let at = |t: f64| TISSUE.energy(&Gradient::new(h + dh * t).unwrap());
        let step = 1e-6;
        let slope = (at(step) - at(-step)) / (2.0 * step);
        let stress = TISSUE.stress(&Gradient::new(h).unwrap());
        prop_assert!((slope - stress.dot(&dh)).abs() < 1e-6, "{slope} {}", stress.dot(&dh));
    }

    #[test]
    fn tangent_is_the_slope_of_stress(h in gradients(), dh in directions()) {
        let at = |t: f64| TISSUE.stress(&Gradient::new(h + dh * t).unwrap());
        let step = 1e-6;
        let slope = (at(step) - at(-step)) / (2.0 * step);
        let want = tangent(&TISSUE, &Gradient::new(h).unwrap(), &dh);
        prop_assert!((slope - want).norm() < 1e-5 * want.norm().max(1.0), "{slope} {want}");
    }

    #[test]
    fn a_rigid_turn_bears_no_stress(q in turns()) {
        let d = Gradient::new(q - Matrix::identity()).unwrap();
        prop_assert!(TISSUE.stress(&d).norm() < 1e-14);
        prop_assert!(TISSUE.energy(&d).abs() < 1e-14);
    }

    #[test]
    fn stress_turns_with_the_observer(h in gradients(), q in turns()) {
        let d = Gradient::new(h).unwrap();
        let turned = Gradient::new(q * d.f() - Matrix::identity()).unwrap();
        prop_assert!((TISSUE.stress(&turned) - q * TISSUE.stress(&d)).norm() < 1e-12);
        prop_assert!((TISSUE.energy(&turned) - TISSUE.energy(&d)).abs() < 1e-12);
    }

    /// The shifted tangent equals the full 9 × 9 one with its eigenvalues raised.
    #[test]
    fn shifting_equals_the_full_eigenproblem(h in gradients()) {
        let d = Gradient::new(h * 1.5).filter(|d| d.j > 0.05);
        prop_assume!(d.is_some());
        let d = d.unwrap();
        let floor = 0.5 * TISSUE.mu;
        let full = SMatrix::<f64, 9, 9>::from_fn(|r, c| {
            let mut df = Matrix::zeros();
            df[c] = 1.0;
            tangent(&TISSUE, &d, &df)[r]
        });
        let eigen = SymmetricEigen::new(full);
        let raised = eigen.eigenvectors
            * SMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(floor)))
            * eigen.eigenvectors.transpose();
        let mut ours = full;
        for (weight, m) in TISSUE.shift(&d, floor) {
            prop_assert!(weight > 0.0);
            ours += SMatrix::<f64, 9, 9>::from_fn(|r, c| weight * m[r] * m[c]);
        }
        prop_assert!((ours - raised).norm() < 1e-9 * full.norm(), "{}", ours - raised);
    }
}

#[test]
fn material_turned_inside_out_is_refused() {
    assert!(Gradient::new(Matrix::from_diagonal(&Vector::new(-2.0, 0.0, 0.0))).is_none());
    assert!(Gradient::new(Matrix::from_diagonal(&Vector::new(-1.0, 0.0, 0.0))).is_none());
    assert!(Gradient::new(Matrix::repeat(f64::NAN)).is_none());
}

/// Simple shear by k: Cauchy shear stress μ k, no volume change. Bonet and Wood 2008, section
/// 6.4.3.
#[test]
fn simple_shear_has_the_known_stress() {
    let k = 0.7;
    let mut h = Matrix::zeros();
    h[(0, 1)] = k;
    let d = Gradient::new(h).unwrap();
    let cauchy = TISSUE.stress(&d) * d.f().transpose() / d.j;
    let (b, i) = (d.f() * d.f().transpose(), Matrix::identity());
    assert!((cauchy[(0, 1)] - TISSUE.mu * k).abs() < 1e-15);
    assert!((cauchy - (b - i) * TISSUE.mu).norm() < 1e-14);
}

use super::*;
use nalgebra::{Rotation3, SMatrix};
use proptest::prelude::*;
use supine_space::{LANES, Pack};

/// One of each law.
fn tissues() -> impl Strategy<Value = Material> {
    prop::sample::select(Law::ALL.map(tissue).to_vec())
}

fn tissue(law: Law) -> Material {
    Material::of_law(law, 0.21, 1.89)
}

/// At a point that tissue can reach.
fn at(tissue: &Material, h: Matrix) -> Option<Gradient> {
    Gradient::new(h).filter(|d| tissue.reaches(d.q()))
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
    fn stress_is_the_slope_of_energy(m in tissues(), h in gradients(), dh in directions()) {
        let step = 1e-6;
        let [up, down] = [step, -step].map(|t| at(&m, h + dh * t));
        prop_assume!(up.is_some() && down.is_some());
        let [up, down] = [up, down].map(|d| m.energy(&d.unwrap()));
        let slope = (up - down) / (2.0 * step);
        let stress = m.stress(&Gradient::new(h).unwrap());
        prop_assert!((slope - stress.dot(&dh)).abs() < 1e-6 * stress.norm().max(1.0), "{slope} {}", stress.dot(&dh));
    }

    #[test]
    fn the_change_of_stress_is_its_slope(m in tissues(), h in gradients(), dh in directions()) {
        let step = 1e-6;
        let [up, down] = [step, -step].map(|t| at(&m, h + dh * t));
        prop_assume!(up.is_some() && down.is_some());
        let [up, down] = [up, down].map(|d| m.stress(&d.unwrap()));
        let slope = (up - down) / (2.0 * step);
        let want = m.stress_change(&Gradient::new(h).unwrap(), &dh);
        prop_assert!((slope - want).norm() < 1e-5 * want.norm().max(1.0), "{slope} {want}");
    }

    #[test]
    fn the_tangent_is_symmetric(m in tissues(), h in gradients(), a in directions(), b in directions()) {
        let Some(d) = at(&m, h) else { return Ok(()) };
        let [ab, ba] = [(a, b), (b, a)].map(|(a, b)| m.stress_change(&d, &a).dot(&b));
        prop_assert!((ab - ba).abs() < 1e-10 * ab.abs().max(1.0), "{ab} {ba}");
    }

    /// Nothing bears less energy than tissue that is turned alone.
    #[test]
    fn a_rigid_turn_bears_neither_stress_nor_energy_and_all_else_does(m in tissues(), q in turns(), h in gradients()) {
        let d = Gradient::new(q - Matrix::identity()).unwrap();
        prop_assert!(m.stress(&d).norm() < 1e-14);
        prop_assert!(m.energy(&d).abs() < 1e-14);
        if let Some(d) = at(&m, h) {
            let strain = (d.f().transpose() * d.f() - Matrix::identity()).norm();
            prop_assert!(m.energy(&d) > 0.0 || strain < 1e-6);
        }
    }

    #[test]
    fn stress_turns_with_the_observer(m in tissues(), h in gradients(), q in turns()) {
        let Some(d) = at(&m, h) else { return Ok(()) };
        let turned = Gradient::new(q * d.f() - Matrix::identity()).unwrap();
        let size = m.stress(&d).norm().max(1.0);
        prop_assert!((m.stress(&turned) - q * m.stress(&d)).norm() < 1e-10 * size);
        prop_assert!((m.energy(&turned) - m.energy(&d)).abs() < 1e-10 * size);
    }

    /// At small strain every law is the linear solid of its Lamé parameters.
    #[test]
    fn small_strain_is_that_of_the_moduli(m in tissues(), h in directions()) {
        let d = Gradient::new(h * 1e-7).unwrap();
        let strain = (h + h.transpose()) * 0.5e-7;
        let want = strain * (2.0 * m.mu) + Matrix::identity() * (m.lambda * strain.trace());
        prop_assert!((m.stress(&d) - want).norm() < 1e-5 * want.norm(), "{} {want}", m.stress(&d));
    }

    /// The shifted tangent of the neo-Hookean solid equals the full 9 × 9 one with its eigenvalues
    /// raised; that of the others has none below.
    #[test]
    fn shifting_raises_the_eigenvalues(m in tissues(), h in gradients()) {
        let Some(d) = at(&m, h * 1.5).filter(|d| d.j > 0.05) else { return Ok(()) };
        let floor = 0.5 * m.mu;
        let full = SMatrix::<f64, 9, 9>::from_fn(|r, c| {
            let mut df = Matrix::zeros();
            df[c] = 1.0;
            m.stress_change(&d, &df)[r]
        });
        let mut ours = full;
        for (weight, mode) in m.shift(&d, floor) {
            prop_assert!(weight > 0.0);
            ours += SMatrix::<f64, 9, 9>::from_fn(|r, c| weight * mode[r] * mode[c]);
        }
        let lowest = SymmetricEigen::new(ours).eigenvalues.min();
        prop_assert!(lowest > floor - 1e-9 * full.norm(), "{lowest}");
        if m.law == Law::NeoHookean {
            let eigen = SymmetricEigen::new(full);
            let raised = eigen.eigenvectors
                * SMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(floor)))
                * eigen.eigenvectors.transpose();
            prop_assert!((ours - raised).norm() < 1e-9 * full.norm(), "{}", ours - raised);
        }
    }

    /// Several elements at once give what one gives.
    #[test]
    fn the_packed_law_is_the_plain_one(m in tissues(), h in gradients()) {
        let d = Gradient::new(h).unwrap();
        let row: [f64; 9] = std::array::from_fn(|n| h[(n / 3, n % 3)]);
        let state = PackedGradient::new(row.map(Pack::all)).unwrap();
        by_law!(m.law, Pack, L => {
            let packed = PackedMaterial::<L>::new([&m; LANES]);
            prop_assert_eq!(packed.energy(&state).is_some(), m.reaches(d.q()));
            if let Some(energy) = packed.energy(&state) {
                prop_assert!((energy.0[0] - m.energy(&d)).abs() < 1e-13 * m.energy(&d).max(1e-2));
                let (ours, want) = (packed.stress(&state, Pack::all(2.0)), m.stress(&d) * 2.0);
                let ours = Matrix::from_fn(|r, c| ours[3 * r + c].0[LANES - 1]);
                prop_assert!((ours - want).norm() < 1e-12 * want.norm().max(1e-2));
            }
        });
    }
}

#[test]
fn material_turned_inside_out_is_refused() {
    assert!(Gradient::new(Matrix::from_diagonal(&Vector::new(-2.0, 0.0, 0.0))).is_none());
    assert!(Gradient::new(Matrix::from_diagonal(&Vector::new(-1.0, 0.0, 0.0))).is_none());
    assert!(Gradient::new(Matrix::repeat(f64::NAN)).is_none());
}

/// The shear modulus at Q over that at small strain, from the papers that the laws are from.
fn grown(law: Law, q: f64) -> f64 {
    match law {
        Law::NeoHookean => 1.0,
        Law::Exponential => (STIFFENING * q).exp(),
        Law::Gent => 1.0 / (1.0 - STIFFENING * q),
        Law::Yeoh => 1.0 + STIFFENING * q,
    }
}

/// Simple shear by k: no volume change, Q = k² and the Cauchy shear stress m(Q) k, the first normal
/// stress m(Q) k². Bonet and Wood 2008, section 6.4.3, with the modulus at Q.
#[test]
fn simple_shear_has_the_known_stress() {
    let k = 0.7;
    let mut h = Matrix::zeros();
    h[(0, 1)] = k;
    let d = Gradient::new(h).unwrap();
    for law in Law::ALL {
        let m = tissue(law);
        let cauchy = m.stress(&d) * d.f().transpose() / d.j;
        let modulus = m.mu * grown(law, k * k);
        let (b, i) = (d.f() * d.f().transpose(), Matrix::identity());
        assert!((cauchy - (b - i) * modulus).norm() < 1e-14, "{law}");
        assert!((cauchy[(0, 1)] - modulus * k).abs() < 1e-14, "{law}");
    }
}

/// Uniaxial stretch s of a bar whose sides are free: with the sides stretched by r, λ ln J = m (1 −
/// r²) and σ = m (s² − r²) / J, from σ = [m (b − I) + λ ln J I] / J.
#[test]
fn a_bar_that_is_pulled_has_the_known_stress() {
    for law in Law::ALL {
        let m = tissue(law);
        for s in [0.7f64, 1.1, 1.5] {
            let (mut low, mut high) = (0.5f64, 1.6f64);
            let grown_at = |r: f64| {
                let ln_j = s.ln() + 2.0 * r.ln();
                let q = s * s + 2.0 * r * r - 3.0 - 2.0 * ln_j;
                (m.mu * grown(law, q), ln_j)
            };
            for _ in 0..80 {
                let r = 0.5 * (low + high);
                let (modulus, ln_j) = grown_at(r);
                let side = modulus * (r * r - 1.0) + m.lambda * ln_j;
                if side > 0.0 { high = r } else { low = r }
            }
            let (modulus, ln_j) = grown_at(low);
            let pulled = Vector::new(s - 1.0, low - 1.0, low - 1.0);
            let d = Gradient::new(Matrix::from_diagonal(&pulled)).unwrap();
            let cauchy = m.stress(&d) * d.f().transpose() / d.j;
            let want = modulus * (s * s - low * low) / ln_j.exp();
            assert!((cauchy[(0, 0)] - want).abs() < 1e-12, "{law} {s}: {} {want}", cauchy[(0, 0)]);
            assert!(cauchy[(1, 1)].abs() < 1e-12 && cauchy[(2, 2)].abs() < 1e-12, "{law} {s}");
        }
    }
}

#[test]
fn tissue_that_cannot_be_stretched_further_is_refused() {
    let gent = tissue(Law::Gent);
    let h = Matrix::from_diagonal(&Vector::new(2.5, -0.3, -0.3));
    let d = Gradient::new(h).unwrap();
    assert!(d.q() > 1.0 / STIFFENING && !gent.reaches(d.q()));
    assert!(tissue(Law::NeoHookean).reaches(d.q()));
    let back = Gradient::new(d.f().try_inverse().unwrap() - Matrix::identity()).unwrap();
    assert!(gent.loaded(&back).is_none() && tissue(Law::NeoHookean).loaded(&back).is_some());
}

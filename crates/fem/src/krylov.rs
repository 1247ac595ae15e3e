//! Iterative solvers for systems close to one that can be factorised.

/// A relative residual below this that is not halved in so many steps is rounding: where rows
/// differ by orders of magnitude, as those of a wall that is slid on and of soft tissue, it can lie
/// above what is asked.
const ROUNDING: f64 = 1e-8;
const HALVED_IN: usize = 12;

/// Solves A x = b to |A x − b| ≤ `goal` |b|, or to rounding; `None` when `max_steps` steps do not
/// suffice.
///
/// `apply` writes A x, `precondition` replaces x by M⁻¹ x with M near A up to sign and scale.
/// Right-preconditioned GMRES without restart (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7,
/// 1986), which keeps the preconditioned vectors, so that an M⁻¹ that rounds costs no accuracy
/// (Saad, SIAM J. Sci. Comput. 14, 1993). Memory: two times `max_steps` vectors at the worst.
pub(crate) fn gmres(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&mut [f64]) -> bool,
    b: &[f64],
    goal: f64,
    max_steps: usize,
) -> Option<Vec<f64>> {
    let scale = norm(b);
    if scale == 0.0 {
        return Some(b.to_vec());
    }
    let mut basis = vec![b.iter().map(|v| v / scale).collect::<Vec<f64>>()];
    let mut preconditioned: Vec<Vec<f64>> = Vec::new();
    let mut residuals: Vec<f64> = Vec::new();
    let mut triangle = Triangle { columns: Vec::new(), turns: Vec::new(), right: vec![scale] };
    for step in 0..max_steps {
        let mut z = basis[step].clone();
        if !precondition(&mut z) {
            return None;
        }
        let mut w = vec![0.0; b.len()];
        apply(&z, &mut w);
        preconditioned.push(z);
        let mut column: Vec<f64> = Vec::with_capacity(step + 2);
        for v in &basis {
            let part = dot(&w, v);
            w.iter_mut().zip(v).for_each(|(w, v)| *w -= part * v);
            column.push(part);
        }
        let length = norm(&w);
        if !length.is_finite() {
            return None;
        }
        column.push(length);
        let residual = triangle.push(column);
        let before = step.checked_sub(HALVED_IN).map_or(f64::INFINITY, |n| residuals[n]);
        let rounding = residual <= ROUNDING * scale && residual > 0.5 * before;
        residuals.push(residual);
        if residual <= goal * scale || rounding || length == 0.0 {
            let mut x = vec![0.0; b.len()];
            for (weight, z) in triangle.solve().into_iter().zip(&preconditioned) {
                x.iter_mut().zip(z).for_each(|(x, z)| *x += weight * z);
            }
            return Some(x);
        }
        w.iter_mut().for_each(|v| *v /= length);
        basis.push(w);
    }
    None
}

/// Solves A x = b, A symmetric, to |A x − b| ≤ `goal` |b|; `None` when A is seen not to be positive
/// definite or `max_steps` steps do not suffice.
///
/// `apply` writes A x, `precondition` replaces x by M⁻¹ x with M near A. Source: Hestenes and
/// Stiefel, J. Res. Natl. Bur. Stand. 49, 1952; with the factor of Polak and Ribière, which bears
/// an M⁻¹ that rounds differently from step to step (Golub and Ye, SIAM J. Sci. Comput. 21, 1999).
pub(crate) fn conjugate_gradients(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&mut [f64]) -> bool,
    b: &[f64],
    goal: f64,
    max_steps: usize,
) -> Option<Vec<f64>> {
    let mut x = vec![0.0; b.len()];
    let mut r = b.to_vec();
    let end = goal * norm(b);
    let mut z = vec![0.0; b.len()];
    let mut p = vec![0.0; b.len()];
    let mut product = vec![0.0; b.len()];
    // <r, M⁻¹ r> and step length of the step before.
    let (mut before, mut alpha) = (1.0, 0.0);
    let mut steps = 0;
    while norm(&r) > end {
        if steps == max_steps {
            return None;
        }
        steps += 1;
        z.copy_from_slice(&r);
        if !precondition(&mut z) {
            return None;
        }
        // What the last step took from r was alpha A p.
        let beta = -alpha * dot(&product, &z) / before;
        p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + beta * *p);
        before = dot(&r, &z);
        apply(&p, &mut product);
        let curvature = dot(&p, &product);
        if !(before > 0.0 && curvature > 0.0 && curvature.is_finite()) {
            return None;
        }
        alpha = before / curvature;
        x.iter_mut().zip(&p).for_each(|(x, p)| *x += alpha * p);
        r.iter_mut().zip(&product).for_each(|(r, v)| *r -= alpha * v);
    }
    Some(x)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Euclidean norm.
pub(crate) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// The Hessenberg matrix of the Arnoldi basis, made triangular by Givens turns as it grows.
struct Triangle {
    columns: Vec<Vec<f64>>,
    turns: Vec<(f64, f64)>,
    right: Vec<f64>,
}

impl Triangle {
    /// Adds a column; returns the norm of the residual.
    fn push(&mut self, mut column: Vec<f64>) -> f64 {
        for (k, (c, s)) in self.turns.iter().enumerate() {
            let (upper, lower) = (column[k], column[k + 1]);
            column[k] = c * upper + s * lower;
            column[k + 1] = c * lower - s * upper;
        }
        let k = self.columns.len();
        let length = column[k].hypot(column[k + 1]);
        let (c, s) =
            if length > 0.0 { (column[k] / length, column[k + 1] / length) } else { (1.0, 0.0) };
        column[k] = length;
        column.truncate(k + 1);
        self.turns.push((c, s));
        self.columns.push(column);
        let last = self.right[k];
        self.right[k] = c * last;
        self.right.push(-s * last);
        self.right[k + 1].abs()
    }

    /// Weights of the basis by back substitution.
    fn solve(&self) -> Vec<f64> {
        let n = self.columns.len();
        let mut weights = self.right[..n].to_vec();
        for k in (0..n).rev() {
            for later in k + 1..n {
                weights[k] -= self.columns[later][k] * weights[later];
            }
            weights[k] /= self.columns[k][k];
        }
        weights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(row: usize, column: usize) -> f64 {
        let near = if row == column { 4.0 + row as f64 } else { 0.0 };
        near + ((7 * row + 3 * column) % 5) as f64 / 5.0
    }

    fn apply(x: &[f64], product: &mut [f64]) {
        for (row, product) in product.iter_mut().enumerate() {
            *product = x.iter().enumerate().map(|(c, x)| matrix(row, c) * x).sum();
        }
    }

    /// A x − b.
    fn rest(apply: impl Fn(&[f64], &mut [f64]), x: &[f64], b: &[f64]) -> f64 {
        let mut product = vec![0.0; b.len()];
        apply(x, &mut product);
        norm(&product.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>())
    }

    /// Symmetric, positive definite unless the shift is large.
    fn symmetric(shift: f64) -> impl Fn(&[f64], &mut [f64]) {
        move |x, product| {
            let n = x.len();
            for (i, product) in product.iter_mut().enumerate() {
                let near = [i.wrapping_sub(1), i + 1];
                let others: f64 = near.iter().filter(|k| **k < n).map(|k| x[*k]).sum();
                *product = (2.1 - shift) * x[i] - others;
            }
        }
    }

    #[test]
    fn a_symmetric_system_is_solved_with_a_preconditioner_that_rounds() {
        let b: Vec<f64> = (0..40).map(|k| f64::from(k % 7) - 2.5).collect();
        let rough = |x: &mut [f64]| {
            x.iter_mut().for_each(|x| *x = f64::from((*x / 2.1) as f32));
            true
        };
        let x = conjugate_gradients(symmetric(0.0), rough, &b, 1e-12, 60).unwrap();
        assert!(rest(symmetric(0.0), &x, &b) < 2e-12 * norm(&b));
        assert!(conjugate_gradients(symmetric(0.0), rough, &b, 1e-12, 5).is_none());
        assert!(conjugate_gradients(symmetric(2.0), rough, &b, 1e-12, 60).is_none());
        let none = conjugate_gradients(symmetric(0.0), rough, &[0.0; 4], 1e-12, 60);
        assert_eq!(none.unwrap(), vec![0.0; 4]);
    }

    #[test]
    fn an_unsymmetric_system_is_solved() {
        let b: Vec<f64> = (0..12).map(|k| f64::from(k % 4) - 1.5).collect();
        let diagonal = |x: &mut [f64]| {
            x.iter_mut().enumerate().for_each(|(k, x)| *x /= -matrix(k, k));
            true
        };
        let x = gmres(apply, diagonal, &b, 1e-12, 12).unwrap();
        assert!(rest(apply, &x, &b) < 1e-11 * norm(&b));
        assert!(gmres(apply, diagonal, &b, 1e-12, 3).is_none());
    }

    #[test]
    fn a_residual_that_only_rounding_keeps_above_the_goal_counts() {
        // No x answers to the last row, which holds 1e-10 of the right side.
        let rounds = |x: &[f64], product: &mut [f64]| {
            apply(x, product);
            product[39] = 0.0;
        };
        let mut b: Vec<f64> = (0..40).map(|k| f64::from(k % 4) - 1.5).collect();
        b[39] = 1e-10 * norm(&b);
        let mut steps = 0;
        let diagonal = |x: &mut [f64]| {
            x.iter_mut().enumerate().for_each(|(k, x)| *x /= matrix(k, k));
            true
        };
        let count = |x: &mut [f64]| {
            steps += 1;
            diagonal(x)
        };
        let x = gmres(rounds, count, &b, 1e-12, 39).unwrap();
        assert!(steps < 39 && rest(rounds, &x, &b) < 1e-9 * norm(&b), "{steps} steps");
        b[39] *= 1e4;
        assert!(gmres(rounds, diagonal, &b, 1e-12, 39).is_none(), "that is no rounding");
    }
}

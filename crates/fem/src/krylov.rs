//! An iterative solver for unsymmetric systems close to one that can be factorised.

/// Solves A x = b to |A x − b| ≤ `goal` |b|; `None` when `most` steps do not suffice.
///
/// `apply` gives A x, `precondition` replaces x by M⁻¹ x with M near A up to sign and scale.
/// Right-preconditioned GMRES without restart: Saad and Schultz, SIAM J. Sci. Stat. Comput. 7, 1986.
/// Memory: `most` vectors at the worst.
pub(crate) fn gmres(
    apply: impl Fn(&[f64]) -> Vec<f64>,
    mut precondition: impl FnMut(&mut [f64]) -> bool,
    b: &[f64],
    goal: f64,
    most: usize,
) -> Option<Vec<f64>> {
    let scale = norm(b);
    if scale == 0.0 {
        return Some(b.to_vec());
    }
    let mut basis = vec![b.iter().map(|v| v / scale).collect::<Vec<f64>>()];
    let mut triangle = Triangle { columns: Vec::new(), turns: Vec::new(), right: vec![scale] };
    for step in 0..most {
        let mut z = basis[step].clone();
        if !precondition(&mut z) {
            return None;
        }
        let mut w = apply(&z);
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
        if residual <= goal * scale || length == 0.0 {
            let mut x = vec![0.0; b.len()];
            for (weight, v) in triangle.solve().into_iter().zip(&basis) {
                x.iter_mut().zip(v).for_each(|(x, v)| *x += weight * v);
            }
            return precondition(&mut x).then_some(x);
        }
        w.iter_mut().for_each(|v| *v /= length);
        basis.push(w);
    }
    None
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

    fn apply(x: &[f64]) -> Vec<f64> {
        (0..x.len()).map(|r| x.iter().enumerate().map(|(c, x)| matrix(r, c) * x).sum()).collect()
    }

    #[test]
    fn an_unsymmetric_system_is_solved() {
        let b: Vec<f64> = (0..12).map(|k| f64::from(k % 4) - 1.5).collect();
        let diagonal = |x: &mut [f64]| {
            x.iter_mut().enumerate().for_each(|(k, x)| *x /= -matrix(k, k));
            true
        };
        let x = gmres(apply, diagonal, &b, 1e-12, 12).unwrap();
        let rest: Vec<f64> = apply(&x).iter().zip(&b).map(|(a, b)| a - b).collect();
        assert!(norm(&rest) < 1e-11 * norm(&b), "{rest:?}");
        assert!(gmres(apply, diagonal, &b, 1e-12, 3).is_none());
    }
}

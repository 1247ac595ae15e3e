//! The memory of a quasi-Newton method.

/// Pairs kept.
const PAIRS: usize = 8;

struct Pair {
    step: Vec<f64>,
    /// Change of the residual over the step.
    change: Vec<f64>,
    /// 1 / (step · change).
    weight: f64,
}

/// What the last steps say of the inverse of the tangent, beyond an approximation of it.
///
/// L-BFGS: Nocedal, Math. Comput. 35, 1980.
#[derive(Default)]
pub(crate) struct Memory {
    pairs: Vec<Pair>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], weight: f64, v: &[f64]) {
    to.iter_mut().zip(v).for_each(|(to, v)| *to += weight * v);
}

impl Memory {
    /// Keeps a step and the change of the gradient over it, unless they say that the energy is not convex
    /// there.
    pub(crate) fn keep(&mut self, step: Vec<f64>, change: Vec<f64>) {
        let curvature = dot(&step, &change);
        if curvature > 0.0 && curvature.is_finite() {
            if self.pairs.len() == PAIRS {
                self.pairs.remove(0);
            }
            self.pairs.push(Pair { step, change, weight: 1.0 / curvature });
        }
    }

    /// Replaces `x` by the approximate inverse times `x`; `base` does that without the memory.
    pub(crate) fn apply(&self, x: &mut [f64], base: impl FnOnce(&mut [f64]) -> bool) -> bool {
        let mut parts = vec![0.0; self.pairs.len()];
        for (part, pair) in parts.iter_mut().zip(&self.pairs).rev() {
            *part = pair.weight * dot(&pair.step, x);
            add(x, -*part, &pair.change);
        }
        if !base(x) {
            return false;
        }
        for (part, pair) in parts.iter().zip(&self.pairs) {
            let other = pair.weight * dot(&pair.change, x);
            add(x, part - other, &pair.step);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After a step along each axis the approximation is the inverse of the matrix.
    #[test]
    fn a_quadratic_is_learnt_step_by_step() {
        let matrix = [[4.0, 1.0], [1.0, 3.0]];
        let times = |x: &[f64]| -> Vec<f64> { matrix.iter().map(|row| dot(row, x)).collect() };
        let mut memory = Memory::default();
        let (first, second) = (vec![1.0, 0.0], vec![-0.25, 1.0]);
        assert_eq!(dot(&first, &times(&second)), 0.0);
        for step in [first, second] {
            let change = times(&step);
            memory.keep(step, change);
        }
        let mut x = times(&[0.7, -0.2]);
        assert!(memory.apply(&mut x, |_| true));
        assert!((x[0] - 0.7).abs() < 1e-14 && (x[1] + 0.2).abs() < 1e-14, "{x:?}");
        memory.keep(vec![1.0, 0.0], vec![-1.0, 0.0]);
        assert_eq!(memory.pairs.len(), 2);
    }
}

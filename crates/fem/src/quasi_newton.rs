//! Quasi-Newton steps with a kept factor: their memory, and the error they leave.

/// Corrections end when the error that is left is estimated below this, mm, unless another is asked
/// for.
pub(crate) const ERROR_MM: f64 = 0.004;

/// When the corrections of a step end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// The error that is left is estimated below this, mm.
    pub error_mm: f64,
    /// Most corrections.
    pub corrections: usize,
    /// Whether the step counts as made after so many, as long as each is smaller than the one
    /// before. Else it is not made.
    pub partly: bool,
}

impl Budget {
    /// An equilibrium, or nothing.
    pub(crate) const fn whole(corrections: usize) -> Self {
        Self { error_mm: ERROR_MM, corrections, partly: false }
    }

    /// Whether a step is made after so many corrections that leave an error, mm; `shrinks`: the
    /// last was smaller than the one before.
    pub(crate) fn is_met(&self, corrections: usize, error_mm: f64, shrinks: bool) -> bool {
        let spent = corrections == self.corrections && self.partly;
        error_mm <= self.error_mm || (spent && shrinks)
    }
}

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
    /// The last step and the gradient where it began: a pair once the gradient where it ended is
    /// known.
    last: Option<(Vec<f64>, Vec<f64>)>,
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], weight: f64, v: &[f64]) {
    to.iter_mut().zip(v).for_each(|(to, v)| *to += weight * v);
}

impl Memory {
    /// The step from where the energy has this `gradient`, which must be where the last step ended
    /// unless [`Memory::rest`] came between; `base` multiplies by the inverse that the memory adds
    /// to, or fails.
    pub(crate) fn step(
        &mut self,
        gradient: Vec<f64>,
        base: impl FnOnce(&mut [f64]) -> bool,
    ) -> Option<Vec<f64>> {
        if let Some((step, old)) = self.last.take() {
            let change = gradient.iter().zip(&old).map(|(new, old)| new - old).collect();
            self.keep(step, change);
        }
        let mut step: Vec<f64> = gradient.iter().map(|g| -g).collect();
        if !self.apply(&mut step, base) {
            return None;
        }
        self.last = Some((step.clone(), gradient));
        Some(step)
    }

    /// The next step begins under another load: the gradient there does not tell what the last step
    /// did.
    pub(crate) fn rest(&mut self) {
        self.last = None;
    }

    /// Keeps a step and the change of the gradient over it, unless they say that the energy is not
    /// convex there.
    fn keep(&mut self, step: Vec<f64>, change: Vec<f64>) {
        let curvature = dot(&step, &change);
        if curvature > 0.0 && curvature.is_finite() {
            if self.pairs.len() == PAIRS {
                self.pairs.remove(0);
            }
            self.pairs.push(Pair { step, change, weight: 1.0 / curvature });
        }
    }

    /// Replaces `x` by the approximate inverse times `x`; `base` does that without the memory.
    fn apply(&self, x: &mut [f64], base: impl FnOnce(&mut [f64]) -> bool) -> bool {
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

/// Largest motion of a node in a vector of unknowns, mm.
pub(crate) fn largest(unknowns: &[f64]) -> f64 {
    unknowns
        .chunks_exact(3)
        .map(|v| v.iter().map(|v| v * v).sum::<f64>())
        .fold(0.0, f64::max)
        .sqrt()
}

/// Estimate of the error after a correction of this size (mm), when each leaves the share `left` of
/// the error: what the next ones would add, a geometric series.
pub(crate) fn error_mm(size: f64, left: f64) -> f64 {
    size * left / (1.0 - left).max(0.1)
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

    /// Trap: the gradient under another load is not what the last step led to.
    #[test]
    fn a_step_teaches_unless_the_load_changed_since() {
        let mut memory = Memory::default();
        let step = memory.step(vec![4.0, -2.0], |_| true);
        assert_eq!(step, Some(vec![-4.0, 2.0]));
        memory.rest();
        assert!(memory.step(vec![1.0, 1.0], |_| true).is_some());
        assert_eq!(memory.pairs.len(), 0);
        // Twice as stiff as the base has it.
        assert_eq!(memory.step(vec![-1.0, -1.0], |_| true), Some(vec![0.5, 0.5]));
        assert_eq!(memory.pairs.len(), 1);
        assert_eq!(memory.step(vec![0.0; 2], |_| false), None);
    }
}

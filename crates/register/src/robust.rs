//! A loss under which far points count for nothing.

/// Tukey's biweight: of a residual r, c²/6 (1 − (1 − (r/c)²)³) up to c, and c²/6 beyond. Near 0 it
/// is r²/2.
///
/// Source: Beaton and Tukey, Technometrics 16, 1974.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tukey {
    /// Residual from which on a point counts for nothing, mm.
    pub reach_mm: f64,
}

impl Tukey {
    /// Loss, mm².
    pub fn loss(&self, residual: f64) -> f64 {
        let left = self.left(residual);
        self.reach_mm.powi(2) / 6.0 * (1.0 - left.powi(3))
    }

    /// Weight of the residual in least squares that are solved again and again: slope of the loss
    /// over r.
    pub fn weight(&self, residual: f64) -> f64 {
        self.left(residual).powi(2)
    }

    fn left(&self, residual: f64) -> f64 {
        (1.0 - (residual / self.reach_mm).powi(2)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_is_the_slope_of_the_loss_over_the_residual() {
        let loss = Tukey { reach_mm: 4.0 };
        for r in [0.1, 1.0, 2.5, 3.9, 5.0] {
            let slope = (loss.loss(r + 1e-6) - loss.loss(r - 1e-6)) / 2e-6;
            assert!((slope - r * loss.weight(r)).abs() < 1e-7, "{r}");
        }
    }
}

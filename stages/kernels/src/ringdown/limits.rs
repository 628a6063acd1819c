//! Bounds on shared parameters: an active set.

use faer::Mat;

use super::normal::Freedom;

/// Share of a box's width within which a value counts as on its edge: rounding of the sum that took it there.
const EDGE: f64 = 1e-10;

impl Freedom {
    /// Which of the estimated parameters sit on a bound: -1 on the lower, 1 on the upper, 0 on none.
    pub fn edges(&self, values: &[f64]) -> Vec<i8> {
        let edge = |&parameter: &usize| match self.limits.get(parameter).copied().flatten() {
            Some((least, most)) if values[parameter] <= least + EDGE * (most - least) => -1,
            Some((least, most)) if values[parameter] >= most - EDGE * (most - least) => 1,
            _ => 0,
        };
        self.shared.iter().map(edge).collect()
    }

    /// Takes parameters out of the normal equations that sit on a bound and want beyond it.
    ///
    /// Source: D. P. Bertsekas, SIAM J. Control Optim. 20 (1982) 221 (projected Newton methods).
    pub fn hold_pushed(&self, values: &[f64], information: &mut Mat<f64>, gradient: &mut [f64]) {
        for (k, edge) in self.edges(values).into_iter().enumerate() {
            if f64::from(edge) * gradient[k] > 0.0 {
                hold(information, k);
                gradient[k] = 0.0;
            }
        }
    }

    /// A step, cut where it leaves the box.
    pub fn cut(&self, values: &[f64], step: &mut [f64]) {
        for (step, &parameter) in step.iter_mut().zip(&self.shared) {
            if let Some((least, most)) = self.limits.get(parameter).copied().flatten() {
                *step = (values[parameter] + *step).clamp(least, most) - values[parameter];
            }
        }
    }
}

/// Empties a row and its column: the inverse has zeros there.
pub(super) fn hold(information: &mut Mat<f64>, k: usize) {
    for i in 0..information.nrows() {
        information[(i, k)] = 0.0;
        information[(k, i)] = 0.0;
    }
}

//! The secant estimate of the curvature that the Jacobian leaves out.

use faer::Mat;

use super::linearised::unscaled;

/// The part of the cost's curvature that the Jacobian does not hold, from the gradients along the way.
///
/// Where the residual is noise and a pole is hardly determined by it, this part is as large as the other, and steps
/// without it go astray.
/// Source: J. Dennis, D. Gay and R. Welsch, ACM Trans. Math. Softw. 7 (1981) 348 (NL2SOL), with `J^T J` at the new
/// point for its products.
#[derive(Clone)]
pub(crate) struct Secant {
    /// In coordinates.
    curvature: Mat<f64>,
    /// Whether it promised the last fall better than `J^T J` alone.
    pub trusted: bool,
}

/// Costs further apart than this are not of the same noise: one of them was rounding, say.
const ALIKE: f64 = 1e3;

impl Secant {
    pub fn new(q: usize) -> Self {
        Self { curvature: Mat::zeros(q, q), trusted: false }
    }

    /// In the scaled coordinates of a linearised problem.
    pub fn scaled(&self, scale: &[f64]) -> Mat<f64> {
        Mat::from_fn(scale.len(), scale.len(), |i, j| self.curvature[(i, j)] * scale[i] * scale[j])
    }

    /// The estimate for a cost that is so many times as large; zero where the two have nothing in common.
    pub fn rescale(&mut self, factor: f64) {
        if (1.0 / ALIKE..=ALIKE).contains(&factor) {
            self.curvature *= faer::Scale(factor);
        } else {
            *self = Self::new(self.curvature.nrows());
        }
    }

    /// Updates the curvature by a step (coordinates), the gradients before and after it (half the cost's), and
    /// `J^T J step` after it.
    fn update(&mut self, step: &[f64], before: &[f64], after: &[f64], normal: &[f64]) {
        let q = step.len();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let change: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
        let wanted: Vec<f64> = change.iter().zip(normal).map(|(y, n)| y - n).collect();
        let along = dot(&change, step);
        let upwards = along > 1e-12 * (dot(&change, &change) * dot(step, step)).sqrt();
        if !upwards {
            return;
        }
        let held: Vec<f64> = (0..q).map(|i| (0..q).map(|j| self.curvature[(i, j)] * step[j]).sum()).collect();
        let own = dot(&held, step).abs();
        let size = if own > 0.0 { (dot(&wanted, step).abs() / own).min(1.0) } else { 1.0 };
        let miss: Vec<f64> = wanted.iter().zip(&held).map(|(w, h)| w - size * h).collect();
        let rest = dot(&miss, step) / (along * along);
        for i in 0..q {
            for j in 0..q {
                let outer = (miss[i] * change[j] + change[i] * miss[j]) / along - rest * change[i] * change[j];
                self.curvature[(i, j)] = size * self.curvature[(i, j)] + outer;
            }
        }
    }
}

/// A step that was taken, and the gradient before it.
pub(super) struct Taken {
    pub step: Vec<f64>,
    pub gradient: Vec<f64>,
}

impl Taken {
    /// Updates the secant estimate by the gradient after the step.
    pub fn update(&self, secant: &mut Secant, scale: &[f64], gradient: &[f64], normal: &Mat<f64>) {
        let q = self.step.len();
        let scaled: Vec<f64> = self.step.iter().zip(scale).map(|(d, s)| if *s > 0.0 { d / s } else { 0.0 }).collect();
        let product: Vec<f64> = (0..q).map(|i| (0..q).map(|j| normal[(i, j)] * scaled[j]).sum()).collect();
        secant.update(&self.step, &self.gradient, &unscaled(gradient, scale), &unscaled(&product, scale));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_secant_is_right_along_the_last_step_and_symmetric() {
        // Hessian [2 1; 1 3], of which J^T J is the diagonal
        let hessian = [[2.0, 1.0], [1.0, 3.0]];
        let mut secant = Secant::new(2);
        for step in [[0.1, 0.0], [0.05, -0.2], [-0.1, 0.1]] {
            let times = |rows: [[f64; 2]; 2]| rows.map(|row| row[0] * step[0] + row[1] * step[1]);
            let (change, normal) = (times(hessian), times([[2.0, 0.0], [0.0, 3.0]]));
            let before = [0.3, -0.1];
            let after = [before[0] + change[0], before[1] + change[1]];
            secant.update(&step, &before, &after, &normal);
            let c = &secant.curvature;
            for i in 0..2 {
                let held = c[(i, 0)] * step[0] + c[(i, 1)] * step[1];
                assert!((held - (change[i] - normal[i])).abs() < 1e-14); // rounding
            }
            assert!((c[(0, 1)] - c[(1, 0)]).abs() < 1e-14);
        }
        // negative curvature is not taken up: the step's change says nothing of a minimum
        let earlier = secant.clone();
        secant.update(&[0.1, 0.0], &[0.0, 0.0], &[-0.2, 0.0], &[0.1, 0.0]);
        assert_eq!(secant.curvature, earlier.curvature);
    }

    #[test]
    fn the_estimate_goes_on_in_proportion_or_not_at_all() {
        let (step, before, after, normal) = ([0.1, 0.05], [0.3, -0.1], [0.52, 0.1], [0.2, 0.15]);
        let mut own = Secant::new(2);
        own.update(&step, &before, &after, &normal);
        // the same in units half as large: all of the cost is four times as large
        let four = |x: [f64; 2]| x.map(|x| 4.0 * x);
        let mut other = Secant::new(2);
        other.update(&step, &four(before), &four(after), &four(normal));
        let mut carried = own.clone();
        carried.rescale(4.0);
        for (i, j) in [(0, 0), (0, 1), (1, 1)] {
            assert!((carried.curvature[(i, j)] - other.curvature[(i, j)]).abs() < 1e-14); // rounding
        }
        // from an exact fit, whose cost is rounding, to a real one: as it stands, the old curvature would rule every
        // step
        for factor in [1e20, 0.0, f64::INFINITY, f64::NAN] {
            let mut carried = own.clone();
            carried.trusted = true;
            carried.rescale(factor);
            assert!(carried.curvature == Mat::<f64>::zeros(2, 2) && !carried.trusted);
        }
    }
}

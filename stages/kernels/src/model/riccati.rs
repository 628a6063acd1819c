//! The stationary Kalman gain.

use crate::linear_algebra::{NoConvergence, product, solve};
use faer::Mat;

use super::error::ModelError;

/// Gain K of the stationary one-step predictor and the variance of its innovations.
///
/// # Model
/// `x+ = A x + w`, `y = C x + v`, `E w w^T = Q`, `E v^2 = r > 0`, A stable.
/// # Method
/// Structure-preserving doubling of the discrete Riccati equation; each step squares the closed loop, so some fifteen
/// suffice.
/// # Shapes
/// A, Q: n x n; C: n.
/// # Units
/// r and the result's second part: those of y squared.
/// # Accuracy
/// 1e-14 relative for predictors that forget within 10^6 samples. A - K C is stable.
/// # Errors
/// No convergence in 60 doublings, or values that are not finite.
/// # Source
/// E. Chu, H. Fan, W. Lin, C. Wang, Int. J. Control 77 (2004) 767.
pub(crate) fn kalman_gain(a: &Mat<f64>, c: &[f64], q: &Mat<f64>, r: f64) -> Result<(Vec<f64>, f64), ModelError> {
    let n = a.nrows();
    let mut f = a.transpose().to_owned();
    let mut g = Mat::from_fn(n, n, |i, j| c[i] * c[j] / r);
    let mut p = q.clone();
    for _ in 0..60 {
        let gp = product(g.as_ref(), p.as_ref());
        let w = Mat::from_fn(n, n, |i, j| gp[(i, j)] + if i == j { 1.0 } else { 0.0 });
        let (wf, wg) = (solve(w.clone(), &f), solve(w, &g));
        let more = product(product(f.transpose(), p.as_ref()).as_ref(), wf.as_ref());
        let g_more = product(product(f.as_ref(), wg.as_ref()).as_ref(), f.transpose());
        f = product(f.as_ref(), wf.as_ref());
        p = symmetric(&(p + &more));
        g = symmetric(&(g + g_more));
        let (change, level) = (more.norm_l2(), p.norm_l2());
        if !level.is_finite() {
            return Err(ModelError::Degenerate("the Riccati equation has no finite solution"));
        }
        if change <= 1e-15 * level {
            let pc: Vec<f64> = (0..n).map(|i| (0..n).map(|j| p[(i, j)] * c[j]).sum()).collect();
            let innovation = r + pc.iter().zip(c).map(|(p, c)| p * c).sum::<f64>();
            let gain = (0..n).map(|i| (0..n).map(|j| a[(i, j)] * pc[j]).sum::<f64>() / innovation).collect();
            return Ok((gain, innovation));
        }
    }
    Err(NoConvergence("Riccati doubling").into())
}

fn symmetric(m: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| 0.5 * (m[(i, j)] + m[(j, i)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear_algebra::eigenvalues;

    #[test]
    fn a_random_walk_in_noise_has_the_textbook_gain() {
        // p = p + q - p^2 / (p + r) with a = 1, q = r = 1: p = (1 + sqrt 5) / 2, k = p / (p + 1)
        let (a, q) = (Mat::from_fn(1, 1, |_, _| 1.0 - 1e-12), Mat::from_fn(1, 1, |_, _| 1.0));
        let (k, innovation) = kalman_gain(&a, &[1.0], &q, 1.0).unwrap();
        let p = 0.5 * (1.0 + 5.0_f64.sqrt());
        // a differs from one by 1e-12
        assert!((k[0] - p / (p + 1.0)).abs() < 1e-11 && (innovation - p - 1.0).abs() < 1e-11);
    }

    #[test]
    fn the_gain_solves_the_equation_and_stabilises() {
        // a resonance of Q = 500 at a hundredth of the sample rate, driven weakly
        let (r, w) = (0.99994_f64, 0.0628_f64);
        let a = Mat::from_fn(2, 2, |i, j| [[2.0 * r * w.cos(), 1.0], [-r * r, 0.0]][i][j]);
        let q = Mat::from_fn(2, 2, |i, j| if (i, j) == (1, 1) { 1e-6 } else { 0.0 });
        let (k, _) = kalman_gain(&a, &[1.0, 0.0], &q, 1.0).unwrap();
        let closed = Mat::from_fn(2, 2, |i, j| a[(i, j)] - if j == 0 { k[i] } else { 0.0 });
        let radius = eigenvalues(&closed).unwrap()[0].norm();
        assert!(radius < r && radius > 0.9, "{radius}");
        // slow twin: the Riccati recursion itself
        let mut p = q.clone();
        let mut gain = [0.0; 2];
        for _ in 0..200_000 {
            let innovation = 1.0 + p[(0, 0)];
            let ap = product(a.as_ref(), p.as_ref());
            gain = [ap[(0, 0)] / innovation, ap[(1, 0)] / innovation];
            let apa = product(ap.as_ref(), a.transpose());
            p = Mat::from_fn(2, 2, |i, j| apa[(i, j)] + q[(i, j)] - gain[i] * gain[j] * innovation);
        }
        // the recursion's own rounding over 1e5 steps
        assert!((gain[0] - k[0]).abs() < 1e-9 && (gain[1] - k[1]).abs() < 1e-9, "{gain:?} {k:?}");
    }
}

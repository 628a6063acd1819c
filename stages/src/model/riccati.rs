//! The stationary Kalman gain.

use faer::Mat;

use super::error::ModelError;
use super::orthogonal::{product, solve};

/// Gain K of the stationary one-step predictor and the variance of its innovations.
///
/// # Model
/// `x+ = A x + w`, `y = C x + v`, `E w w^T = Q`, `E v^2 = r > 0`, A stable.
/// # Method
/// Structure-preserving doubling of the discrete Riccati equation; each step squares the closed loop, so some fifteen suffice.
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
    Err(ModelError::Decomposition("Riccati doubling"))
}

fn symmetric(m: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| 0.5 * (m[(i, j)] + m[(j, i)]))
}

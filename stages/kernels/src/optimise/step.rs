//! Damped steps of a local model.

use faer::Mat;

use crate::linear_algebra::{Svd, symmetric_inverse};

/// `(F + damping diag F)^-1 g`, and that inverse; a direction without information is held.
///
/// Shapes: `information` F n x n, symmetric; `gradient` g n.
pub fn damped_step(information: &Mat<f64>, gradient: &[f64], damping: f64) -> (Vec<f64>, Mat<f64>) {
    let n = gradient.len();
    let mut damped = information.clone();
    (0..n).for_each(|i| damped[(i, i)] *= 1.0 + damping);
    let inverse = symmetric_inverse(&damped);
    let step = (0..n).map(|i| (0..n).map(|j| inverse[(i, j)] * gradient[j]).sum()).collect();
    (step, inverse)
}

/// The same step from the singular values of a Jacobian with columns of unit length: `V (s^2 + damping s_1^2)^-1 s
/// along`, in units of those columns; directions with less than `tolerance` of the largest value are held.
///
/// Shapes: `along` the residual along each left vector.
pub fn damped_svd_step(svd: &Svd, along: &[f64], damping: f64, tolerance: f64) -> Vec<f64> {
    let most = svd.s.first().copied().unwrap_or(0.0);
    let rank = svd.rank(tolerance);
    let part: Vec<f64> =
        (0..rank).map(|k| along[k] * svd.s[k] / (svd.s[k] * svd.s[k] + damping * most * most)).collect();
    (0..svd.v.nrows()).map(|i| part.iter().enumerate().map(|(k, p)| svd.v[(i, k)] * p).sum()).collect()
}

/// A step no coordinate of which is longer than `longest`.
pub fn shortened(mut step: Vec<f64>, longest: f64) -> Vec<f64> {
    let found = step.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if found > longest {
        step.iter_mut().for_each(|x| *x *= longest / found);
    }
    step
}

//! Separable least squares: everything that enters the prediction error linearly is eliminated exactly.
//!
//! Golub and Pereyra's variable projection with Kaufman's Jacobian: b, D, x0, offset and slope are solved for by one QR at every trial of
//! the poles (a) and predictor poles (c), which alone are left to iterate on.

use faer::{Mat, MatMut};

use super::predictor::Problem;
use crate::model::error::ModelError;
use crate::model::orthogonal::{Svd, product};
use crate::model::tall::TallQr;

/// Singular values of the column-scaled regressors below this share of the largest count as zero: some 100 roundings.
const RANK_TOLERANCE: f64 = 1e-13;

/// The least-squares solution at fixed poles and predictor poles.
pub(crate) struct Projection {
    qr: TallQr,
    /// Basis of the fitted space within the rotated regressors: columns x rank.
    fitted: Mat<f64>,
    /// Solution, unscaled.
    pub theta: Vec<f64>,
    /// `sum e^2`.
    pub cost: f64,
    /// The residual in rotated coordinates: the first columns + 1 entries, the rest is zero.
    rotated: Vec<f64>,
}

impl Projection {
    /// Solves for all linear parameters; the last column of `regressors` is the filtered output. Errors: no finite solution.
    pub fn new(problem: &Problem, regressors: &Mat<f64>) -> Result<Self, ModelError> {
        let p = regressors.ncols() - 1;
        let qr = if problem.missing.is_empty() {
            TallQr::new(regressors.as_ref())
        } else {
            let mut matrix = regressors.clone();
            problem.mask(&mut matrix);
            TallQr::new(matrix.as_ref())
        };
        let r = qr.r();
        // columns of the triangle are as long as those of the matrix
        let mut scale = vec![1.0; p];
        let mut scaled = Mat::zeros(p, p);
        for (j, scale) in scale.iter_mut().enumerate() {
            let norm = r.col(j).norm_l2();
            if !norm.is_finite() {
                return Err(ModelError::Degenerate("a filtered regressor overflows"));
            }
            if norm > 0.0 {
                *scale = norm;
            }
            (0..=j).for_each(|i| scaled[(i, j)] = r[(i, j)] / *scale);
        }
        let svd = Svd::new(&scaled)?;
        let rank = svd.rank(RANK_TOLERANCE);
        let fitted = svd.u.as_ref().get(.., ..rank).to_owned();
        let top: Vec<f64> = (0..p).map(|i| r[(i, p)]).collect();
        let along: Vec<f64> = (0..rank).map(|k| (0..p).map(|i| fitted[(i, k)] * top[i]).sum()).collect();
        let theta = (0..p)
            .map(|j| (0..rank).map(|k| svd.v[(j, k)] * along[k] / svd.s[k]).sum::<f64>() / scale[j])
            .collect::<Vec<f64>>();
        let mut rotated: Vec<f64> =
            (0..p).map(|i| top[i] - (0..rank).map(|k| fitted[(i, k)] * along[k]).sum::<f64>()).collect();
        rotated.push(r[(p, p)]);
        let cost = rotated.iter().map(|value| value * value).sum::<f64>();
        if !cost.is_finite() || theta.iter().any(|value| !value.is_finite()) {
            return Err(ModelError::Degenerate("the linear parameters are not finite"));
        }
        Ok(Self { qr, fitted, theta, cost, rotated })
    }

    /// Rotates `jacobian` as the residual is and removes the directions that the linear parameters reach.
    ///
    /// Returns the rows where the residual has entries; the others stay in `jacobian`.
    pub fn project(&self, jacobian: MatMut<'_, f64>) -> Mat<f64> {
        let mut head = self.qr.apply_transpose(jacobian);
        let p = self.fitted.nrows();
        let along = product(self.fitted.transpose(), head.as_ref().get(..p, ..));
        let removed = product(self.fitted.as_ref(), along.as_ref());
        for j in 0..removed.ncols() {
            (0..p).for_each(|i| head[(i, j)] -= removed[(i, j)]);
        }
        head
    }

    /// Entry `row` of the residual in rotated coordinates.
    pub fn rotated(&self, row: usize) -> f64 {
        self.rotated.get(row).copied().unwrap_or(0.0)
    }
}

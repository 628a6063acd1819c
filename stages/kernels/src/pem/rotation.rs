//! Least squares by orthogonal rotations: exact to rounding whatever the condition.

use crate::linear_algebra::{Svd, TallQr, product};
use faer::{Mat, MatMut, MatRef};

use super::projection::{Sensitivities, Solution};
use crate::model::ModelError;

/// Singular values of the column-scaled regressors below this share of the largest count as zero: some 100 roundings.
const RANK_TOLERANCE: f64 = 1e-13;

/// QR of the regressors, and what the linear parameters reach of it.
pub(super) struct Rotation {
    qr: TallQr,
    /// Basis of the fitted space within the rotated regressors: columns x rank.
    fitted: Mat<f64>,
    /// The residual in rotated coordinates: the first columns + 1 entries, the rest is zero.
    rotated: Vec<f64>,
}

impl Rotation {
    /// Solves for all linear parameters; the last column of `matrix` is the filtered output. Errors: no finite
    /// solution.
    pub fn new(matrix: MatRef<'_, f64>) -> Result<(Self, Solution), ModelError> {
        let p = matrix.ncols() - 1;
        let qr = TallQr::new(matrix);
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
        Ok((Self { qr, fitted, rotated }, Solution { theta, cost }))
    }

    /// The Jacobian without the directions that the linear parameters reach.
    pub fn sensitivities(&self, mut jacobian: Mat<f64>) -> Sensitivities {
        let head = self.project(jacobian.as_mut());
        let rest = TallQr::triangle(jacobian.as_ref());
        let (depth, q) = head.shape();
        let rows = Mat::from_fn(depth + q, q, |i, j| if i < depth { head[(i, j)] } else { rest[(i - depth, j)] });
        let mut residual = self.rotated.clone();
        residual.resize(depth + q, 0.0);
        Sensitivities { rows, residual }
    }

    /// Rotates `jacobian` as the residual is and removes the directions that the linear parameters reach.
    ///
    /// Returns the rows where the residual has entries; the others stay in `jacobian`.
    fn project(&self, jacobian: MatMut<'_, f64>) -> Mat<f64> {
        let mut head = self.qr.apply_transpose(jacobian);
        let p = self.fitted.nrows();
        let along = product(self.fitted.transpose(), head.as_ref().get(..p, ..));
        let removed = product(self.fitted.as_ref(), along.as_ref());
        for j in 0..removed.ncols() {
            (0..p).for_each(|i| head[(i, j)] -= removed[(i, j)]);
        }
        head
    }
}

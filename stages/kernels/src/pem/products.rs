//! Least squares by inner products, refined once and checked: a third of the operations of a rotation.
//!
//! Method: Cholesky factor of the scaled Gram matrix; the solution corrected by the residual's own products with the
//! regressors (corrected seminormal equations). What the correction finds is the check: where rounding has left a share
//! of the residual in the space that the regressors span, nothing here is used. Source: A. Bjorck, Linear Algebra Appl.
//! 88/89 (1987) 31.

use crate::linear_algebra::Symmetric;
use faer::Mat;

use super::jacobian::residual;
use super::projection::{Sensitivities, Solution};
use crate::linear_algebra::{cross_of, gram_of};

/// Least energy that a regressor of unit length keeps beside those before it: the correction then leaves less than a
/// hundred-thousandth of itself.
const LEAST_PIVOT: f64 = 1e-10;
/// Most energy that the first solution may leave along the regressors, as a share of the residual's.
const MOST_LEFT: f64 = 1e-4;
/// Least energy that a sensitivity must keep beside the regressors, over its own and over the least pivot: ten thousand
/// roundings.
const LEAST_KEPT: f64 = 1e-12;

/// Cholesky factor of the regressors' products.
pub(super) struct Products {
    /// Of the scaled Gram matrix; lower.
    lower: Mat<f64>,
    /// What brings each regressor to unit length.
    scale: Vec<f64>,
    least_pivot: f64,
}

impl Products {
    /// Solves for all linear parameters; the last of `columns` is the filtered output. None: too ill-conditioned for
    /// products.
    pub fn new(columns: &[&[f64]]) -> Option<(Self, Solution)> {
        let p = columns.len() - 1;
        let products = gram_of(columns);
        // a regressor of zeros gets no weight
        let inverse = |norm: f64| if norm > 0.0 { norm.recip() } else { 0.0 };
        let scale: Vec<f64> = (0..p).map(|j| inverse(products[(j, j)].sqrt())).collect();
        let scaled = |i: usize, j: usize| match products[(i, j)] * scale[i] * scale[j] {
            _ if i == j => 1.0,
            product if i > j => product,
            _ => 0.0,
        };
        let (lower, least_pivot) = factor(Mat::from_fn(p, p, scaled))?;
        let own = Self { lower, scale, least_pivot };
        let mut theta = own.solved((0..p).map(|i| products[(i, p)]).collect()).0;
        let errors = residual(columns, &theta);
        let after = cross_of(&columns[..p], &[&errors]);
        let (correction, left) = own.solved((0..p).map(|i| after[(i, 0)]).collect());
        let energy = cross_of(&[&errors], &[&errors])[(0, 0)];
        // not so either where something is not finite
        let little = left <= MOST_LEFT * energy;
        if !little {
            return None;
        }
        theta.iter_mut().zip(&correction).for_each(|(t, c)| *t += c);
        Some((own, Solution { theta, cost: energy - left }))
    }

    /// `(X^T X)^-1 b` and `b^T (X^T X)^-1 b` for products b of the regressors X.
    fn solved(&self, mut b: Vec<f64>) -> (Vec<f64>, f64) {
        let p = b.len();
        b.iter_mut().zip(&self.scale).for_each(|(b, s)| *b *= s);
        self.forward(&mut b);
        let energy = b.iter().map(|b| b * b).sum();
        for i in (0..p).rev() {
            let known: f64 = (i + 1..p).map(|k| self.lower[(k, i)] * b[k]).sum();
            b[i] = (b[i] - known) / self.lower[(i, i)];
        }
        b.iter_mut().zip(&self.scale).for_each(|(b, s)| *b *= s);
        (b, energy)
    }

    fn forward(&self, b: &mut [f64]) {
        for k in 0..b.len() {
            let value = b[k] / self.lower[(k, k)];
            b[k] = value;
            (k + 1..b.len()).for_each(|i| b[i] -= self.lower[(i, k)] * value);
        }
    }

    /// The Jacobian without the directions that the linear parameters reach. None: too little of it is left for
    /// products.
    pub fn sensitivities(&self, regressors: &[&[f64]], e: &[f64], jacobian: &[&[f64]]) -> Option<Sensitivities> {
        let (p, q) = (self.scale.len(), jacobian.len());
        let shared = cross_of(&regressors[..p], jacobian);
        let whole = gram_of(jacobian);
        let gradient = cross_of(jacobian, &[e]);
        let along: Vec<Vec<f64>> = (0..q)
            .map(|j| {
                let mut own: Vec<f64> = (0..p).map(|i| shared[(i, j)] * self.scale[i]).collect();
                self.forward(&mut own);
                own
            })
            .collect();
        let rest = |i: usize, j: usize| whole[(i, j)] - along[i].iter().zip(&along[j]).map(|(x, y)| x * y).sum::<f64>();
        let mut scale = vec![0.0; q];
        for (j, scale) in scale.iter_mut().enumerate() {
            let (own, left) = (whole[(j, j)], rest(j, j));
            if own > 0.0 {
                let enough = left * self.least_pivot >= LEAST_KEPT * own;
                if !enough {
                    return None;
                }
                *scale = left.sqrt().recip();
            }
        }
        let axes = Symmetric::new(&Mat::from_fn(q, q, |i, j| rest(i, j) * scale[i] * scale[j])).ok()?;
        // a square root of the products, and the residual in its frame
        let lengths: Vec<f64> = axes.values.iter().map(|value| value.max(0.0).sqrt()).collect();
        let unscaled = |j: usize| if scale[j] > 0.0 { scale[j].recip() } else { 0.0 };
        let rows = Mat::from_fn(q, q, |k, j| lengths[k] * axes.vectors[(j, k)] * unscaled(j));
        let floor = FLAT * lengths.last().copied().unwrap_or(0.0);
        let residual = (0..q)
            .map(|k| {
                let along: f64 = (0..q).map(|j| axes.vectors[(j, k)] * scale[j] * gradient[(j, 0)]).sum();
                if lengths[k] > floor { along / lengths[k] } else { 0.0 }
            })
            .collect();
        Some(Sensitivities { rows, residual })
    }
}

/// Length of a direction of the scaled sensitivities that is rounding of products, over the longest.
const FLAT: f64 = 1e-7;

/// Lower Cholesky factor and its least pivot. None: one is too small.
fn factor(mut matrix: Mat<f64>) -> Option<(Mat<f64>, f64)> {
    let n = matrix.nrows();
    let mut least = 1.0_f64;
    for k in 0..n {
        let pivot = matrix[(k, k)];
        let clear = pivot >= LEAST_PIVOT;
        if !clear {
            return None;
        }
        least = least.min(pivot);
        let inverse = pivot.sqrt().recip();
        matrix.col_mut(k).iter_mut().skip(k).for_each(|x| *x *= inverse);
        let (done, mut rest) = matrix.as_mut().split_at_col_mut(k + 1);
        let own = done.as_ref().col(k);
        for j in k + 1..n {
            let weight = own[j];
            let target = rest.as_mut().col_mut(j - k - 1).iter_mut().skip(j);
            target.zip(own.iter().skip(j)).for_each(|(x, l)| *x -= weight * l);
        }
    }
    Some((matrix, least))
}

#[cfg(test)]
mod tests {
    use super::super::rotation::Rotation;
    use super::*;
    use crate::fixture::white_noise;
    use crate::linear_algebra::product;

    fn columns(matrix: &Mat<f64>) -> Vec<&[f64]> {
        matrix.col_iter().map(|column| column.try_as_col_major().unwrap().as_slice()).collect()
    }

    /// Columns that are alike up to `apart`, and an output that they explain up to a hundredth.
    fn regressors(apart: f64) -> Mat<f64> {
        let (rows, columns) = (500, 6);
        let values = white_noise(rows * (columns + 1), 1.0, 1);
        let noise = |i: usize, j: usize| values[i + j * rows];
        let column = |i: usize, j: usize| {
            10.0_f64.powi(j as i32) * (noise(i, 0) + if j > 0 { apart * noise(i, j) } else { 0.0 })
        };
        Mat::from_fn(rows, columns + 1, |i, j| {
            if j < columns { column(i, j) } else { column(i, 1) + 0.01 * noise(i, columns) }
        })
    }

    #[test]
    fn products_give_what_rotations_give() {
        let values = white_noise(500 * 4, 1.0, 2);
        for apart in [1.0, 1e-2, 1e-4] {
            let matrix = regressors(apart);
            // sensitivities that partly lie along the regressors
            let jacobian = Mat::from_fn(500, 4, |i, j| values[i + j * 500] + matrix[(i, j)] / 10.0_f64.powi(j as i32));
            let (products, ours) = Products::new(&columns(&matrix)).unwrap();
            let (rotation, exact) = Rotation::new(matrix.as_ref()).unwrap();
            assert!((ours.cost / exact.cost - 1.0).abs() < 1e-12); // rounding of 500 squares
            let (e, slow) = (residual(&columns(&matrix), &ours.theta), residual(&columns(&matrix), &exact.theta));
            // both to the condition's share of a residual of 0.2
            let apart_by = e.iter().zip(&slow).map(|(e, slow)| (e - slow) * (e - slow)).sum::<f64>().sqrt();
            assert!(apart_by < 1e-10 / apart, "{apart}");
            let ours = products.sensitivities(&columns(&matrix), &e, &columns(&jacobian)).unwrap();
            let exact = rotation.sensitivities(jacobian.clone());
            let square = |s: &Sensitivities| product(s.rows.transpose(), s.rows.as_ref());
            let gradient = |s: &Sensitivities, j: usize| -> f64 {
                s.rows.col(j).iter().zip(&s.residual).map(|(x, e)| x * e).sum()
            };
            let (a, b) = (square(&ours), square(&exact));
            let length = |j: usize| jacobian.col(j).norm_l2();
            for j in 0..4 {
                // the squared condition, 1 / apart^2, times rounding of what the products sum
                let tolerance = 1e-13 / (apart * apart) * length(j);
                assert!((gradient(&ours, j) - gradient(&exact, j)).abs() < tolerance, "{apart} {j}");
                (0..4).for_each(|i| assert!((a[(i, j)] - b[(i, j)]).abs() < tolerance * length(i), "{apart} {i} {j}"));
            }
        }
    }

    #[test]
    fn what_products_cannot_resolve_is_left_to_rotations() {
        assert!(Products::new(&columns(&regressors(1e-6))).is_none());
        // an output that is explained to rounding
        let mut matrix = regressors(1.0);
        let copy = matrix.col(2).to_owned();
        matrix.col_mut(6).copy_from(&copy);
        assert!(
            Products::new(&columns(&matrix)).is_none_or(|(_, solution)| solution.cost < 1e-24 * copy.squared_norm_l2())
        );
        // a sensitivity that is a regressor but for a billionth
        let matrix = regressors(1e-2);
        let (products, solution) = Products::new(&columns(&matrix)).unwrap();
        let e = residual(&columns(&matrix), &solution.theta);
        let jacobian = Mat::from_fn(500, 1, |i, _| matrix[(i, 1)] + 1e-9 * e[i]);
        assert!(products.sensitivities(&columns(&matrix), &e, &columns(&jacobian)).is_none());
        // an input of zeros has no weight, not a number or a refusal
        let mut matrix = regressors(1.0);
        matrix.col_mut(3).iter_mut().for_each(|x| *x = 0.0);
        let (_, solution) = Products::new(&columns(&matrix)).unwrap();
        assert!(solution.theta[3] == 0.0 && solution.theta.iter().all(|t| t.is_finite()));
        let mut matrix = regressors(1.0);
        matrix[(7, 0)] = f64::INFINITY;
        assert!(Products::new(&columns(&matrix)).is_none());
    }
}

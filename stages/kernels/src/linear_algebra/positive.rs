//! Symmetric positive matrices: factor, inverse.

use faer::Mat;

/// Lower Cholesky factor of a symmetric positive semidefinite matrix: a direction with less than `1e-14` of its own
/// variance left is rounding and gets `1e-7` of its scale.
pub fn cholesky(matrix: &Mat<f64>) -> Mat<f64> {
    let n = matrix.nrows();
    let mut lower = Mat::<f64>::zeros(n, n);
    for j in 0..n {
        let left = matrix[(j, j)] - (0..j).map(|k| lower[(j, k)].powi(2)).sum::<f64>();
        if left <= 1e-14 * matrix[(j, j)] {
            lower[(j, j)] = 1e-7 * matrix[(j, j)].max(f64::MIN_POSITIVE).sqrt();
            continue;
        }
        lower[(j, j)] = left.sqrt();
        for i in j + 1..n {
            let rest = matrix[(i, j)] - (0..j).map(|k| lower[(i, k)] * lower[(j, k)]).sum::<f64>();
            lower[(i, j)] = rest / lower[(j, j)];
        }
    }
    lower
}

/// Inverse of a symmetric positive definite matrix by Cholesky, scaled to a unit diagonal first; a direction without
/// information (a pivot below `1e-15`) is held: it gets a pivot of one.
pub fn symmetric_inverse(matrix: &Mat<f64>) -> Mat<f64> {
    let factor = ScaledFactor::of(matrix);
    factor.inverse()
}

/// As [`symmetric_inverse`]; none for a matrix that is not definite: a pivot below `1e-13`, a value that is not finite.
pub fn definite_inverse(matrix: &Mat<f64>) -> Option<Mat<f64>> {
    let factor = ScaledFactor::of(matrix);
    (factor.least_pivot > 1e-13).then(|| factor.inverse())
}

/// Lower Cholesky factor; none where a direction keeps less than the share `least_kept` of its variance beside those
/// before it, or a value is not finite.
pub(crate) fn clear_factor(matrix: &Mat<f64>, least_kept: f64) -> Option<Mat<f64>> {
    let ScaledFactor { scale, lower, least_pivot } = ScaledFactor::of(matrix);
    let n = scale.len();
    let entry = |i: usize, j: usize| if j <= i { lower[i * n + j] / scale[i] } else { 0.0 };
    (least_pivot >= least_kept).then(|| Mat::from_fn(n, n, entry))
}

/// `L L^T = S M S` with the diagonal scale `S` that makes `M`'s diagonal one.
struct ScaledFactor {
    scale: Vec<f64>,
    /// By rows.
    lower: Vec<f64>,
    /// Least square of a diagonal element before it was replaced; NaN where one is not finite.
    least_pivot: f64,
}

impl ScaledFactor {
    fn of(matrix: &Mat<f64>) -> Self {
        let n = matrix.nrows();
        let scale: Vec<f64> =
            (0..n).map(|i| if matrix[(i, i)] > 0.0 { matrix[(i, i)].sqrt().recip() } else { 0.0 }).collect();
        let mut lower = vec![0.0; n * n];
        let mut least_pivot = f64::INFINITY;
        for i in 0..n {
            for j in 0..=i {
                let known: f64 = (0..j).map(|k| lower[i * n + k] * lower[j * n + k]).sum();
                let left = scale[i] * matrix[(i, j)] * scale[j] - known;
                if i == j {
                    least_pivot = if left.is_finite() { left.min(least_pivot) } else { f64::NAN };
                }
                lower[i * n + j] = match i == j {
                    true if left > 1e-15 => left.sqrt(),
                    true => 1.0,
                    false => left / lower[j * n + j],
                };
            }
        }
        Self { scale, lower, least_pivot }
    }

    fn inverse(&self) -> Mat<f64> {
        let (n, lower, scale) = (self.scale.len(), &self.lower, &self.scale);
        // columns of the factor's inverse, then their products
        let mut inverse = vec![0.0; n * n];
        for j in 0..n {
            inverse[j * n + j] = 1.0 / lower[j * n + j];
            for i in j + 1..n {
                let known: f64 = (j..i).map(|k| lower[i * n + k] * inverse[k * n + j]).sum();
                inverse[i * n + j] = -known / lower[i * n + i];
            }
        }
        Mat::from_fn(n, n, |i, j| {
            let sum: f64 = (i.max(j)..n).map(|k| inverse[k * n + i] * inverse[k * n + j]).sum();
            scale[i] * sum * scale[j]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear_algebra::product;

    /// Positive definite, of very different scales.
    fn matrix() -> Mat<f64> {
        let root =
            Mat::from_fn(4, 4, |i, j| 10f64.powi(3 * i as i32) * (if i == j { 2.0 } else { 0.3 / (1 + i + j) as f64 }));
        product(root.as_ref(), root.transpose())
    }

    #[test]
    fn the_inverse_of_a_badly_scaled_matrix_is_right_to_rounding() {
        let m = matrix();
        for inverse in [symmetric_inverse(&m), definite_inverse(&m).expect("definite")] {
            let one = product(m.as_ref(), inverse.as_ref());
            for i in 0..4 {
                for j in 0..4 {
                    let scale = (m[(i, i)] / m[(j, j)]).sqrt();
                    let wanted = if i == j { 1.0 } else { 0.0 };
                    assert!((one[(i, j)] - wanted).abs() < 1e-13 * scale.max(1.0), "{i} {j} {}", one[(i, j)]); // rounding
                }
            }
        }
    }

    #[test]
    fn a_direction_without_information_is_held_or_refused() {
        let m = Mat::from_fn(3, 3, |i, j| if i == j && i < 2 { 4.0 } else { 0.0 });
        let inverse = symmetric_inverse(&m);
        assert_eq!((inverse[(0, 0)], inverse[(1, 1)], inverse[(2, 2)]), (0.25, 0.25, 0.0));
        assert!(definite_inverse(&m).is_none());
        let equal = Mat::from_fn(2, 2, |_, _| 3.0);
        assert!(definite_inverse(&equal).is_none());
        assert!(definite_inverse(&Mat::from_fn(2, 2, |i, j| if i == j { f64::NAN } else { 0.0 })).is_none());
        assert!(definite_inverse(&Mat::from_fn(1, 1, |_, _| -1.0)).is_none());
    }

    #[test]
    fn the_factors_reproduce_their_matrix() {
        let m = matrix();
        for lower in [cholesky(&m), clear_factor(&m, 1e-3).expect("clear")] {
            let again = product(lower.as_ref(), lower.transpose());
            for i in 0..4 {
                for j in 0..4 {
                    assert!((again[(i, j)] - m[(i, j)]).abs() <= 1e-14 * (m[(i, i)] * m[(j, j)]).sqrt()); // rounding
                }
            }
        }
        // of unit variances and a correlation of 0.8 a share of 0.36 is left
        let correlated = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 0.8 });
        assert!(clear_factor(&correlated, 0.35).is_some() && clear_factor(&correlated, 0.37).is_none());
    }
}

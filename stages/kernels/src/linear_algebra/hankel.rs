//! Products of the rows of Hankel matrices, by running sums: N operations per diagonal instead of N per entry.

use faer::Mat;

use super::dot::dot_in_lanes;
use super::orthogonal::{Svd, Symmetric, product};

/// `X Y^T` of the Hankel matrices of two signals of equal length, `rows` rows each: entry (i, j) is `sum_t x(t + i) y(t
/// + j)`.
pub fn hankel_products(x: &[f64], y: &[f64], rows: usize) -> Mat<f64> {
    let windows = x.len() - rows + 1;
    let mut out = Mat::zeros(rows, rows);
    let mut diagonal = |i: usize, j: usize| {
        let mut sum = dot_in_lanes(&x[i..i + windows], &y[j..j + windows]);
        for k in 0..rows - i.max(j) {
            out[(i + k, j + k)] = sum;
            if i.max(j) + k + 1 < rows {
                sum += x[windows + i + k] * y[windows + j + k] - x[i + k] * y[j + k];
            }
        }
    };
    (0..rows).for_each(|j| diagonal(0, j));
    (1..rows).for_each(|i| diagonal(i, 0));
    out
}

/// `Y 1`: the sums of a Hankel matrix's rows.
pub fn hankel_row_sums(y: &[f64], rows: usize) -> Vec<f64> {
    let windows = y.len() - rows + 1;
    let mut sum: f64 = y[..windows].iter().sum();
    let mut out = vec![sum];
    for j in 1..rows {
        sum += y[windows + j - 1] - y[j - 1];
        out.push(sum);
    }
    out
}

/// How many times its estimated rounding the weakest direction must be.
const CLEAR: f64 = 1e4;

/// Left singular vectors and singular values of the output's Hankel matrix without the row space of `[1; U]`, from
/// products alone.
///
/// `input`: eigenvectors of `[1; U] [1; U]^T` and how many count. None: the weakest singular value would be rounding,
/// or a decomposition fails.
pub fn remaining_row_space(u: &[f64], y: &[f64], rows: usize, input: (&Svd, usize)) -> Option<(Mat<f64>, Vec<f64>)> {
    let (axes, rank) = input;
    let (both, own, ones) = (hankel_products(u, y, rows), hankel_products(y, y, rows), hankel_row_sums(y, rows));
    let stacked = Mat::from_fn(rows + 1, rows, |i, j| if i == 0 { ones[j] } else { both[(i - 1, j)] });
    let mut along = product(axes.u.as_ref().get(.., ..rank).transpose(), stacked.as_ref());
    let trace: f64 = (0..rows).map(|i| own[(i, i)]).sum();
    let mut rounding = trace;
    for k in 0..rank {
        let norm = axes.s[k].sqrt();
        along.row_mut(k).iter_mut().for_each(|x| *x /= norm);
        // a weak direction's own length is known to fewer digits
        rounding += axes.s[0] / axes.s[k] * along.row(k).squared_norm_l2();
    }
    let rest = own - product(along.transpose(), along.as_ref());
    let Symmetric { values, vectors } = Symmetric::new(&rest).ok()?;
    let clear = values.first().is_some_and(|least| *least > CLEAR * f64::EPSILON * rounding);
    clear.then(|| {
        let last = rows - 1;
        (
            Mat::from_fn(rows, rows, |i, k| vectors[(i, last - k)]),
            values.iter().rev().map(|value| value.sqrt()).collect(),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_running_sums_equal_the_products() {
        let (x, y, windows) = (white_noise(300, 1.0, 9), white_noise(300, 1.0, 10), 281);
        let (fast, line) = (hankel_products(&x, &y, 20), hankel_row_sums(&y, 20));
        for i in 0..20 {
            for j in 0..20 {
                let slow: f64 = (0..windows).map(|t| x[t + i] * y[t + j]).sum();
                assert!((fast[(i, j)] - slow).abs() < 1e-11); // 300 roundings of order one
            }
            let slow: f64 = y[i..i + windows].iter().sum();
            assert!((line[i] - slow).abs() < 1e-11);
        }
    }
}

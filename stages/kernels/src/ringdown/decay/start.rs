//! Poles of a decay from its Hankel matrix, to start a search with.

use crate::linear_algebra::{dot_in_lanes, eigenvalues, product, solve};
use faer::{Mat, c64};

use crate::model::ModelError;

/// Poles `z` of a decaying record by shift invariance of the `order` strongest directions of its Hankel matrix, rows'
/// means removed.
///
/// # Method
/// Gram matrix of the rows from `rows` products and running differences; its dominant space by orthogonal iteration,
/// which the gap between signal and noise makes short.
/// # Source
/// S. Y. Kung, Proc. 12th Asilomar Conf. (1978) 705; orthogonal iteration: G. H. Golub and C. F. Van Loan, Matrix
/// Computations, 4th ed., 8.2.4.
pub(super) fn hankel_poles(values: &[f64], rows: usize, order: usize) -> Result<Vec<c64>, ModelError> {
    poles_of_gram(&centred_gram(values, rows, dot_in_lanes), order)
}

/// The same from the sum of the Gram matrices of several records.
pub(in crate::ringdown) fn poles_of_gram(gram: &Mat<f64>, order: usize) -> Result<Vec<c64>, ModelError> {
    let space = dominant_space(gram, order);
    let rows = gram.nrows();
    let upper = space.as_ref().get(..rows - 1, ..);
    let lower = space.as_ref().get(1.., ..);
    // columns are orthonormal: the normal equations are as well conditioned as the problem
    Ok(eigenvalues(&solve(product(upper.transpose(), upper), &product(upper.transpose(), lower)))?)
}

/// `H H^T` with each row's mean removed; row i of H begins at sample i.
pub(in crate::ringdown) fn centred_gram(values: &[f64], rows: usize, dot: fn(&[f64], &[f64]) -> f64) -> Mat<f64> {
    let windows = values.len() - rows + 1;
    let mut sums = vec![values[..windows].iter().sum::<f64>()];
    for i in 1..rows {
        sums.push(sums[i - 1] + values[windows + i - 1] - values[i - 1]);
    }
    let mut gram = Mat::zeros(rows, rows);
    for lag in 0..rows {
        let mut sum = dot(&values[..windows], &values[lag..lag + windows]);
        for i in 0..rows - lag {
            let centred = sum - sums[i] * sums[i + lag] / windows as f64;
            gram[(i, i + lag)] = centred;
            gram[(i + lag, i)] = centred;
            if i + lag + 1 < rows {
                sum += values[windows + i] * values[windows + i + lag] - values[i] * values[i + lag];
            }
        }
    }
    gram
}

/// Most rounds of the iteration; each shrinks what is wrong by the ratio of noise to signal.
const ROUNDS: usize = 30;
/// Share of the captured energy that a round may still move: starts need no more.
const SETTLED: f64 = 1e-6;

/// Orthonormal columns near the strongest `order` directions.
fn dominant_space(gram: &Mat<f64>, order: usize) -> Mat<f64> {
    let rows = gram.nrows();
    // any start that is not orthogonal to the space will do: cosines of rising frequency, and a ramp that breaks their
    // symmetry
    let mut space = Mat::from_fn(rows, order.min(rows), |i, j| {
        let x = (i as f64 + 0.5) / rows as f64;
        (std::f64::consts::PI * j as f64 * x).cos() + 0.1 * x
    });
    let mut last = 0.0;
    for _ in 0..ROUNDS {
        space = product(gram.as_ref(), space.as_ref());
        let weakest = orthonormalise(&mut space);
        if (weakest - last).abs() <= SETTLED * weakest {
            break;
        }
        last = weakest;
    }
    space
}

/// Gram-Schmidt, each column twice, in place; returns the shortest remainder.
fn orthonormalise(matrix: &mut Mat<f64>) -> f64 {
    let mut shortest = f64::INFINITY;
    for j in 0..matrix.ncols() {
        let (done, rest) = matrix.as_mut().split_at_col_mut(j);
        let mut column: Vec<f64> = rest.as_ref().col(0).iter().copied().collect();
        let before = dot_in_lanes(&column, &column).sqrt();
        let mut length = before;
        for _ in 0..2 {
            for q in done.as_ref().col_iter() {
                let q = q.try_as_col_major().map_or(&[][..], |q| q.as_slice());
                let share = dot_in_lanes(q, &column);
                column.iter_mut().zip(q).for_each(|(c, q)| *c -= share * q);
            }
            length = dot_in_lanes(&column, &column).sqrt();
        }
        shortest = shortest.min(length);
        let factor = if length > f64::EPSILON * before { length.recip() } else { 0.0 };
        rest.col_mut(0).iter_mut().zip(&column).for_each(|(target, c)| *target = c * factor);
    }
    shortest
}

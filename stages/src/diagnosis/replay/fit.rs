//! Weights of columns by least squares.

/// Smallest pivot of columns of length one: below, they depend on one another.
const PIVOT: f64 = 1e-9;

/// Fits `values` where `seen` by `columns`, each scaled to length one; none where the columns depend on one another.
///
/// Method: normal equations by Cholesky, every sum in order: the same bits on any number of threads. Steps of a fit
/// need no more digits.
pub(super) fn least_squares(columns: &[&[f64]], values: &[f64], seen: &[bool]) -> Option<Vec<f64>> {
    let n = columns.len();
    let product =
        |a: &[f64], b: &[f64]| a.iter().zip(b).zip(seen).map(|((a, b), s)| if *s { a * b } else { 0.0 }).sum::<f64>();
    let norms: Vec<f64> = columns.iter().map(|column| product(column, column).sqrt()).collect();
    if norms.iter().any(|norm| !norm.is_finite() || *norm <= 0.0) {
        return None;
    }
    let mut factor = vec![vec![0.0; n]; n];
    let mut weights: Vec<f64> = columns.iter().zip(&norms).map(|(c, norm)| product(c, values) / norm).collect();
    for i in 0..n {
        for j in 0..=i {
            let inner: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
            let rest = product(columns[i], columns[j]) / (norms[i] * norms[j]) - inner;
            if i == j && (rest.is_nan() || rest < PIVOT) {
                return None;
            }
            factor[i][j] = if i == j { rest.sqrt() } else { rest / factor[j][j] };
        }
        let inner: f64 = (0..i).map(|k| factor[i][k] * weights[k]).sum();
        weights[i] = (weights[i] - inner) / factor[i][i];
    }
    for i in (0..n).rev() {
        let inner: f64 = (i + 1..n).map(|k| factor[k][i] * weights[k]).sum();
        weights[i] = (weights[i] - inner) / factor[i][i];
    }
    weights.iter_mut().zip(&norms).for_each(|(w, norm)| *w /= norm);
    weights.iter().all(|w| w.is_finite()).then_some(weights)
}

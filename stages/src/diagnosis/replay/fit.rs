//! Weights of columns by least squares.

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;

/// Fits `values` where `seen` by `columns`, each scaled to length one; none where the columns depend on one another.
pub(super) fn least_squares(columns: &[&[f64]], values: &[f64], seen: &[bool]) -> Option<Vec<f64>> {
    let rows: Vec<usize> = (0..values.len()).filter(|&k| seen[k]).collect();
    if rows.len() < 2 * columns.len() {
        return None;
    }
    let norm = |column: &[f64]| rows.iter().map(|&k| column[k] * column[k]).sum::<f64>().sqrt();
    let norms: Vec<f64> = columns.iter().map(|column| norm(column)).collect();
    if norms.iter().any(|norm| !(norm.is_finite() && *norm > 0.0)) {
        return None;
    }
    let matrix = Mat::from_fn(rows.len(), columns.len(), |i, j| columns[j][rows[i]] / norms[j]);
    let right = Mat::from_fn(rows.len(), 1, |i, _| values[rows[i]]);
    let qr = matrix.qr();
    // the smallest pivot of columns of length one: below, rounding decides
    if (0..columns.len()).any(|j| qr.thin_R()[(j, j)].abs() < 1e-9) {
        return None;
    }
    let solved = qr.solve_lstsq(&right);
    let weights: Vec<f64> = norms.iter().enumerate().map(|(j, norm)| solved[(j, 0)] / norm).collect();
    weights.iter().all(|w| w.is_finite()).then_some(weights)
}

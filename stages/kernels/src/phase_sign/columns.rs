//! Complex least squares of a few columns.

use faer::c64;

/// Share of a column's norm that must be left once the ones before it are taken off.
const LEAST_SHARE: f64 = 1e-9;

/// Inner product, the first one conjugated.
pub(super) fn inner(a: &[c64], b: &[c64]) -> c64 {
    a.iter().zip(b).map(|(a, b)| a.conj() * b).sum()
}

/// Sum of squares.
pub(super) fn power(values: &[c64]) -> f64 {
    values.iter().map(c64::norm_sqr).sum()
}

fn take_off(values: &mut [c64], direction: &[c64], amount: c64) {
    values.iter_mut().zip(direction).for_each(|(value, q)| *value -= amount * q);
}

/// Coefficients of the columns and what they leave of the right-hand side; by Gram-Schmidt, twice over. None where the
/// columns depend on each other.
pub(super) fn least_squares(columns: &[Vec<c64>], rhs: &[c64]) -> Option<(Vec<c64>, Vec<c64>)> {
    let count = columns.len();
    let mut basis: Vec<Vec<c64>> = Vec::with_capacity(count);
    let mut triangle = vec![vec![c64::new(0.0, 0.0); count]; count];
    for (j, column) in columns.iter().enumerate() {
        let mut left = column.clone();
        let norm = power(column).sqrt();
        for _ in 0..2 {
            for (i, direction) in basis.iter().enumerate() {
                let amount = inner(direction, &left);
                triangle[i][j] += amount;
                take_off(&mut left, direction, amount);
            }
        }
        let rest = power(&left).sqrt();
        // not a number either
        if rest.is_nan() || rest <= LEAST_SHARE * norm {
            return None;
        }
        triangle[j][j] = c64::new(rest, 0.0);
        left.iter_mut().for_each(|value| *value /= rest);
        basis.push(left);
    }
    let mut residual = rhs.to_vec();
    let mut coefficients = Vec::with_capacity(count);
    for direction in &basis {
        let amount = inner(direction, &residual);
        take_off(&mut residual, direction, amount);
        coefficients.push(amount);
    }
    for j in (0..count).rev() {
        let above: c64 = (j + 1..count).map(|k| triangle[j][k] * coefficients[k]).sum();
        coefficients[j] = (coefficients[j] - above) / triangle[j][j];
    }
    Some((coefficients, residual))
}

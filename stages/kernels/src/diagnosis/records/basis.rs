//! Orthonormal columns that are projected out.

use crate::linear_algebra::dot;

/// Orthonormal columns of equal length.
///
/// # Method
/// Modified Gram-Schmidt, twice ("twice is enough": L. Giraud et al., Numer. Math. 101 (2005) 87). A column that the
/// ones before it explain to `1e-9` of its length is left out.
#[derive(Debug, Clone, Default)]
pub(super) struct Basis {
    columns: Vec<Vec<f64>>,
}

impl Basis {
    /// Adds a column; says whether it brought a direction of its own.
    pub fn push(&mut self, mut column: Vec<f64>) -> bool {
        let before = norm(&column);
        self.remove(&mut column);
        self.remove(&mut column);
        let left = norm(&column);
        if left.is_nan() || left <= 1e-9 * before || left == 0.0 {
            return false;
        }
        column.iter_mut().for_each(|value| *value /= left);
        self.columns.push(column);
        true
    }

    /// Takes everything out of `column` that the basis explains.
    pub fn remove(&self, column: &mut [f64]) {
        for own in &self.columns {
            let share = dot(own, column);
            column.iter_mut().zip(own).for_each(|(value, o)| *value -= share * o);
        }
    }

    /// What is left of a column.
    pub fn residual(&self, column: &[f64]) -> Vec<f64> {
        let mut column = column.to_vec();
        self.remove(&mut column);
        column
    }
}

/// Polynomials of `x` up to `degree`, orthonormal on these points. Legendre polynomials of `x` scaled to -1..1 keep the
/// columns well conditioned.
pub(super) fn polynomials(x: &[f64], degree: usize) -> Basis {
    let mut basis = Basis::default();
    for d in 0..=degree {
        basis.push(legendre(x, span(x), d));
    }
    basis
}

/// Smallest and largest value; 0..0 of nothing.
pub(super) fn span(x: &[f64]) -> (f64, f64) {
    let low = x.iter().copied().fold(f64::INFINITY, f64::min);
    let high = x.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if low <= high { (low, high) } else { (0.0, 0.0) }
}

/// The Legendre polynomial of that degree in `x`, scaled so that `span` is -1..1 (Bonnet's recursion).
pub(super) fn legendre(x: &[f64], span: (f64, f64), degree: usize) -> Vec<f64> {
    let (middle, half) = (0.5 * (span.0 + span.1), (0.5 * (span.1 - span.0)).max(f64::MIN_POSITIVE));
    let at = |x: f64| {
        let u = (x - middle) / half;
        let (mut before, mut now) = (0.0, 1.0);
        for n in 0..degree {
            let n = n as f64;
            (before, now) = (now, ((2.0 * n + 1.0) * u * now - n * before) / (n + 1.0));
        }
        now
    };
    x.iter().map(|&x| at(x)).collect()
}

pub(super) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_their_degree_are_removed_and_higher_ones_are_not() {
        let x: Vec<f64> = (0..100).map(|k| 3e-7 + 1e-9 * f64::from(k)).collect();
        let cubic: Vec<f64> = x.iter().map(|x| 2.0 - 1e7 * x + 1e20 * x.powi(3)).collect();
        assert!(norm(&polynomials(&x, 3).residual(&cubic)) < 1e-12 * norm(&cubic));
        assert!(norm(&polynomials(&x, 2).residual(&cubic)) > 1e-6 * norm(&cubic));
        // P3(1) = 1, P3(-1) = -1
        let third = legendre(&[-1.0, 1.0], (-1.0, 1.0), 3);
        assert!((third[0] + 1.0).abs() < 1e-15 && (third[1] - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_column_already_there_is_refused() {
        let mut basis = Basis::default();
        assert!(basis.push(vec![1.0, 1.0]) && !basis.push(vec![3.0, 3.0]) && basis.push(vec![1.0, 0.0]));
        assert!(!basis.push(vec![0.0, 5.0]));
        assert!(!basis.push(vec![f64::NAN, 5.0]));
    }
}

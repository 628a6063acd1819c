//! Real partial fractions: two columns for a pair of poles, one for a real one.

use faer::{Mat, c64};

/// Poles in the order of the columns: pairs by their upper pole, then what is real.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Poles(pub Vec<c64>);

impl Poles {
    /// From all roots of a real polynomial: of a pair the upper one is kept.
    pub fn new(roots: &[c64]) -> Self {
        Self(roots.iter().filter(|z| z.im >= 0.0).copied().collect())
    }

    /// Every pole, pairs in full.
    pub fn all(&self) -> Vec<c64> {
        self.0.iter().flat_map(|&p| if p.im > 0.0 { vec![p, p.conj()] } else { vec![p] }).collect()
    }

    /// Reflected into the unit circle: `1 / conj(p)`.
    pub fn reflected(&self) -> Self {
        Self(self.0.iter().map(|&p| if p.norm() > 1.0 { p / p.norm_sqr() } else { p }).collect())
    }

    /// The basis functions at z, one per pole: `1/(z-p) + 1/(z-p*)` and `i/(z-p) - i/(z-p*)`, or `1/(z-p)`.
    pub fn values(&self, z: c64) -> Vec<c64> {
        let i = c64::new(0.0, 1.0);
        let both = |p: c64| {
            let (upper, lower) = ((z - p).inv(), (z - p.conj()).inv());
            vec![upper + lower, i * (upper - lower)]
        };
        self.0.iter().flat_map(|&p| if p.im > 0.0 { both(p) } else { vec![(z - p).inv()] }).collect()
    }

    /// `A - b c^T / d` of the realisation with these poles: its eigenvalues are the zeros of `sum c phi + d` (Gustavsen
    /// and Semlyen 1999, Eq. B.2).
    pub fn zero_matrix(&self, c: &[f64], d: f64) -> Mat<f64> {
        let n = c.len();
        let mut a = Mat::zeros(n, n);
        let mut row = 0;
        for p in &self.0 {
            a[(row, row)] = p.re;
            let gain = if p.im > 0.0 { 2.0 } else { 1.0 };
            (0..n).for_each(|j| a[(row, j)] -= gain * c[j] / d);
            if p.im > 0.0 {
                a[(row, row + 1)] += p.im;
                a[(row + 1, row)] -= p.im;
                a[(row + 1, row + 1)] += p.re;
                row += 1;
            }
            row += 1;
        }
        a
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear_algebra::eigenvalues;

    #[test]
    fn the_sum_vanishes_at_the_eigenvalues() {
        let poles = Poles(vec![c64::new(0.7, 0.6), c64::new(0.3, 0.0), c64::new(-0.2, 0.9)]);
        let (c, d) = ([0.4, -0.3, 0.2, 0.1, 0.5], 1.3);
        for zero in eigenvalues(&poles.zero_matrix(&c, d)).unwrap() {
            let sum: c64 = poles.values(zero).iter().zip(c).map(|(phi, c)| phi * c).sum();
            assert!((sum + d).norm() < 1e-12, "{zero}"); // rounding
        }
        assert_eq!((poles.all().len(), Poles::new(&poles.all())), (5, poles));
    }
}

//! Small complex least squares: a few columns, some tens of rows, thousands of times.

use rustfft::num_complex::Complex64;

/// Factored columns `C = Q R`; dependent columns are left out.
pub(super) struct Factored {
    /// Orthonormal columns, one per kept column.
    q: Vec<Vec<Complex64>>,
    /// Coefficients of column `j` on the kept columns before it, its norm last.
    r: Vec<Vec<Complex64>>,
    /// For each kept column its number.
    kept: Vec<usize>,
    columns: usize,
}

/// A column counts as dependent when less than this share of it lies outside the columns before.
const DEPENDENT: f64 = 1e-9;

impl Factored {
    /// Gram-Schmidt, twice per column, in the order given: the columns that matter most come first.
    pub fn new(columns: &[Vec<Complex64>]) -> Self {
        let mut f = Self { q: Vec::new(), r: Vec::new(), kept: Vec::new(), columns: columns.len() };
        for (number, column) in columns.iter().enumerate() {
            let size = norm(column);
            let mut v = column.clone();
            let mut above = vec![Complex64::new(0.0, 0.0); f.q.len()];
            for _ in 0..2 {
                for (q, c) in f.q.iter().zip(&mut above) {
                    let share = inner(q, &v);
                    *c += share;
                    v.iter_mut().zip(q).for_each(|(v, q)| *v -= share * q);
                }
            }
            let rest = norm(&v);
            if rest > DEPENDENT * size {
                v.iter_mut().for_each(|v| *v /= rest);
                above.push(Complex64::new(rest, 0.0));
                f.q.push(v);
                f.r.push(above);
                f.kept.push(number);
            }
        }
        f
    }

    /// Coefficients that minimise `|C x - b|`; zero for columns that were left out.
    pub fn solve(&self, b: &[Complex64]) -> Vec<Complex64> {
        let mut right: Vec<Complex64> = self.q.iter().map(|q| inner(q, b)).collect();
        let mut x = vec![Complex64::new(0.0, 0.0); self.columns];
        for j in (0..self.kept.len()).rev() {
            let value = right[j] / self.r[j][j];
            x[self.kept[j]] = value;
            for (r, c) in right.iter_mut().zip(&self.r[j]).take(j) {
                *r -= value * c;
            }
        }
        x
    }

    /// Variance of `gradient . x` when every row of `b` has variance one: `gradient (C^H C)^-1 gradient^H`.
    pub fn variance(&self, gradient: &[Complex64]) -> f64 {
        // R^T z = gradient, forward
        let mut z: Vec<Complex64> = Vec::with_capacity(self.kept.len());
        for (j, &number) in self.kept.iter().enumerate() {
            let above: Complex64 = z.iter().zip(&self.r[j]).map(|(z, r)| z * r).sum();
            z.push((gradient[number] - above) / self.r[j][j]);
        }
        z.iter().map(|z| z.norm_sqr()).sum()
    }

    /// Number of independent columns.
    pub fn rank(&self) -> usize {
        self.kept.len()
    }
}

fn inner(a: &[Complex64], b: &[Complex64]) -> Complex64 {
    a.iter().zip(b).map(|(a, b)| a.conj() * b).sum()
}

fn norm(a: &[Complex64]) -> f64 {
    a.iter().map(|a| a.norm_sqr()).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    fn random(n: usize, seed: u64) -> Vec<Complex64> {
        white_noise(2 * n, 1.0, seed).chunks(2).map(|c| Complex64::new(c[0], c[1])).collect()
    }

    #[test]
    fn coefficients_are_recovered_and_dependent_columns_dropped() {
        let mut columns = vec![random(20, 1), random(20, 2), random(20, 3)];
        let truth = [Complex64::new(1.0, 2.0), Complex64::new(-0.5, 0.0), Complex64::new(0.0, 3.0)];
        let b: Vec<Complex64> = (0..20).map(|i| (0..3).map(|j| columns[j][i] * truth[j]).sum()).collect();
        for (x, t) in Factored::new(&columns).solve(&b).iter().zip(&truth) {
            assert!((x - t).norm() < 1e-13); // rounding
        }
        columns.push(columns[0].iter().zip(&columns[1]).map(|(a, b)| a + b).collect());
        let with_copy = Factored::new(&columns);
        assert_eq!(with_copy.rank(), 3);
        assert_eq!(with_copy.solve(&b)[3], Complex64::new(0.0, 0.0));
    }

    #[test]
    fn variance_matches_the_spread_of_the_solutions() {
        let columns = vec![random(15, 4), random(15, 5)];
        let f = Factored::new(&columns);
        let gradient = [Complex64::new(1.0, 0.5), Complex64::new(0.0, -2.0)];
        let trials = 3000;
        let spread = (0..trials)
            .map(|s| {
                let x = f.solve(&random(15, 100 + s));
                (x[0] * gradient[0] + x[1] * gradient[1]).norm_sqr() / 2.0 // real and imaginary parts of variance one
            })
            .sum::<f64>()
            / trials as f64;
        // exponential: 1 / sqrt(3000) = 1.8 %, four of them
        assert!((spread / f.variance(&gradient) - 1.0).abs() < 0.075);
    }
}

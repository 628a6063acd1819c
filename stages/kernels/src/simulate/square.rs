//! Small dense square matrices: product and exponential.

use std::ops::{Index, IndexMut};

/// A square matrix, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct Square {
    /// Rows and columns.
    pub size: usize,
    entries: Vec<f64>,
}

impl Square {
    /// All zero.
    pub fn zeros(size: usize) -> Self {
        Self { size, entries: vec![0.0; size * size] }
    }

    /// The identity.
    pub fn identity(size: usize) -> Self {
        let mut matrix = Self::zeros(size);
        for i in 0..size {
            matrix[(i, i)] = 1.0;
        }
        matrix
    }

    /// `self * other`; sizes must agree.
    pub fn times(&self, other: &Self) -> Self {
        let n = self.size;
        let mut product = Self::zeros(n);
        for i in 0..n {
            for k in 0..n {
                let factor = self[(i, k)];
                for j in 0..n {
                    product[(i, j)] += factor * other[(k, j)];
                }
            }
        }
        product
    }

    /// `self + other`, entry by entry.
    pub fn plus(&self, other: &Self) -> Self {
        let entries = self.entries.iter().zip(&other.entries).map(|(a, b)| a + b).collect();
        Self { size: self.size, entries }
    }

    /// `factor * self`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { size: self.size, entries: self.entries.iter().map(|a| factor * a).collect() }
    }

    /// The transpose.
    pub fn transposed(&self) -> Self {
        let mut matrix = Self::zeros(self.size);
        for i in 0..self.size {
            for j in 0..self.size {
                matrix[(j, i)] = self[(i, j)];
            }
        }
        matrix
    }

    /// The largest row sum of absolute values.
    pub fn norm(&self) -> f64 {
        self.entries.chunks(self.size.max(1)).map(|row| row.iter().map(|a| a.abs()).sum()).fold(0.0, f64::max)
    }

    /// `exp(self)`.
    ///
    /// # Method
    /// Scaling and squaring round a Taylor polynomial of degree 12 at a norm of at most 1/4.
    ///
    /// # Accuracy
    /// Truncation `0.25^13 / 13! = 2e-18`; each squaring can double the rounding error: about `1e-16` times the norm.
    pub fn exponential(&self) -> Self {
        let squarings = (4.0 * self.norm()).max(1.0).log2().ceil() as i32;
        let scaled = self.scaled(0.5f64.powi(squarings));
        let mut sum = Self::identity(self.size);
        for degree in (1..=12).rev() {
            sum = Self::identity(self.size).plus(&scaled.times(&sum).scaled(1.0 / f64::from(degree)));
        }
        for _ in 0..squarings {
            sum = sum.times(&sum);
        }
        sum
    }

    /// Lower triangular `L` with `L L^T = self` for a symmetric positive semidefinite matrix, row by row in order:
    /// a direction whose remaining variance is below `1e-14` of the largest is rounding and gets a zero column.
    pub fn semidefinite_cholesky(&self) -> Self {
        let n = self.size;
        let mut lower = Self::zeros(n);
        let floor = 1e-14 * (0..n).map(|i| self[(i, i)]).fold(0.0, f64::max);
        for j in 0..n {
            let left = self[(j, j)] - (0..j).map(|k| lower[(j, k)].powi(2)).sum::<f64>();
            if left <= floor {
                continue;
            }
            lower[(j, j)] = left.sqrt();
            for i in j + 1..n {
                let rest = self[(i, j)] - (0..j).map(|k| lower[(i, k)] * lower[(j, k)]).sum::<f64>();
                lower[(i, j)] = rest / lower[(j, j)];
            }
        }
        lower
    }
}

impl Index<(usize, usize)> for Square {
    type Output = f64;
    fn index(&self, (row, column): (usize, usize)) -> &f64 {
        &self.entries[row * self.size + column]
    }
}

impl IndexMut<(usize, usize)> for Square {
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut f64 {
        &mut self.entries[row * self.size + column]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_of_a_rotation_is_the_rotation() {
        for angle in [1e-3, 0.7, 12.0] {
            let mut generator = Square::zeros(2);
            generator[(0, 1)] = -angle;
            generator[(1, 0)] = angle;
            let rotation = generator.exponential();
            // 6 squarings at most: 2^6 * 1e-16
            assert!((rotation[(0, 0)] - angle.cos()).abs() < 1e-14, "{angle}");
            assert!((rotation[(1, 0)] - angle.sin()).abs() < 1e-14, "{angle}");
        }
    }

    #[test]
    fn semidefinite_cholesky_reproduces_a_singular_covariance() {
        let root = [[1.0, 0.0], [2.0, 0.0], [-1.0, 3.0]];
        let mut covariance = Square::zeros(3);
        for i in 0..3 {
            for j in 0..3 {
                covariance[(i, j)] = (0..2).map(|k| root[i][k] * root[j][k]).sum();
            }
        }
        let lower = covariance.semidefinite_cholesky();
        let again = lower.times(&lower.transposed());
        for i in 0..3 {
            for j in 0..3 {
                // entries up to 10, rounding
                assert!((again[(i, j)] - covariance[(i, j)]).abs() < 1e-13);
            }
        }
    }
}

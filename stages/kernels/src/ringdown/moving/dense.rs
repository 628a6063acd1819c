//! Small symmetric matrices by the thousand: normal equations that are damped, solved and inverted without memory of
//! their own for each step.

/// A square matrix, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Square {
    /// Rows and columns.
    pub size: usize,
    /// Entries, row by row.
    pub entries: Vec<f64>,
}

impl Square {
    /// Of zeros.
    pub fn zeros(size: usize) -> Self {
        Self { size, entries: vec![0.0; size * size] }
    }

    /// An entry.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.entries[i * self.size + j]
    }

    /// An entry, to be changed.
    pub fn at_mut(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.entries[i * self.size + j]
    }

    /// `v' M v`.
    pub fn quadratic(&self, v: &[f64]) -> f64 {
        let row = |i: usize| (0..self.size).map(|j| self.at(i, j) * v[j]).sum::<f64>();
        (0..self.size).map(|i| v[i] * row(i)).sum()
    }
}

/// Diagonal of the matrix relative to its own scale below which a direction counts as undetermined.
const SINGULAR: f64 = 1e-13;

/// Cholesky factor of a symmetric matrix scaled to a unit diagonal, and the scales.
pub struct Factor {
    lower: Square,
    scale: Vec<f64>,
}

impl Factor {
    /// Of `matrix + damping diag(matrix)`; none where it is not positive definite to rounding.
    pub fn of(matrix: &Square, damping: f64) -> Option<Self> {
        let n = matrix.size;
        let mut scale = Vec::with_capacity(n);
        for i in 0..n {
            let d = matrix.at(i, i);
            if !(d.is_finite() && d > 0.0) {
                return None;
            }
            scale.push(d.sqrt());
        }
        let mut lower = Square::zeros(n);
        for i in 0..n {
            for j in 0..=i {
                let mut sum = matrix.at(i, j) / (scale[i] * scale[j]);
                if i == j {
                    sum += damping;
                }
                for k in 0..j {
                    sum -= lower.at(i, k) * lower.at(j, k);
                }
                if i == j {
                    if sum.is_nan() || sum <= SINGULAR {
                        return None;
                    }
                    *lower.at_mut(i, i) = sum.sqrt();
                } else {
                    *lower.at_mut(i, j) = sum / lower.at(j, j);
                }
            }
        }
        Some(Self { lower, scale })
    }

    /// Solution for a right side.
    pub fn solve(&self, right: &[f64]) -> Vec<f64> {
        let n = self.scale.len();
        let mut x: Vec<f64> = right.iter().zip(&self.scale).map(|(b, s)| b / s).collect();
        for i in 0..n {
            for k in 0..i {
                x[i] -= self.lower.at(i, k) * x[k];
            }
            x[i] /= self.lower.at(i, i);
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                x[i] -= self.lower.at(k, i) * x[k];
            }
            x[i] /= self.lower.at(i, i);
        }
        x.iter().zip(&self.scale).map(|(v, s)| v / s).collect()
    }

    /// Inverse.
    pub fn inverse(&self) -> Square {
        let n = self.scale.len();
        let mut inverse = Square::zeros(n);
        for j in 0..n {
            let unit: Vec<f64> = (0..n).map(|i| if i == j { 1.0 } else { 0.0 }).collect();
            for (i, v) in self.solve(&unit).into_iter().enumerate() {
                *inverse.at_mut(i, j) = v;
            }
        }
        inverse
    }
}

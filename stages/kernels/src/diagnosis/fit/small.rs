//! Small symmetric systems.

/// Cholesky factor of a symmetric matrix plus `ridge` of its diagonal; a row whose pivot vanishes is left out (its
/// solution is 0).
pub(crate) struct Cholesky {
    lower: Vec<Vec<f64>>,
    scale: Vec<f64>,
}

/// Pivots of the matrix scaled to unit diagonal below this are rounding: a direction that the others already make.
const VANISHING: f64 = 1e-12;

impl Cholesky {
    /// Factors `matrix`, scaled to a unit diagonal.
    pub fn new(matrix: &[Vec<f64>], ridge: f64) -> Self {
        let n = matrix.len();
        let inverse_root = |i: usize| if matrix[i][i] > 0.0 { 1.0 / matrix[i][i].sqrt() } else { 0.0 };
        let scale: Vec<f64> = (0..n).map(inverse_root).collect();
        let mut lower = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in 0..=i {
                let known: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                let entry = matrix[i][j] * scale[i] * scale[j] + if i == j { ridge } else { 0.0 } - known;
                lower[i][j] = match (i == j, entry > VANISHING, lower[j][j] > 0.0) {
                    (true, true, _) => entry.sqrt(),
                    (false, _, true) => entry / lower[j][j],
                    _ => 0.0,
                };
            }
        }
        Self { lower, scale }
    }

    /// Solves for one right side.
    pub fn solve(&self, rhs: &[f64]) -> Vec<f64> {
        let n = rhs.len();
        let mut x: Vec<f64> = rhs.iter().zip(&self.scale).map(|(b, s)| b * s).collect();
        for i in 0..n {
            let known: f64 = (0..i).map(|k| self.lower[i][k] * x[k]).sum();
            x[i] = if self.lower[i][i] > 0.0 { (x[i] - known) / self.lower[i][i] } else { 0.0 };
        }
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| self.lower[k][i] * x[k]).sum();
            x[i] = if self.lower[i][i] > 0.0 { (x[i] - known) / self.lower[i][i] } else { 0.0 };
        }
        x.iter().zip(&self.scale).map(|(x, s)| x * s).collect()
    }

    /// The inverse.
    pub fn inverse(&self) -> Vec<Vec<f64>> {
        let n = self.scale.len();
        (0..n).map(|j| self.solve(&(0..n).map(|i| f64::from(u8::from(i == j))).collect::<Vec<f64>>())).collect()
    }
}

//! Sums over blocks of the training part: errors that hold for coloured residuals, and what a fit loses on what it has
//! not seen.

use super::linear_algebra::{Cholesky, dot};

/// Parts that take turns in being held out.
pub(super) const FOLDS: usize = 8;

/// How a stretch is cut into blocks of consecutive samples, the blocks dealt out to folds in turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Blocks {
    pub samples: usize,
    pub count: usize,
}

impl Blocks {
    /// Samples of block b.
    pub fn range(&self, b: usize) -> std::ops::Range<usize> {
        b * self.samples / self.count..(b + 1) * self.samples / self.count
    }
}

/// Sums of products of residuals and sensitivities, block by block.
pub(super) struct Moments {
    /// Sensitivities with one another.
    pub curvature: Vec<Vec<Vec<f64>>>,
    /// Sensitivities with the residuals.
    pub score: Vec<Vec<f64>>,
    /// Residuals with themselves.
    pub loss: Vec<f64>,
}

impl Moments {
    pub fn new(columns: &[Vec<f64>], residual: &[f64], blocks: &Blocks) -> Self {
        let mut moments = Self { curvature: Vec::new(), score: Vec::new(), loss: Vec::new() };
        for b in 0..blocks.count {
            let range = blocks.range(b);
            let parts: Vec<&[f64]> = columns.iter().map(|column| &column[range.clone()]).collect();
            let rest = &residual[range];
            let mut curvature = vec![vec![0.0; parts.len()]; parts.len()];
            for i in 0..parts.len() {
                for j in 0..=i {
                    curvature[i][j] = dot(parts[i], parts[j]);
                    curvature[j][i] = curvature[i][j];
                }
            }
            moments.curvature.push(curvature);
            moments.score.push(parts.iter().map(|part| dot(part, rest)).collect());
            moments.loss.push(dot(rest, rest));
        }
        moments
    }

    /// The curvature of all blocks that `wanted` names.
    pub fn total_curvature(&self, wanted: impl Fn(usize) -> bool) -> Vec<Vec<f64>> {
        let n = self.score.first().map_or(0, Vec::len);
        let mut total = vec![vec![0.0; n]; n];
        for (_, block) in self.curvature.iter().enumerate().filter(|(b, _)| wanted(*b)) {
            for (row, add) in total.iter_mut().zip(block) {
                row.iter_mut().zip(add).for_each(|(sum, value)| *sum += value);
            }
        }
        total
    }

    /// The score of all blocks that `wanted` names.
    pub fn total_score(&self, wanted: impl Fn(usize) -> bool) -> Vec<f64> {
        let mut total = vec![0.0; self.score.first().map_or(0, Vec::len)];
        for (_, block) in self.score.iter().enumerate().filter(|(b, _)| wanted(*b)) {
            total.iter_mut().zip(block).for_each(|(sum, value)| *sum += value);
        }
        total
    }

    /// Covariance of the estimates, sandwiched between curvatures: right under coloured residuals that forget within a
    /// block.
    ///
    /// Source: H. White, Econometrica 48 (1980) 817; K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) 13.
    pub fn sandwich(&self) -> Vec<Vec<f64>> {
        let (blocks, n) = (self.score.len() as f64, self.score.first().map_or(0, Vec::len));
        let bread = Cholesky::new(&self.total_curvature(|_| true), 0.0).inverse();
        let mean: Vec<f64> = self.total_score(|_| true).iter().map(|sum| sum / blocks).collect();
        let mut covariance = vec![vec![0.0; n]; n];
        for score in &self.score {
            let centred: Vec<f64> = score.iter().zip(&mean).map(|(s, m)| s - m).collect();
            let step: Vec<f64> = bread.iter().map(|row| dot(row, &centred)).collect();
            for (row, a) in covariance.iter_mut().zip(&step) {
                row.iter_mut().zip(&step).for_each(|(sum, b)| *sum += a * b);
            }
        }
        // the fit has taken n directions from the scores
        let factor = blocks / (blocks - n as f64).max(1.0);
        covariance.iter_mut().flatten().for_each(|value| *value *= factor);
        covariance
    }

    /// Loss of each block under the fit to the folds that the block is not in, to first order.
    ///
    /// Source: T. Hastie, R. Tibshirani, J. Friedman, The Elements of Statistical Learning, 2nd ed., 2009, section
    /// 7.10.
    pub fn held_out(&self, ridge: f64) -> Vec<f64> {
        let mut losses = self.loss.clone();
        for fold in 0..FOLDS {
            let seen = |b: usize| b % FOLDS != fold;
            let step = Cholesky::new(&self.total_curvature(seen), ridge).solve(&self.total_score(seen));
            for b in (0..losses.len()).filter(|b| !seen(*b)) {
                let bend: Vec<f64> = self.curvature[b].iter().map(|row| dot(row, &step)).collect();
                losses[b] += dot(&bend, &step) - 2.0 * dot(&step, &self.score[b]);
            }
        }
        losses
    }
}

/// Sum over its standard error of paired differences, block by block.
pub(super) fn paired(differences: &[f64]) -> f64 {
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let scatter: f64 = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    if scatter > 0.0 { mean * (n / scatter).sqrt() } else { 0.0 }
}

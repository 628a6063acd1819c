//! Sums over blocks of what is learnt from: errors that hold for coloured residuals, and what a fit loses on what it
//! has not seen.

use std::ops::Range;

use rayon::prelude::*;

use super::products::{dot, products, rows};
use super::small::Cholesky;
use crate::diagnosis::data::Layout;

/// Parts that take turns in being held out.
pub(crate) const FOLDS: usize = 8;
/// Stretches from which on whole stretches are held out instead of parts of them.
const WHOLE: usize = 4;

/// How stretches are cut into blocks of consecutive samples, all channels of a time together, and dealt out to folds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Blocks {
    /// By block: its places in the vector of all samples, channel by channel.
    pub places: Vec<Vec<Range<usize>>>,
    /// By block: the fold that it is held out with.
    fold: Vec<usize>,
}

impl Blocks {
    /// About `count` blocks of about equal length, at least one a stretch.
    pub fn new(layout: &Layout, count: usize) -> Self {
        let all = layout.all_samples().max(1);
        let (mut places, mut fold) = (Vec::new(), Vec::new());
        for e in 0..layout.stretches() {
            let samples = layout.samples(e);
            let own = (count * samples / all).clamp(1, samples.max(1));
            for b in 0..own {
                let (from, to) = (b * samples / own, (b + 1) * samples / own);
                places.push((0..layout.channels).map(|channel| layout.part(e, channel, from, to)).collect());
                fold.push(if layout.stretches() >= WHOLE { e } else { b } % FOLDS);
            }
        }
        Self { places, fold }
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.places.len()
    }

    /// Sum over block b of the products of two columns.
    pub fn dot(&self, b: usize, x: &[f64], y: &[f64]) -> f64 {
        self.places[b].iter().map(|range| dot(&x[range.clone()], &y[range.clone()])).sum()
    }
}

/// Sums of products of residuals and sensitivities, block by block.
pub(crate) struct Moments {
    /// Sensitivities with one another.
    pub curvature: Vec<Vec<Vec<f64>>>,
    /// Sensitivities with the residuals.
    pub score: Vec<Vec<f64>>,
    /// Residuals with themselves.
    pub loss: Vec<f64>,
    /// The fold that each is held out with.
    fold: Vec<usize>,
}

impl Moments {
    pub fn new(columns: &[Vec<f64>], residual: &[f64], blocks: &Blocks) -> Self {
        let n = columns.len();
        let together: Vec<&[f64]> = columns.iter().map(Vec::as_slice).chain([residual]).collect();
        let sums = |b: usize| {
            let mut curvature = rows(&products(&together, &blocks.places[b]));
            let mut score = curvature.pop().unwrap_or_default();
            let loss = score.pop().unwrap_or(0.0);
            curvature.iter_mut().for_each(|row| row.truncate(n));
            (curvature, score, loss)
        };
        let all: Vec<(Vec<Vec<f64>>, Vec<f64>, f64)> = (0..blocks.count()).into_par_iter().map(sums).collect();
        let mut moments =
            Self { curvature: Vec::new(), score: Vec::new(), loss: Vec::new(), fold: blocks.fold.clone() };
        for (curvature, score, loss) in all {
            moments.curvature.push(curvature);
            moments.score.push(score);
            moments.loss.push(loss);
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
            let seen = |b: usize| self.fold.get(b) != Some(&fold);
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
pub(crate) fn paired(differences: &[f64]) -> f64 {
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let scatter: f64 = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    if scatter > 0.0 { mean * (n / scatter).sqrt() } else { 0.0 }
}

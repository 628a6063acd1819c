//! What a motion and an input could still explain, whatever the cause.

use rayon::prelude::*;

use super::data::Bench;
use super::fit::{Blocks, Cholesky, Fit, Moments, dot, paired};
use super::library::library;

/// Share of a residual that something systematic makes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// Root mean square of the part that can be predicted on folds that were held out, over that of the rest.
    pub ratio: f64,
    /// The prediction's gain, block by block, over its standard error.
    pub significance: f64,
}

/// What is left that motion and input predict, over what the causes explain, as ratio of root mean squares, below which
/// names stand whatever the noise. Why 0.02: a wrong law of one parameter leaves a tenth and more of the effect that it
/// stands for; a right one of a real system some per cent, where noise is a ten-thousandth of the output.
const NEGLIGIBLE: f64 = 0.02;

/// Block-wise standard errors beyond which a misfit is one: one chance in six hundred.
const SIGNIFICANT: f64 = 3.0;

impl Misfit {
    /// From losses on what was held out, block by block, without and with what predicts.
    pub(super) fn between(without: &[f64], with: &[f64]) -> Self {
        let differences: Vec<f64> = without.iter().zip(with).map(|(a, b)| a - b).collect();
        let (gain, floor) = (differences.iter().sum::<f64>(), with.iter().sum::<f64>());
        let ratio = if gain > 0.0 && floor > 0.0 { (gain / floor).sqrt() } else { 0.0 };
        Self { ratio, significance: paired(&differences) }
    }

    /// Whether it is more than chance.
    pub fn is_significant(&self) -> bool {
        self.significance > SIGNIFICANT
    }

    /// Whether it is more than chance and more than is tolerated.
    pub fn is_systematic(&self, tolerated: f64) -> bool {
        self.ratio > tolerated && self.is_significant()
    }

    /// Whether what can still be predicted of a squared error of `left` counts, beside `explained`, what causes take of it:
    /// more than chance, more than is tolerated, and no trifle beside what is explained.
    pub(super) fn counts(&self, tolerated: f64, left: f64, explained: f64) -> bool {
        self.is_systematic(tolerated) && left * self.share() >= NEGLIGIBLE * NEGLIGIBLE * explained
    }

    /// Share of the squared residual.
    pub fn share(&self) -> f64 {
        let square = self.ratio * self.ratio;
        square / (1.0 + square)
    }
}

/// Of the Gram matrix scaled to a unit diagonal: the directions overlap, the small ones are noise.
pub(super) const RIDGE: f64 = 1e-6;

/// How much of a fit's residual a library of general terms predicts.
///
/// # Method
/// Regression, by folds of blocks, on what any smooth force or sensor would do to first order: all monomials up to
/// degree five of deflection and rate, their absolute values and signs, once as forces through the oscillator and once
/// directly; limited rates of what is seen; powers of the input; another course of the input between samples; curves of
/// the sensor; modes and a gain that change with time; slow polynomials in time and the residual's largest line. Noise
/// that does not depend on the motion cannot be predicted, so that no noise model is needed.
/// # Source
/// T. Hastie, R. Tibshirani, J. Friedman, The Elements of Statistical Learning, 2nd ed., 2009, section 7.10.
pub(super) fn misfit(bench: &Bench, fit: &Fit, blocks: &Blocks) -> Misfit {
    let moments = Moments::new(&general(bench, fit), &clean(bench, fit), blocks);
    let own = fit.moments(bench, blocks).held_out(0.0);
    let after = moments.held_out(RIDGE);
    Misfit::between(&own, &after)
}

/// What a fit's parameters and the library together leave of its residual: the nearest to pure noise that can be had
/// without a noise model.
pub(super) struct Floor {
    /// Sample by sample.
    pub residual: Vec<f64>,
    /// Its variance, the directions that were taken out counted.
    pub mean_square: f64,
}

impl Floor {
    pub fn new(bench: &Bench, fit: &Fit, blocks: &Blocks) -> Self {
        let columns = general(bench, fit);
        let mut residual = clean(bench, fit);
        let moments = Moments::new(&columns, &residual, blocks);
        let weights = Cholesky::new(&moments.total_curvature(|_| true), RIDGE).solve(&moments.total_score(|_| true));
        for (column, weight) in columns.iter().zip(&weights) {
            residual.iter_mut().zip(column).for_each(|(r, c)| *r -= weight * c);
        }
        let free = bench.count.saturating_sub(columns.len()).max(1);
        let mean_square = dot(&residual, &residual) / free as f64;
        Self { residual, mean_square }
    }
}

/// What a fit leaves, beyond what the stretches' own numbers can make.
pub(super) fn clean(bench: &Bench, fit: &Fit) -> Vec<f64> {
    let mut left = fit.residual.clone();
    fit.own.take_out(&mut left, &bench.layout);
    left
}

/// A fit's own sensitivities and the library's columns.
fn general(bench: &Bench, fit: &Fit) -> Vec<Vec<f64>> {
    let mut columns = fit.sensitivities.clone();
    let mut laws = library(bench, fit);
    laws.par_iter_mut().for_each(|law| {
        fit.own.take_out(&mut law.column, &bench.layout);
    });
    columns.extend(laws.into_iter().map(|law| law.column));
    columns
}

//! Covariance of the estimates, whatever the colour of the residual.
//!
//! `cov = J^+ Omega J^+T` with J the Jacobian to all parameters and Omega the autocovariance of the errors, diagonal in
//! frequency. Its spectrum is the residual's local mean over the share that the fit left of it: near a resonance the
//! fit absorbs a good part of the noise, and a residual taken at face value would promise too much.

use crate::linear_algebra::product;
use faer::Mat;

use super::tangent::{Tangent, Transform, periodogram, remaining};
use crate::linear_algebra::gram;
use crate::model::ModelError;

/// Bins averaged on each side, as a share of N: 33 bins at 8192 samples, which give a standard error to 9 %.
const SMOOTHING_SHARE: usize = 512;

/// How the residual enters the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResidualColour {
    /// The residual's own smoothed spectrum: honest also where the model left 1/f noise.
    Spectrum,
    /// White: the textbook formula.
    White,
}

/// Covariance of the parameters, one for each of the Jacobian's `columns` (rows of all experiments), e of the same
/// rows, split at `lengths`.
pub(crate) fn covariance(
    columns: &[&[f64]],
    e: &[f64],
    lengths: &[usize],
    colour: ResidualColour,
) -> Result<Mat<f64>, ModelError> {
    let tangent = Tangent::new(columns)?;
    let rank = tangent.spread.ncols();
    let mut meat = Mat::zeros(rank, rank);
    match colour {
        ResidualColour::White => {
            let variance = e.iter().map(|e| e * e).sum::<f64>() / (e.len() - rank) as f64;
            (0..rank).for_each(|k| meat[(k, k)] = variance);
        }
        ResidualColour::Spectrum => {
            let mut transform = Transform::default();
            let mut top = 0;
            for &length in lengths {
                let basis = tangent.transformed(top, length, &mut transform);
                let power = periodogram(&transform.of(&e[top..top + length]));
                let density = smoothed(&power, &remaining(basis.as_ref()), length);
                meat += coloured(basis, &density, length);
                top += length;
            }
        }
    }
    let half = product(tangent.spread.as_ref(), meat.as_ref());
    Ok(product(half.as_ref(), tangent.spread.transpose()))
}

/// `W^T Omega W` of one experiment, W the transformed basis and Omega of this density.
fn coloured(mut basis: Mat<f64>, density: &[f64], length: usize) -> Mat<f64> {
    // one-sided: all bins but the first and, for even N, the last stand for two
    let both = |bin: usize| if bin == 0 || 2 * bin == length { 1.0 } else { 2.0 };
    let weights: Vec<f64> = density.iter().enumerate().map(|(bin, density)| (both(bin) * density).sqrt()).collect();
    for direction in basis.col_iter_mut() {
        direction.iter_mut().enumerate().for_each(|(row, part)| *part *= weights[row / 2]);
    }
    gram(basis.as_ref())
}

/// Power of the errors by bin: local sums of the residual's over those of the remaining shares.
fn smoothed(power: &[f64], remaining: &[f64], length: usize) -> Vec<f64> {
    let reach = (length / SMOOTHING_SHARE).max(1);
    let bins = power.len();
    let sums = |values: &[f64]| {
        let mut sums = vec![0.0; bins + 1];
        values.iter().enumerate().for_each(|(i, value)| sums[i + 1] = sums[i] + value);
        sums
    };
    let (power, remaining) = (sums(power), sums(remaining));
    (0..bins)
        .map(|i| {
            let (low, high) = (i.saturating_sub(reach), (i + reach + 1).min(bins));
            // a stretch absorbed to nine tenths says too little of its own level: do not divide by less
            let left = (remaining[high] - remaining[low]).max(0.1 * (high - low) as f64);
            (power[high] - power[low]) / left
        })
        .collect()
}

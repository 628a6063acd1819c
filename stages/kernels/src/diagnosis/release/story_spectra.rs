//! Spectra of the mean residual before and after, against what noise leaves in a mean of so many events.

use crate::signal::RealTransform;
use rayon::prelude::*;
use rustfft::num_complex::Complex64;

use super::residuals::common;
use super::state::State;

/// One-sided power spectral densities of the mean residual, V^2/Hz.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanSpectra {
    /// Frequencies of the bins, Hz.
    pub frequency_hz: Vec<f64>,
    /// Of the linear model.
    pub before: Vec<f64>,
    /// Of the extended model.
    pub after: Vec<f64>,
    /// What the scatter of the events about their mean leaves in it.
    pub noise: Vec<f64>,
}

/// Bins on either side that the noise level is averaged over: it is smooth but near resonances, which are as wide.
const SIDE: usize = 4;

/// Spectra of the mean residual `before`, and of the residuals `after` of all events with the noise of their mean;
/// beside them the noise of one event, bin by bin.
///
/// # Method
/// Periodograms without a taper, since what decays from the release on has no edge at its end. With unit weights w of
/// the events and transforms X, `sum |X|^2 - |sum w X|^2` is n - 1 times the noise of `sum w X`; the mean's is an n-th
/// of that.
pub(super) fn mean_spectra(
    state: &State,
    before: &[f64],
    after: &[Vec<f64>],
    interval_s: f64,
) -> (MeanSpectra, Vec<f64>) {
    let count = after.len();
    let transforms: Vec<Vec<Complex64>> = after.par_iter().map(|values| transform(values)).collect();
    let scale = 2.0 * interval_s / before.len().max(1) as f64;
    let power = |values: &[f64]| -> Vec<f64> { transform(values).iter().map(|z| scale * z.norm_sqr()).collect() };
    let sum: Vec<f64> = power(&common(state, after));
    let all = |k: usize| transforms.iter().filter_map(|t| t.get(k)).map(|z| scale * z.norm_sqr()).sum::<f64>();
    let freedom = (count.saturating_sub(1) * count).max(1) as f64;
    let level: Vec<f64> = sum.iter().enumerate().map(|(k, common)| (all(k) - common).max(0.0) / freedom).collect();
    let resolution = 1.0 / (before.len().max(1) as f64 * interval_s);
    let spectra = MeanSpectra {
        frequency_hz: (0..sum.len()).map(|k| k as f64 * resolution).collect(),
        before: power(before),
        after: sum.iter().map(|p| p / count.max(1) as f64).collect(),
        noise: smoothed(&level),
    };
    (spectra, level.iter().map(|v| v * count as f64).collect())
}

pub(super) fn transform(values: &[f64]) -> Vec<Complex64> {
    RealTransform::new(values.len()).forward(values.iter().copied())
}

fn smoothed(values: &[f64]) -> Vec<f64> {
    (0..values.len())
        .map(|k| {
            let near = &values[k.saturating_sub(SIDE)..(k + SIDE + 1).min(values.len())];
            near.iter().sum::<f64>() / near.len() as f64
        })
        .collect()
}

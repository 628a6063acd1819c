//! Noise variances from what the events' fits leave.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::noise::RingdownNoise;
use crate::signal::{RealTransform, hann as raised_cosine};

/// Hann taper of unit mean square.
pub fn hann(samples: usize) -> Vec<f64> {
    let scale = (8.0f64 / 3.0).sqrt();
    raised_cosine(samples, 0.5).into_iter().map(|w| scale * w).collect()
}

/// [`autocorrelation`](crate::signal::autocorrelation) of [`hann`] in closed form: sums of cosines. Of three samples at
/// least.
pub(super) fn hann_autocorrelation(samples: usize) -> Vec<f64> {
    let n = samples as f64;
    let (first, second) = ((PI / n).sin().recip(), 0.5 * (TAU / n).sin().recip());
    let at = |lag: usize| {
        let (sin, cos) = (TAU * lag as f64 / n).sin_cos();
        (8.0 / 3.0) / (4.0 * n) * ((samples - lag) as f64 * (1.0 + 0.5 * cos) + sin * (first - second))
    };
    (0..samples).map(at).collect()
}

/// Expected tapered periodogram of each part of the noise at unit variance: parts x bins; `lag_weights`:
/// [`autocorrelation`](crate::signal::autocorrelation) of the taper, gaps cut out of it.
///
/// # Method
/// Exact for the finite window: the Fourier transform of autocovariance times the taper's autocorrelation, folded to N.
/// # Source
/// A. M. Sykulski, S. C. Olhede, A. P. Guillaumin, J. M. Lilly, J. J. Early, Biometrika 106 (2019) 251.
pub(super) fn expected_parts(noise: &RingdownNoise, interval_s: f64, lag_weights: &[f64]) -> Vec<Vec<f64>> {
    expected_parts_by(&RealTransform::new(lag_weights.len()), noise, interval_s, lag_weights)
}

/// [`expected_parts`] by a transform of as many samples.
pub(super) fn expected_parts_by(
    plan: &RealTransform,
    noise: &RingdownNoise,
    interval_s: f64,
    lag_weights: &[f64],
) -> Vec<Vec<f64>> {
    let n = lag_weights.len();
    (0..noise.parts())
        .into_par_iter()
        .map(|part| {
            if part == 0 {
                // white: lag 0 alone
                return vec![lag_weights[0].max(0.0); plan.bins()];
            }
            let at = |lag: usize| noise.unit_covariance(part, lag as f64 * interval_s) * lag_weights[lag];
            let folded = (0..n).map(|lag| if lag == 0 { at(0) } else { at(lag) + at(n - lag) });
            plan.forward(folded).iter().map(|bin| bin.re.max(0.0)).collect()
        })
        .collect()
}

/// Iterations of the scoring: five are usual.
const ROUNDS: usize = 40;

/// Variances whose expected periodogram has the largest Whittle likelihood; none negative.
///
/// `observed`: mean periodogram, what the fit has absorbed added. Bins from 1 on: the mean is the events' own offset.
///
/// # Method
/// Fisher scoring: weighted non-negative least squares with weights `1 / level^2`, by cyclic coordinate descent,
/// repeated.
pub(super) fn variances(observed: &[f64], parts: &[Vec<f64>], start: &[f64]) -> Vec<f64> {
    let mut values = start.to_vec();
    let mut level = levels(parts, &values);
    let mut likelihood = whittle(observed, &level);
    for _ in 0..ROUNDS {
        let (normal, right) = weighted(observed, parts, &level);
        let target = non_negative(&normal, &right, &values);
        let mut share = 1.0;
        loop {
            let trial: Vec<f64> = values.iter().zip(&target).map(|(v, t)| v + share * (t - v)).collect();
            let trial_level = levels(parts, &trial);
            let next = whittle(observed, &trial_level);
            if next <= likelihood {
                let gain = likelihood - next;
                (values, level, likelihood) = (trial, trial_level, next);
                if gain < 1e-9 * observed.len() as f64 {
                    return values;
                }
                break;
            }
            share *= 0.5;
            if share < 1e-6 {
                return values;
            }
        }
    }
    values
}

fn levels(parts: &[Vec<f64>], values: &[f64]) -> Vec<f64> {
    let bins = parts.first().map_or(0, Vec::len);
    (0..bins).map(|k| parts.iter().zip(values).map(|(p, v)| p[k] * v).sum::<f64>().max(f64::MIN_POSITIVE)).collect()
}

fn whittle(observed: &[f64], level: &[f64]) -> f64 {
    observed.iter().zip(level).skip(1).map(|(o, l)| o.max(0.0) / l + l.ln()).sum()
}

fn weighted(observed: &[f64], parts: &[Vec<f64>], level: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let count = parts.len();
    let (mut normal, mut right) = (vec![vec![0.0; count]; count], vec![0.0; count]);
    for k in 1..observed.len() {
        let weight = level[k].powi(-2);
        for i in 0..count {
            let scaled = parts[i][k] * weight;
            right[i] += scaled * observed[k];
            for j in 0..=i {
                normal[i][j] += scaled * parts[j][k];
            }
        }
    }
    let full = (0..count).map(|i| (0..count).map(|j| normal[i.max(j)][i.min(j)]).collect()).collect();
    (full, right)
}

/// `min x'Nx/2 - r'x`, `x >= 0`, by coordinate descent.
fn non_negative(normal: &[Vec<f64>], right: &[f64], start: &[f64]) -> Vec<f64> {
    let mut x = start.to_vec();
    for _ in 0..2000 {
        let mut change = 0.0_f64;
        for i in 0..x.len() {
            if normal[i][i] <= 0.0 {
                continue;
            }
            let slope = right[i] - normal[i].iter().zip(&x).map(|(n, x)| n * x).sum::<f64>();
            let next = (x[i] + slope / normal[i][i]).max(0.0);
            change = change.max((next - x[i]).abs() * normal[i][i].sqrt());
            x[i] = next;
        }
        let scale = x.iter().enumerate().map(|(i, x)| x * normal[i][i].sqrt()).fold(0.0, f64::max);
        if change <= 1e-10 * scale {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::autocorrelation;

    #[test]
    fn the_autocorrelation_of_hanns_taper_is_known_in_closed_form() {
        for samples in [3, 24, 57, 1000] {
            let by_transform = autocorrelation(&hann(samples));
            for (lag, (closed, found)) in hann_autocorrelation(samples).iter().zip(by_transform).enumerate() {
                // rounding of a transform of unit variance, and of the difference of two cosecants of N each
                assert!((closed - found).abs() < 1e-12, "{samples} {lag}: {closed} for {found}");
            }
        }
    }
}

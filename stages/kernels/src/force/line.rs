//! A straight line through a stretch of signal, and how far it can be trusted.

/// How the samples of the stretch are weighted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighting {
    /// All alike: the least variance for white noise.
    Uniform,
    /// A Hann window over the stretch. Decaying oscillations of at least ten periods drop out: by parts, three times,
    /// the bias is below `A (2 pi)^2 / |s L|^3` for amplitude `A`, pole `s` and length `L`. The variance doubles.
    Hann,
}

/// `value(k) = level + slope (k - origin)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Value at the origin, in the signal's unit.
    pub level: f64,
    /// Change per sample.
    pub slope: f64,
    /// Sample that the level refers to.
    pub origin: f64,
    /// Variance of the level, of the slope, and their covariance, for noise of variance one per sample.
    pub unit_covariance: [f64; 3],
}

impl Line {
    /// Value at a sample, also between two.
    pub fn at(&self, sample: f64) -> f64 {
        self.level + self.slope * (sample - self.origin)
    }

    /// Standard error at a sample for white noise of the given standard deviation.
    pub fn std_at(&self, sample: f64, noise_std: f64) -> f64 {
        let d = sample - self.origin;
        let [level, slope, cross] = self.unit_covariance;
        noise_std * (level + 2.0 * d * cross + d * d * slope).max(0.0).sqrt()
    }
}

/// Fits a line to `values[from..to]`.
///
/// # Model
/// Line plus white noise, plus anything that the weighting suppresses.
///
/// # Method
/// Weighted least squares about the weighted centre, where level and slope are uncorrelated up to the weights' second
/// order. `sloped = false` fits the level alone.
///
/// # Shapes
/// `values` `[time]`; the stretch must lie inside and hold at least two samples (a lone sample gives its value with
/// slope zero, an empty stretch a line of zeros).
///
/// # Units
/// Those of the values, per sample for the slope.
///
/// # Accuracy
/// See [`Weighting`]; rounding of order `eps` of the largest value.
pub fn fit_line(values: &[f64], from: usize, to: usize, weighting: Weighting, sloped: bool) -> Line {
    let to = to.min(values.len());
    let from = from.min(to);
    let stretch = &values[from..to];
    let n = stretch.len() as f64;
    let weight = |k: usize| match weighting {
        Weighting::Uniform => 1.0,
        Weighting::Hann => (std::f64::consts::PI * (k as f64 + 0.5) / n).sin().powi(2),
    };
    // both windows are symmetric: the weighted centre is the middle
    let middle = 0.5 * (n - 1.0);
    let (mut w0, mut w2, mut level, mut slope, mut v0, mut v2) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (k, y) in stretch.iter().enumerate() {
        let (w, d) = (weight(k), k as f64 - middle);
        w0 += w;
        w2 += w * d * d;
        level += w * y;
        slope += w * d * y;
        v0 += w * w;
        v2 += w * w * d * d;
    }
    let origin = from as f64 + middle;
    let sloped = sloped && w2 > 0.0;
    if w0 <= 0.0 {
        return Line { level: 0.0, slope: 0.0, origin: from as f64, unit_covariance: [0.0; 3] };
    }
    Line {
        level: level / w0,
        slope: if sloped { slope / w2 } else { 0.0 },
        origin,
        unit_covariance: [v0 / (w0 * w0), if sloped { v2 / (w2 * w2) } else { 0.0 }, 0.0],
    }
}

/// By how much correlation of the residual enlarges the standard error of a mean: square root of the Bartlett-weighted
/// sum of its autocorrelations up to `lags` (Newey and West 1987), never below one.
pub fn correlation_inflation(residual: &[f64], lags: usize) -> f64 {
    let power: f64 = residual.iter().map(|e| e * e).sum();
    if power <= 0.0 {
        return 1.0;
    }
    let mut sum = 1.0;
    for lag in 1..=lags.min(residual.len().saturating_sub(1)) {
        let product: f64 = residual.iter().zip(&residual[lag..]).map(|(a, b)| a * b).sum();
        sum += 2.0 * (1.0 - lag as f64 / (lags + 1) as f64) * product / power;
    }
    sum.max(1.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Lever, white_noise};

    #[test]
    fn a_line_is_found_exactly_and_extrapolated() {
        let values: Vec<f64> = (0..500).map(|k| 0.3 - 2e-5 * k as f64).collect();
        for weighting in [Weighting::Uniform, Weighting::Hann] {
            let line = fit_line(&values, 100, 400, weighting, true);
            // rounding of numbers of order one over 300 samples
            assert!((line.at(1000.0) - 0.28).abs() < 1e-13 && (line.slope + 2e-5).abs() < 1e-16);
        }
    }

    #[test]
    fn ringing_does_not_bias_a_hann_weighted_line() {
        let y = Lever::paper().release(8192, 1000.0, -0.9);
        let hann = fit_line(&y, 1000, 8192, Weighting::Hann, true).at(1000.0);
        let uniform = fit_line(&y, 1000, 8192, Weighting::Uniform, true).at(1000.0);
        // |s L| = 2 pi 46.3 kHz 1.44 ms = 418: (2 pi)^2 / 418^3 = 5e-7 of 0.9 V, times 4 for the extrapolation to the edge
        assert!(hann.abs() < 2e-6, "{hann:e}");
        assert!(uniform.abs() > 1e-3, "{uniform:e}");
    }

    #[test]
    fn standard_errors_match_the_spread() {
        for weighting in [Weighting::Uniform, Weighting::Hann] {
            let ends: Vec<f64> = (0..400)
                .map(|seed| fit_line(&white_noise(300, 1.0, seed), 0, 300, weighting, true).at(300.0))
                .collect();
            let spread = (ends.iter().map(|v| v * v).sum::<f64>() / 400.0).sqrt();
            let predicted = fit_line(&[0.0; 300], 0, 300, weighting, true).std_at(300.0, 1.0);
            // 400 draws: relative standard error 1 / sqrt(800) = 3.5 %, four of them
            assert!((spread / predicted - 1.0).abs() < 0.14, "{weighting:?} {spread} {predicted}");
        }
    }

    #[test]
    fn correlated_noise_inflates() {
        let white = white_noise(4000, 1.0, 3);
        // 60 lags: relative standard error of the sum about sqrt(4/3 * 60 / 4000) = 0.14
        assert!(correlation_inflation(&white, 60) < 1.2);
        let smooth: Vec<f64> = white.windows(16).map(|w| w.iter().sum()).collect();
        // a moving sum over 16: 16 times the variance of the mean, Bartlett's taper takes a tenth
        assert!((correlation_inflation(&smooth, 60) - 3.8).abs() < 0.6);
    }
}

//! Windows in time.

use std::f64::consts::{PI, TAU};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::SignalError;

/// Kinds of windows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Taper {
    /// Flat with cosine edges.
    Tukey,
    /// All ones.
    Rectangular,
    /// Raised cosine.
    Hann,
}

impl Taper {
    /// Its name in configs and results.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tukey => "tukey",
            Self::Rectangular => "rectangular",
            Self::Hann => "hann",
        }
    }
}

/// What a window does to amplitudes and powers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaperGains {
    /// Coherent gain: mean of the window, the factor on a sinusoid's amplitude.
    pub coherent: f64,
    /// Noise gain: mean of its square, the factor on the power of white noise.
    pub noise: f64,
    /// Noise-equivalent bandwidth in bins: noise gain over the square of the coherent one.
    pub equivalent_bins: f64,
}

/// Values of a window of the given length; `alpha`: share of a Tukey window that is tapered, half of it at either end,
/// from zero (rectangular) to one (Hann).
///
/// # Model
/// Tukey: `w = (1 + cos(pi (x - 1))) / 2` for `x = 2 k / (alpha (N - 1)) < 1` at the start, mirrored at the end, one
/// between. Eq. 9 as printed has `1 + alpha` for `1 - alpha` in its limits and twice the taper's length under the
/// cosine: at alpha = 0.1 it would fall from 1 to 0.97 where the taper starts and end at 0.33. This is the window that
/// it means.
///
/// # Shapes
/// `[samples]`, symmetric.
///
/// # Units
/// A number from zero to one.
///
/// # Errors
/// `alpha` outside zero to one.
///
/// # Source
/// Harris, Proc. IEEE 66 (1978) 51; Stark et al. 2005, Eq. 9.
pub fn taper(kind: Taper, alpha: f64, samples: usize) -> Result<Vec<f64>, SignalError> {
    let alpha = match kind {
        Taper::Rectangular => 0.0,
        Taper::Hann => 1.0,
        Taper::Tukey => alpha,
    };
    if !(0.0..=1.0).contains(&alpha) {
        return Err(SignalError::Alpha(alpha));
    }
    let edge = 0.5 * alpha * samples.saturating_sub(1) as f64;
    let value = |k: usize| {
        let x = k.min(samples - 1 - k) as f64;
        if x >= edge { 1.0 } else { 0.5 * (1.0 + (PI * (x / edge - 1.0)).cos()) }
    };
    Ok((0..samples).map(value).collect())
}

/// Hann's window by position: `(1 - cos(2 pi (k + offset) / N)) / 2`. With `offset` 0 half-overlapping segments add up
/// to one; with 0.5 the window is symmetric and nowhere zero.
pub fn hann(samples: usize, offset: f64) -> Vec<f64> {
    let angle = |k: usize| TAU * (k as f64 + offset) / samples as f64;
    (0..samples).map(|k| 0.5 * (1.0 - angle(k).cos())).collect()
}

/// Gains of a window; an empty one has none.
pub fn taper_gains(window: &[f64]) -> TaperGains {
    let n = window.len().max(1) as f64;
    let coherent = window.iter().sum::<f64>() / n;
    let noise = window.iter().map(|w| w * w).sum::<f64>() / n;
    let equivalent_bins = if coherent > 0.0 { noise / (coherent * coherent) } else { 0.0 };
    TaperGains { coherent, noise, equivalent_bins }
}

/// Modified Bessel function of the first kind, order 0, by its power series (converges for every argument; 30 terms at
/// 10). Source: M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, 1964, equation 9.6.10.
pub fn bessel_i0(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let (mut term, mut sum, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-17 * sum {
        term *= quarter / (k * k);
        sum += term;
        k += 1.0;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eq. 9 letter by letter, `k` counted from the middle, the window reaching to `|k| = N`.
    fn as_printed(k: f64, n: f64, alpha: f64) -> f64 {
        if k <= 0.5 * n * (1.0 + alpha) {
            1.0
        } else {
            0.5 * (1.0 + (PI * (k - 0.5 * n * (1.0 - alpha)) / (n * (1.0 - alpha))).cos())
        }
    }

    #[test]
    fn equation_nine_as_printed_jumps_and_ends_at_a_third() {
        let (n, alpha) = (4096.0, 0.1);
        let start = 0.5 * n * (1.0 + alpha);
        // cos(pi / 9) and cos(11 pi / 18): three digits
        assert!((as_printed(start + 1e-9, n, alpha) - 0.970).abs() < 5e-4);
        assert!((as_printed(n, n, alpha) - 0.329).abs() < 5e-4);
        let meant = taper(Taper::Tukey, alpha, 8193).unwrap();
        assert!(meant.windows(2).all(|w| (w[1] - w[0]).abs() < 0.004)); // steepest: pi/2 / 409.6 samples
        assert!(meant[0].abs() < 1e-15 && meant[8192].abs() < 1e-15);
        // the tapered share is alpha
        let tapered = meant.iter().filter(|w| **w < 1.0).count() as f64 / 8193.0;
        assert!((tapered - alpha).abs() < 2.0 / 8193.0);
    }

    #[test]
    fn special_cases_and_gains() {
        let hann = taper(Taper::Hann, 0.0, 101).unwrap();
        let same = taper(Taper::Tukey, 1.0, 101).unwrap();
        assert_eq!(hann, same);
        assert!((hann[25] - 0.5).abs() < 1e-15 && hann[50] == 1.0);
        assert_eq!(taper(Taper::Tukey, 0.0, 5).unwrap(), vec![1.0; 5]);
        let gains = taper_gains(&taper(Taper::Hann, 0.0, 100_001).unwrap());
        // 1/2, 3/8 and 3/2, but for the one sample that makes it symmetric
        assert!((gains.coherent - 0.5).abs() < 1e-5 && (gains.noise - 0.375).abs() < 1e-5);
        assert!((gains.equivalent_bins - 1.5).abs() < 3e-5);
        let tukey = taper_gains(&taper(Taper::Tukey, 0.1, 100_001).unwrap());
        // 1 - alpha / 2 and 1 - 5 alpha / 8
        assert!((tukey.coherent - 0.95).abs() < 2e-5 && (tukey.noise - 0.9375).abs() < 2e-5);
        assert_eq!(taper(Taper::Rectangular, 0.0, 0).unwrap(), Vec::<f64>::new());
        assert!(taper(Taper::Tukey, 1.1, 5).is_err());
        assert!(taper(Taper::Tukey, f64::NAN, 5).is_err());
    }
}

//! What an input does between its samples.

use std::f64::consts::TAU;

use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the input does between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Intersample {
    /// It is held until the next sample, as a force that is released at a sample is. The ratio of the transforms then
    /// lags by half a sample and droops by `sin(x) / x`, `x = pi f / f_s`; both are taken out.
    Held,
    /// Nothing is corrected: the transfer function from sequence to sequence.
    Sampled,
}

impl Intersample {
    /// What turns the response from sequence to sequence into that of the continuous system: `i w T / (1 - exp(-i w
    /// T))` for a held input, one at rest.
    pub fn correction(self, frequency_hz: f64, sample_time_s: f64) -> Complex64 {
        let angle = TAU * frequency_hz * sample_time_s;
        match self {
            Self::Held if angle > 0.0 => Complex64::new(0.0, angle) / (1.0 - Complex64::cis(-angle)),
            _ => Complex64::new(1.0, 0.0),
        }
    }

    /// By how much sequences lag behind the continuous system, s.
    pub fn delay_s(self, sample_time_s: f64) -> f64 {
        if self == Self::Held { 0.5 * sample_time_s } else { 0.0 }
    }
}

/// `points` (two or more) frequencies in equal ratios, from `lowest_hz` or a quarter of the sample rate to half of it.
pub fn response_frequencies(lowest_hz: f64, sample_time_s: f64, points: usize) -> Vec<f64> {
    let rate = 1.0 / sample_time_s;
    let (low, high) = (lowest_hz.min(0.25 * rate).ln(), (0.5 * rate).ln());
    let last = (points - 1) as f64;
    (0..points).map(|i| (low + (high - low) * i as f64 / last).exp()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_correction_advances_by_half_a_sample_and_undoes_the_droop() {
        let (rate, f) = (5e6, 1.05e6);
        let x = std::f64::consts::PI * f / rate;
        // exact: exp(i x) x / sin(x); rounding of a few operations
        let found = Intersample::Held.correction(f, 1.0 / rate);
        assert!((found - Complex64::from_polar(x / x.sin(), x)).norm() < 1e-14);
        assert!((found.arg() / (TAU * f) - Intersample::Held.delay_s(1.0 / rate)).abs() < 1e-20);
        assert_eq!(Intersample::Sampled.correction(f, 1.0 / rate), Complex64::new(1.0, 0.0));
        assert_eq!(Intersample::Held.correction(0.0, 1.0 / rate), Complex64::new(1.0, 0.0));
    }

    #[test]
    fn frequencies_rise_in_equal_ratios_to_half_the_rate() {
        let f = response_frequencies(1.0, 1e-3, 4);
        assert!((f[3] - 500.0).abs() < 1e-9 && (f[1] / f[0] - f[3] / f[2]).abs() < 1e-12, "{f:?}");
        // a band that begins above the fastest frequency begins at a quarter of the rate
        assert!((response_frequencies(1e6, 1e-3, 2)[0] - 250.0).abs() < 1e-9);
    }
}

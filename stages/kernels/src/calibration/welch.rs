//! Welch's averaged periodogram of free stretches.

use super::error::CalibrationError;
use realfft::{RealFftPlanner, RealToComplex};
use std::f64::consts::TAU;
use std::sync::Arc;

/// An averaged periodogram.
#[derive(Debug, Clone, PartialEq)]
pub struct AveragedPeriodogram {
    /// Distance of the frequencies, Hz; the first is 0.
    pub bin_hz: f64,
    /// One-sided density, V^2/Hz, bins 0 to segment/2.
    pub density_v2_per_hz: Vec<f64>,
    /// Number of (half-overlapping) segments.
    pub segments: usize,
}

impl AveragedPeriodogram {
    /// Frequencies of the bins, Hz.
    pub fn frequency_hz(&self) -> Vec<f64> {
        (0..self.density_v2_per_hz.len()).map(|k| k as f64 * self.bin_hz).collect()
    }

    /// How many independent segments the average is worth: neighbouring ones are correlated by 1/36.
    pub fn independent_segments(&self) -> f64 {
        let n = self.segments as f64;
        n * n / (n + 2.0 * (n - 1.0) / 36.0)
    }
}

/// Collects segments: Hann window, half overlap, each segment's mean removed.
///
/// # Model
/// `P(k) = 2 |sum_t w(t) (x(t) - mean) exp(-i 2 pi k t / N)|^2 / (rate sum w^2)`; the two ends are not doubled. Its sum
/// times the bin width is the mean square. Half-overlapping Hann segments are correlated by 1/36 and so worth
/// 0.947 independent ones each; neighbouring bins are correlated by 4/9 and 1/36.
///
/// # Source
/// P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70.
#[derive(Clone)]
pub struct Welch {
    sample_rate_hz: f64,
    fft: Arc<dyn RealToComplex<f64>>,
    window: Vec<f64>,
    sum: Vec<f64>,
    segments: usize,
}

impl Welch {
    /// A collector of segments of this length. Errors: fewer than 16 samples, or an odd number.
    pub fn new(segment_samples: usize, sample_rate_hz: f64) -> Result<Self, CalibrationError> {
        if segment_samples < 16 || segment_samples % 2 == 1 {
            return Err(CalibrationError::Length {
                what: "segment",
                got: segment_samples,
                wanted: "an even number of at least 16 samples".to_string(),
            });
        }
        let hann = |t: usize| 0.5 - 0.5 * (TAU * t as f64 / segment_samples as f64).cos();
        Ok(Self {
            sample_rate_hz,
            fft: RealFftPlanner::new().plan_fft_forward(segment_samples),
            window: (0..segment_samples).map(hann).collect(),
            sum: vec![0.0; segment_samples / 2 + 1],
            segments: 0,
        })
    }

    /// The same collector without its segments (the transform's plan is shared).
    pub fn fresh(&self) -> Self {
        Self { sum: vec![0.0; self.sum.len()], segments: 0, ..self.clone() }
    }

    /// Length of a segment.
    pub fn segment_samples(&self) -> usize {
        self.window.len()
    }

    /// Adds all whole segments of a stretch.
    pub fn push(&mut self, stretch: &[f64]) {
        let n = self.window.len();
        let (mut windowed, mut spectrum) = (vec![0.0; n], self.fft.make_output_vec());
        for segment in stretch.windows(n).step_by(n / 2) {
            let mean = segment.iter().sum::<f64>() / n as f64;
            for ((out, x), w) in windowed.iter_mut().zip(segment).zip(&self.window) {
                *out = (x - mean) * w;
            }
            // lengths come from the plan itself
            if self.fft.process(&mut windowed, &mut spectrum).is_ok() {
                self.sum.iter_mut().zip(&spectrum).for_each(|(sum, s)| *sum += s.norm_sqr());
                self.segments += 1;
            }
        }
    }

    /// Adds another collector's segments (same length).
    pub fn merge(&mut self, other: &Self) {
        self.sum.iter_mut().zip(&other.sum).for_each(|(sum, s)| *sum += s);
        self.segments += other.segments;
    }

    /// How many segments there are.
    pub fn segments(&self) -> usize {
        self.segments
    }

    /// The average. Errors: no segment.
    pub fn average(&self) -> Result<AveragedPeriodogram, CalibrationError> {
        if self.segments == 0 {
            let hint = "free stretches are shorter than segment_samples: lower it";
            return Err(CalibrationError::TooLittle { what: "segments", found: 0, wanted: 1, hint });
        }
        let power: f64 = self.window.iter().map(|w| w * w).sum();
        let scale = 2.0 / (self.sample_rate_hz * power * self.segments as f64);
        let mut density: Vec<f64> = self.sum.iter().map(|s| scale * s).collect();
        if let Some(first) = density.first_mut() {
            *first *= 0.5;
        }
        if let Some(last) = density.last_mut() {
            *last *= 0.5;
        }
        let bin_hz = self.sample_rate_hz / self.window.len() as f64;
        Ok(AveragedPeriodogram { bin_hz, density_v2_per_hz: density, segments: self.segments })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn white_noise_has_its_density_and_its_mean_square() {
        let mut welch = Welch::new(1024, 1e4).unwrap();
        welch.push(&white_noise(400_000, 0.3, 5));
        let average = welch.average().unwrap();
        assert_eq!(average.segments, (400_000 - 1024) / 512 + 1);
        let mean_square = average.density_v2_per_hz.iter().sum::<f64>() * average.bin_hz;
        // sqrt(2 / 400000) = 0.2 %, the removed mean takes 0.15 %
        assert!((mean_square / 0.09 - 1.0).abs() < 0.01, "{mean_square}");
        let middle = average.density_v2_per_hz[100..400].iter().sum::<f64>() / 300.0;
        // one-sided: 2 sigma^2 / rate; 300 correlated bins x 780 segments: 0.3 %
        assert!((middle / (2.0 * 0.09 / 1e4) - 1.0).abs() < 0.015, "{middle}");
    }
}

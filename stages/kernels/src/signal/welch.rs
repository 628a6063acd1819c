//! Welch's averaged periodogram.

use super::error::SignalError;
use super::fourier::RealTransform;
use super::taper::hann;

/// An averaged periodogram.
#[derive(Debug, Clone, PartialEq)]
pub struct AveragedPeriodogram {
    /// Distance of the frequencies, Hz; the first is 0.
    pub bin_hz: f64,
    /// One-sided density, the signal's unit squared per hertz, bins 0 to segment/2.
    pub density: Vec<f64>,
    /// Number of (half-overlapping) segments.
    pub segments: usize,
}

impl AveragedPeriodogram {
    /// Frequencies of the bins, Hz.
    pub fn frequency_hz(&self) -> Vec<f64> {
        (0..self.density.len()).map(|k| k as f64 * self.bin_hz).collect()
    }

    /// How many independent segments the average is worth: neighbouring ones are correlated by 1/36.
    pub fn independent_segments(&self) -> f64 {
        let n = self.segments as f64;
        n * n / (n + 2.0 * (n - 1.0) / 36.0)
    }
}

/// What is taken off each segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detrend {
    /// Its mean.
    Mean,
    /// Its least-squares line.
    Line,
}

/// Collects segments: Hann window, half overlap, each segment's mean or line removed; segments with values that are not
/// finite are left out.
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
    plan: RealTransform,
    detrend: Detrend,
    window: Vec<f64>,
    sum: Vec<f64>,
    segments: usize,
}

impl Welch {
    /// A collector of segments of this length. Errors: fewer than 16 samples, or an odd number.
    pub fn new(segment_samples: usize, sample_rate_hz: f64, detrend: Detrend) -> Result<Self, SignalError> {
        if segment_samples < 16 || segment_samples % 2 == 1 {
            return Err(SignalError::Segment(segment_samples));
        }
        Ok(Self {
            sample_rate_hz,
            plan: RealTransform::new(segment_samples),
            detrend,
            window: hann(segment_samples, 0.0),
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
        for segment in stretch.windows(n).step_by(n / 2).filter(|segment| segment.iter().all(|x| x.is_finite())) {
            let (mean, slope) = self.trend(segment);
            let middle = 0.5 * (n as f64 - 1.0);
            let rest = segment.iter().enumerate().map(|(k, x)| x - mean - slope * (k as f64 - middle));
            let power = self.plan.power(rest.zip(&self.window).map(|(x, w)| x * w));
            self.sum.iter_mut().zip(&power).for_each(|(sum, p)| *sum += p);
            self.segments += 1;
        }
    }

    /// Mean and slope per sample.
    fn trend(&self, segment: &[f64]) -> (f64, f64) {
        let n = segment.len() as f64;
        let mean = segment.iter().sum::<f64>() / n;
        if self.detrend == Detrend::Mean {
            return (mean, 0.0);
        }
        let middle = 0.5 * (n - 1.0);
        let moment: f64 = segment.iter().enumerate().map(|(k, x)| (k as f64 - middle) * x).sum();
        (mean, moment * 12.0 / (n * (n * n - 1.0)))
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
    pub fn average(&self) -> Result<AveragedPeriodogram, SignalError> {
        if self.segments == 0 {
            return Err(SignalError::NoSegment);
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
        Ok(AveragedPeriodogram { bin_hz, density, segments: self.segments })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn white_noise_has_its_density_and_its_mean_square() {
        let mut welch = Welch::new(1024, 1e4, Detrend::Mean).unwrap();
        welch.push(&white_noise(400_000, 0.3, 5));
        let average = welch.average().unwrap();
        assert_eq!(average.segments, (400_000 - 1024) / 512 + 1);
        let mean_square = average.density.iter().sum::<f64>() * average.bin_hz;
        // sqrt(2 / 400000) = 0.2 %, the removed mean takes 0.15 %
        assert!((mean_square / 0.09 - 1.0).abs() < 0.01, "{mean_square}");
        let middle = average.density[100..400].iter().sum::<f64>() / 300.0;
        // one-sided: 2 sigma^2 / rate; 300 correlated bins x 780 segments: 0.3 %
        assert!((middle / (2.0 * 0.09 / 1e4) - 1.0).abs() < 0.015, "{middle}");
    }

    #[test]
    fn a_ramp_leaves_nothing_once_its_line_is_removed() {
        let ramp: Vec<f64> = (0..2048).map(|k| 3.0 + 0.01 * f64::from(k)).collect();
        let power = |detrend: Detrend| {
            let mut welch = Welch::new(256, 1.0, detrend).unwrap();
            welch.push(&ramp);
            welch.average().unwrap().density.iter().sum::<f64>()
        };
        // rounding of values of 20 against the slope's own 0.5 V^2
        assert!(power(Detrend::Line) < 1e-25 && power(Detrend::Mean) > 0.1);
    }

    #[test]
    fn parts_add_up_and_gaps_are_left_out() {
        let mut values = white_noise(4096, 1.0, 8);
        let mut whole = Welch::new(256, 1.0, Detrend::Mean).unwrap();
        let mut parts = whole.fresh();
        whole.push(&values);
        let mut half = parts.fresh();
        parts.push(&values[..2048]);
        half.push(&values[1920..]);
        parts.merge(&half);
        assert_eq!((whole.segments(), parts.segments()), (31, 31));
        let (a, b) = (whole.average().unwrap().density, parts.average().unwrap().density);
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12 * a)); // rounding
        values[1000] = f64::NAN;
        let mut rest = whole.fresh();
        rest.push(&values);
        // two segments hold that sample
        assert_eq!(rest.segments(), 29);
        assert!(rest.average().unwrap().density.iter().all(|d| d.is_finite()));
        assert_eq!(whole.fresh().average().unwrap_err(), SignalError::NoSegment);
        assert_eq!(Welch::new(17, 1.0, Detrend::Mean).err(), Some(SignalError::Segment(17)));
    }
}

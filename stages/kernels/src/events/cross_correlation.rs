//! Normalised cross-correlation with a template, by FFT.

use crate::signal::RealTransform;

/// Slides templates of one length over signals of one length. Plans its FFTs once.
pub struct CrossCorrelator {
    template_samples: usize,
    signal_samples: usize,
    plan: RealTransform,
}

/// The best place of a template in a signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// Where the template's first sample lies, in samples of the signal; between samples by a parabola.
    pub position: f64,
    /// Pearson correlation there, without regard to offset and amplitude: at most 1.
    pub correlation: f64,
    /// Whether the best place is the first or last possible: then a better one may lie beyond.
    pub at_limit: bool,
}

impl CrossCorrelator {
    /// For templates of `template_samples` in signals of `signal_samples`.
    pub fn new(template_samples: usize, signal_samples: usize) -> Self {
        let size = signal_samples.max(template_samples).max(2).next_power_of_two();
        Self { template_samples, signal_samples, plan: RealTransform::new(size) }
    }

    /// Where `template` fits `signal` best.
    ///
    /// # Model
    /// `signal[n + lag] = a template[n] + b + noise`, a > 0.
    /// # Method
    /// `r(lag) = sum (t - mean t) s[n + lag] / (|t - mean t| |s - local mean s|)`; numerators by one circular FFT
    /// correlation (long enough that nothing wraps), local energies by running sums; the peak refined by a parabola
    /// through three points.
    /// # Accuracy
    /// Whole samples certain, fractions to some hundredths: refine with
    /// [`refine_shift`](crate::events::shift_refinement::refine_shift).
    /// # Shapes
    /// The lengths given to [`CrossCorrelator::new`].
    /// # Errors
    /// `None` if lengths differ from these, a value is not finite, or either is constant.
    pub fn best_match(&self, template: &[f64], signal: &[f64]) -> Option<Match> {
        if template.len() != self.template_samples || signal.len() != self.signal_samples {
            return None;
        }
        let lags = (signal.len() + 1).checked_sub(template.len()).filter(|&lags| lags > 0 && !template.is_empty())?;
        let correlations = self.correlations(template, signal, lags)?;
        let best = (0..lags).max_by(|&a, &b| correlations[a].total_cmp(&correlations[b]))?;
        let at_limit = best == 0 || best + 1 == lags;
        let (mut position, mut correlation) = (best as f64, correlations[best]);
        if !at_limit {
            let (left, middle, right) = (correlations[best - 1], correlations[best], correlations[best + 1]);
            let bend = left - 2.0 * middle + right;
            if bend < 0.0 {
                let offset = (0.5 * (left - right) / bend).clamp(-0.5, 0.5);
                position += offset;
                correlation = (middle - 0.25 * (left - right) * offset).min(1.0);
            }
        }
        Some(Match { position, correlation, at_limit })
    }

    fn correlations(&self, template: &[f64], signal: &[f64], lags: usize) -> Option<Vec<f64>> {
        let n = template.len() as f64;
        // an offset common to all would eat the digits of the running sums
        let shift = signal.iter().sum::<f64>() / signal.len() as f64;
        let mean = template.iter().sum::<f64>() / n;
        let energy: f64 = template.iter().map(|value| (value - mean).powi(2)).sum();
        if !shift.is_finite() || !energy.is_finite() || energy <= 0.0 {
            return None;
        }
        let products = self.products(template.iter().map(|v| v - mean), signal.iter().map(|v| v - shift));
        let (mut sum, mut squares) = (0.0, 0.0);
        for value in signal[..template.len()].iter().map(|v| v - shift) {
            sum += value;
            squares += value * value;
        }
        let floor = 1e-12 * squares;
        let mut correlations = Vec::with_capacity(lags);
        for lag in 0..lags {
            let local = squares - sum * sum / n;
            correlations.push(if local > floor { products[lag] / (energy * local).sqrt() } else { 0.0 });
            if lag + 1 < lags {
                let (old, new) = (signal[lag] - shift, signal[lag + template.len()] - shift);
                sum += new - old;
                squares += new * new - old * old;
            }
        }
        correlations.iter().any(|&value| value != 0.0).then_some(correlations)
    }

    fn products(&self, template: impl Iterator<Item = f64>, signal: impl Iterator<Item = f64>) -> Vec<f64> {
        let size = self.plan.samples() as f64;
        let template = self.plan.forward(template);
        let mut product = self.plan.forward(signal);
        product.iter_mut().zip(&template).for_each(|(s, t)| *s *= t.conj() / size);
        self.plan.inverse(product)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Lever, white_noise};

    /// The sum that the FFT replaces.
    fn slow(template: &[f64], signal: &[f64], lag: usize) -> f64 {
        let part = &signal[lag..lag + template.len()];
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (mt, ms) = (mean(template), mean(part));
        let sum = |f: &dyn Fn(f64, f64) -> f64| template.iter().zip(part).map(|(t, s)| f(t - mt, s - ms)).sum::<f64>();
        sum(&|t, s| t * s) / (sum(&|t, _| t * t) * sum(&|_, s| s * s)).sqrt()
    }

    #[test]
    fn agrees_with_the_slow_sum_at_every_lag() {
        for (n, m) in [(320, 384), (17, 64), (64, 64), (5, 200)] {
            let (template, signal) =
                (white_noise(n, 1.0, 3), white_noise(m, 2.0, 4).iter().map(|v| v + 7.0).collect::<Vec<_>>());
            let fast = CrossCorrelator::new(n, m).correlations(&template, &signal, m + 1 - n).unwrap();
            for (lag, value) in fast.iter().enumerate() {
                // rounding of sums of 1e3 terms
                assert!((value - slow(&template, &signal, lag)).abs() < 1e-10, "{n} in {m} at {lag}");
            }
        }
    }

    #[test]
    fn a_release_is_found_whatever_its_offset_and_amplitude() {
        let template = &Lever::paper().release(2048, 1000.0, -0.9)[936..1256];
        let correlator = CrossCorrelator::new(320, 384);
        for seed in 0..10 {
            let t0 = 1000.0 + 2.9 * (seed as f64 - 5.0);
            let noise = white_noise(2048, 1.2e-3, seed);
            let signal: Vec<f64> =
                Lever::paper().release(2048, t0, -0.6).iter().zip(noise).map(|(y, e)| y + e + 3.0).collect();
            let found = correlator.best_match(template, &signal[904..1288]).unwrap();
            // a parabola through three samples of a smooth peak
            assert!((found.position - 32.0 - (t0 - 1000.0)).abs() < 0.05, "{found:?} for {t0}");
            assert!(found.correlation > 0.999 && !found.at_limit, "{found:?}");
        }
    }

    #[test]
    fn nothing_fits_constants_nan_or_other_lengths() {
        let correlator = CrossCorrelator::new(8, 16);
        let (t, s) = (white_noise(8, 1.0, 1), white_noise(16, 1.0, 2));
        assert_eq!(correlator.best_match(&[1.0; 8], &s), None);
        assert_eq!(correlator.best_match(&t, &[1.0; 16]), None);
        assert_eq!(correlator.best_match(&t, &[f64::NAN; 16]), None);
        assert_eq!(correlator.best_match(&t, &s[..12]), None);
        assert_eq!(CrossCorrelator::new(8, 4).best_match(&t, &s[..4]), None);
    }
}

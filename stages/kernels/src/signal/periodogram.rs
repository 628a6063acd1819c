//! Periodograms of tapered signals of one length.

use num_complex::Complex64;
use rayon::prelude::*;

use super::fourier::RealTransform;

/// Mean of the tapered periodograms `|FFT|^2 / N` of several signals, bins 0 to N/2.
pub fn mean_periodogram(signals: &[Vec<f64>], taper: &[f64]) -> Vec<f64> {
    let mut sum = summed_periodograms(&RealTransform::new(taper.len()), signals, taper);
    sum.iter_mut().for_each(|p| *p /= signals.len().max(1) as f64);
    sum
}

/// Sum of the tapered periodograms, in the signals' order; `plan`: of the taper's length.
pub fn summed_periodograms(plan: &RealTransform, signals: &[Vec<f64>], taper: &[f64]) -> Vec<f64> {
    let n = taper.len();
    let all: Vec<Vec<f64>> =
        signals.par_iter().map(|signal| plan.power(signal.iter().zip(taper).map(|(v, w)| v * w))).collect();
    let mut sum = vec![0.0; n / 2 + 1];
    for one in all {
        sum.iter_mut().zip(one).for_each(|(s, p)| *s += p / n as f64);
    }
    sum
}

/// `sum_k x(k) x(k + lag) / N`, lags 0 to N - 1, by a transform of twice the length.
pub fn autocorrelation(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let plan = RealTransform::new(2 * n);
    let power = plan.power(values.iter().copied());
    let mut lags = plan.inverse(power.into_iter().map(|p| Complex64::new(p, 0.0)).collect());
    lags.truncate(n);
    lags.iter_mut().for_each(|lag| *lag /= (2 * n * n) as f64);
    lags
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;
    use crate::signal::hann;

    #[test]
    fn a_periodogram_of_white_noise_has_its_variance_in_every_bin() {
        let signals: Vec<Vec<f64>> = (0..200).map(|seed| white_noise(256, 0.5, seed)).collect();
        let taper: Vec<f64> = hann(256, 0.5).iter().map(|w| w * (8.0f64 / 3.0).sqrt()).collect();
        let found = mean_periodogram(&signals, &taper);
        let mean = found[2..126].iter().sum::<f64>() / 124.0;
        // 200 x 124 exponential values, neighbours correlated (factor 1.4): 0.9 %; four of these
        assert!((mean / 0.25 - 1.0).abs() < 0.036, "{mean}");
    }

    #[test]
    fn the_autocorrelation_is_that_of_the_sum() {
        for n in [1, 2, 7, 64] {
            let x = white_noise(n, 1.0, 3);
            for (lag, found) in autocorrelation(&x).iter().enumerate() {
                let slow: f64 = x.iter().zip(&x[lag..]).map(|(a, b)| a * b).sum::<f64>() / n as f64;
                assert!((found - slow).abs() < 1e-14, "{n} {lag}"); // rounding
            }
        }
    }
}

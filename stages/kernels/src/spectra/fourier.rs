//! The discrete Fourier transform of real series.

use num_complex::Complex64;

use super::error::finite;
use crate::signal::RealTransform;
use crate::spectra::error::SpectrumError;

/// Transforms series of one length with one plan.
///
/// # Method
/// `X_k = N^(-1/2) sum_(n=0)^(N-1) x_n exp(-i 2 pi k n / N)`, `k = 0 ... N/2`. The paper sums from one to N, which
/// turns all transforms by the same phase and leaves ratios as they are.
///
/// # Shapes
/// Each series `[N]`, each result `[N/2 + 1]`.
///
/// # Errors
/// Fewer than two samples, series of different length, values not finite.
///
/// # Source
/// Stark et al. 2005, Eqs. 5 and 6.
pub fn transform(series: &[&[f64]]) -> Result<Vec<Vec<Complex64>>, SpectrumError> {
    let n = series.first().map_or(0, |s| s.len());
    if n < 2 {
        return Err(SpectrumError::TooShort { got: n, wanted: 2 });
    }
    let plan = RealTransform::new(n);
    let scale = 1.0 / (n as f64).sqrt();
    series
        .iter()
        .map(|x| {
            finite("the series", x)?;
            if x.len() != n {
                return Err(SpectrumError::Lengths { name: "a series", got: x.len(), wanted: n });
            }
            let mut bins = plan.forward(x.iter().copied());
            bins.iter_mut().for_each(|b| *b *= scale);
            Ok(bins)
        })
        .collect()
}

/// Frequencies of the bins of a series of `samples`, in hertz.
pub fn bin_frequencies(samples: usize, sample_rate_hz: f64) -> Vec<f64> {
    (0..=samples / 2).map(|k| k as f64 * sample_rate_hz / samples as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_fast_transform_equals_the_sum() {
        for n in [2, 15, 64, 101] {
            let x = white_noise(n, 1.0, n as u64);
            let fast = transform(&[&x]).unwrap().remove(0);
            assert_eq!(fast.len(), bin_frequencies(n, 1.0).len());
            for (k, f) in fast.iter().enumerate() {
                let slow: Complex64 = x
                    .iter()
                    .enumerate()
                    .map(|(t, v)| Complex64::from_polar(*v, -std::f64::consts::TAU * (k * t) as f64 / n as f64))
                    .sum::<Complex64>()
                    / (n as f64).sqrt();
                // a hundred roundings of numbers of order one
                assert!((f - slow).norm() < 1e-13);
            }
        }
        assert!(transform(&[&[1.0, 2.0], &[1.0]]).is_err());
        assert!(transform(&[&[1.0, f64::NAN]]).is_err());
        assert!(transform(&[]).is_err());
    }
}

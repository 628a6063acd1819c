//! Periodograms.

use super::error::positive;
use crate::spectra::error::SpectrumError;
use crate::spectra::fourier::{bin_frequencies, transform};

/// One-sided power spectral density.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerSpectrum {
    /// Bins in hertz.
    pub frequency_hz: Vec<f64>,
    /// Density: the series' unit squared, per hertz.
    pub density: Vec<f64>,
}

/// Periodogram of a series that has been multiplied by a window.
///
/// # Model
/// The normalised absolute square of the Fourier transform, an estimate of the power spectral density with 100 %
/// scatter.
///
/// # Method
/// `P_k = 2 N |X_k|^2 / (f_s sum w^2)`, without the factor two at zero and at half the sample rate; its integral over
/// frequency is the mean square of a stationary series. `window_power` is `sum w^2`, the number of samples for a
/// rectangular window.
///
/// # Shapes
/// `series` `[N]`, result `[N/2 + 1]`.
///
/// # Units
/// Unit of the series squared per hertz.
///
/// # Accuracy
/// Each bin of noise is exponentially distributed about the density.
///
/// # Errors
/// Fewer than two samples, values not finite, a sample rate or window power that is not positive.
///
/// # Source
/// Stark et al. 2005, "Results and discussion"; Harris 1978 for the window's gain.
pub fn power_spectrum(series: &[f64], window_power: f64, sample_rate_hz: f64) -> Result<PowerSpectrum, SpectrumError> {
    positive("sample_rate_hz", sample_rate_hz)?;
    positive("window_power", window_power)?;
    let n = series.len();
    let bins = transform(&[series])?.remove(0);
    let scale = n as f64 / (sample_rate_hz * window_power);
    let sides = |k: usize| if k == 0 || 2 * k == n { 1.0 } else { 2.0 };
    let density = bins.iter().enumerate().map(|(k, x)| sides(k) * scale * x.norm_sqr()).collect();
    Ok(PowerSpectrum { frequency_hz: bin_frequencies(n, sample_rate_hz), density })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;
    use crate::signal::{Taper, taper};

    #[test]
    fn the_integral_is_the_mean_square() {
        for n in [1000, 1001] {
            let x = white_noise(n, 0.7, 4);
            let spectrum = power_spectrum(&x, n as f64, 5e6).unwrap();
            let integral = spectrum.density.iter().sum::<f64>() * 5e6 / n as f64;
            let square = x.iter().map(|v| v * v).sum::<f64>() / n as f64;
            // Parseval: rounding alone
            assert!((integral / square - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn white_noise_has_its_density_under_any_window() {
        for kind in [Taper::Rectangular, Taper::Hann, Taper::Tukey] {
            let w = taper(kind, 0.1, 4096).unwrap();
            let mut mean = 0.0;
            for seed in 0..8 {
                let x: Vec<f64> = white_noise(4096, 1e-3, seed).iter().zip(&w).map(|(x, w)| x * w).collect();
                let p = power_spectrum(&x, w.iter().map(|w| w * w).sum(), 5e6).unwrap();
                mean += p.density[10..2000].iter().sum::<f64>() / 1990.0 / 8.0;
            }
            // 2 sigma^2 / f_s; 16000 exponential values, correlated over 1.5 bins: 1 % is 1.0 to 1.3 sigma, times 4
            assert!((mean / (2e-6 / 5e6) - 1.0).abs() < 0.04);
        }
        assert!(power_spectrum(&[0.0; 8], 0.0, 1.0).is_err());
    }
}

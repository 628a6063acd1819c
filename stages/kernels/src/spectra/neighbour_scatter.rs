//! The variance of an estimate from the scatter of neighbouring bins.

use super::local_polynomial::{PolynomialSettings, local_polynomial};
use super::neighbours::Bins;
use crate::spectra::error::SpectrumError;

/// Degree of the local polynomial: a parabola follows value, slope and curvature.
const DEGREE: usize = 2;

/// Expected squared errors of an estimate whose noise nobody has measured.
///
/// # Model
/// `G` is a parabola over `2 h + 1` bins; its errors are independent, with variances in proportion to those given (an
/// ETFE's: `1 / abs(U)^2`).
///
/// # Method
/// The squared residual per degree of freedom of a weighted local parabola, times the relative variance of the bin.
///
/// # Shapes
/// `[bins]`; NaN where the estimate is.
///
/// # Units
/// Those of the estimate, squared.
///
/// # Accuracy
/// `2 h - 2` complex degrees of freedom: a relative standard error of `1 / sqrt(2 h - 2)` per bin, 27 % for `h = 8`. Where
/// the response bends within the neighbourhood (a resonance narrower than about `2 h` bins) its lack of fit is counted
/// as noise: too large, never too small.
///
/// # Errors
/// As [`local_polynomial`].
///
/// # Source
/// Pintelon and Schoukens, System Identification, 2012, section 7.2.
pub fn neighbour_scatter(bins: Bins<'_>, half_width_bins: usize) -> Result<Vec<f64>, SpectrumError> {
    let settings = PolynomialSettings { degree: DEGREE, half_width_bins, adapt_sigma: None };
    let misfit = local_polynomial(bins, settings, &[])?.misfit;
    let defined = bins.transfer.iter().map(|value| value.re.is_finite());
    let scaled = bins.variance.iter().zip(misfit).zip(defined);
    Ok(scaled.map(|((relative, misfit), defined)| if defined { relative * misfit } else { f64::NAN }).collect())
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_scatter_of_neighbours_is_the_noise_whatever_the_input() {
        let (bins, half_width, seeds) = (400, 8, 30);
        let frequency_hz: Vec<f64> = (0..bins).map(|k| k as f64).collect();
        let (mut square, mut stated) = (0.0, 0.0);
        for seed in 0..seeds {
            // an input that varies tenfold from bin to bin, noise that rises over the band
            let power: Vec<f64> = white_noise(bins, 1.0, 3 * seed).iter().map(|x| 0.1 + x * x).collect();
            let (re, im) = (white_noise(bins, 1.0, 3 * seed + 1), white_noise(bins, 1.0, 3 * seed + 2));
            let level = |k: usize| 0.01 * (1.0 + k as f64 / 100.0);
            let error = |k: usize| Complex64::new(re[k], im[k]) * level(k) / (2.0 * power[k]).sqrt();
            let smooth = |k: usize| 1.0 / Complex64::new(1.0, k as f64 / 150.0);
            let transfer: Vec<Complex64> = (0..bins).map(|k| smooth(k) + error(k)).collect();
            let relative: Vec<f64> = power.iter().map(|power| 1.0 / power).collect();
            let given = Bins { frequency_hz: &frequency_hz, transfer: &transfer, variance: &relative };
            let variance = neighbour_scatter(given, half_width).unwrap();
            // each bin counts alike
            square += (0..bins).map(|k| error(k).norm_sqr() * power[k] / level(k).powi(2)).sum::<f64>();
            stated += (0..bins).map(|k| variance[k] * power[k] / level(k).powi(2)).sum::<f64>();
        }
        // 12000 squares: 1 %, the stated ones share them; the level's slope within a neighbourhood 1 %
        assert!((stated / square - 1.0).abs() < 0.04, "{}", stated / square);
    }
}

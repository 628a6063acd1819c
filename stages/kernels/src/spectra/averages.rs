//! How many spectra were averaged, from the scatter of the mean.

use crate::statistics::median_and_scale;

/// Bins between two values that are compared: those of a Hann window share noise over two.
const APART: usize = 4;
/// Fewer differences give no scatter.
const LEAST: usize = 32;

/// The number of independent spectra in the mean that a power density is.
///
/// # Model
/// Each value is the mean of `n` independent periodograms, so `2 n P / S` is chi-square with `2 n` degrees of freedom;
/// the density `S` is smooth over four bins almost everywhere.
///
/// # Method
/// The median absolute deviation of `ln P[k + 4] - ln P[k]`, whose variance is twice the trigamma function of `n`, taken
/// as `1/n + 1/(2 n^2)`.
///
/// # Shapes
/// `density`: one value per bin, positive.
///
/// # Units
/// Any; the number has none.
///
/// # Accuracy
/// Of `m` bins about `2.6 / sqrt(m)`, relative. Where `S` bends within four bins in most of the band, and where values
/// are printed in few digits, the number is wrong.
///
/// # Errors
/// None for fewer than 36 values, or for values that do not scatter or are not positive.
///
/// # Source
/// P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70, for the scatter of an average.
pub fn averages_by_scatter(density: &[f64]) -> Option<f64> {
    let mut differences: Vec<f64> = density.iter().zip(density.iter().skip(APART)).map(|(a, b)| (b / a).ln()).collect();
    if differences.len() < LEAST || differences.iter().any(|difference| !difference.is_finite()) {
        return None;
    }
    let (_, scale) = median_and_scale(&mut differences);
    let variance = 0.5 * scale * scale;
    let count = (1.0 + (1.0 + 2.0 * variance).sqrt()) / (2.0 * variance);
    count.is_finite().then_some(count.max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_number_of_averages_is_found_within_its_error() {
        let bins = 2000;
        for n in [8_u64, 64, 200] {
            // a periodogram of white noise is chi-square of two degrees of freedom
            let parts: Vec<Vec<f64>> = (0..2 * n).map(|seed| white_noise(bins, 1.0, seed)).collect();
            let slope = |k: usize| 1.0 / (1.0 + (k as f64 / 500.0).powi(2));
            let mean = |k: usize| parts.iter().map(|part| part[k] * part[k]).sum::<f64>() / (2 * n) as f64;
            let density: Vec<f64> = (0..bins).map(|k| slope(k) * mean(k)).collect();
            let found = averages_by_scatter(&density).unwrap();
            // three times 6 %
            assert!((found / n as f64 - 1.0).abs() < 0.18, "{n}: {found}");
        }
        assert_eq!(averages_by_scatter(&[1.0; 100]), None);
        assert_eq!(averages_by_scatter(&[1.0, 2.0]), None);
    }
}

//! Averages of spectra of several records.

use crate::spectra::error::SpectrumError;

/// One record's averaged periodogram: half-overlapping Hann segments.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordSpectrum {
    /// One-sided density.
    pub density: Vec<f64>,
    /// Segments averaged.
    pub segments: usize,
    /// Pairs of neighbouring segments that overlap by half: segments less stretches.
    pub pairs: usize,
}

/// The spectrum of all records.
#[derive(Debug, Clone, PartialEq)]
pub struct AveragedSpectrum {
    /// One-sided density, weighted by segments.
    pub density: Vec<f64>,
    /// Standard error if all is stationary: density over the square root of `averages`.
    pub standard_error: Vec<f64>,
    /// Standard error from the scatter between records; NaN for fewer than two.
    pub record_error: Vec<f64>,
    /// Independent spectra that the average is worth.
    pub averages: f64,
    /// Segments.
    pub segments: usize,
}

/// Squared correlation of two half-overlapping Hann segments' periodograms.
const HALF_OVERLAP: f64 = 1.0 / 36.0;

/// Averages the spectra of several records.
///
/// # Model
/// Each bin of a segment is exponentially distributed about the density; neighbours that overlap by half correlate by
/// 1/36 under a Hann window.
///
/// # Method
/// Weighted by segments. `S` segments with `P` overlapping pairs are worth `S^2 / (S + P / 18)` independent ones: twice
/// as many degrees of freedom. `record_error`: `sum w_r^2 (P_r - P)^2 / (1 - w_r)`, `w_r` a record's share of the
/// segments.
///
/// # Shapes
/// Every record has as many bins.
///
/// # Units
/// Those of the densities.
///
/// # Accuracy
/// Exact for stationary Gaussian noise whose density is flat over the window's width. The first two bins hold the
/// removed mean.
///
/// # Errors
/// No segment, or lengths that differ.
///
/// # Source
/// P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70; F. J. Harris, Proc. IEEE 66 (1978) 51.
pub fn average_spectra(records: &[RecordSpectrum]) -> Result<AveragedSpectrum, SpectrumError> {
    let segments: usize = records.iter().map(|r| r.segments).sum();
    let pairs: usize = records.iter().map(|r| r.pairs).sum();
    let Some(bins) = records.first().map(|r| r.density.len()).filter(|_| segments > 0) else {
        return Err(SpectrumError::TooShort { got: 0, wanted: 1 });
    };
    if let Some(other) = records.iter().find(|r| r.density.len() != bins) {
        return Err(SpectrumError::Lengths { name: "a record's density", got: other.density.len(), wanted: bins });
    }
    let total = segments as f64;
    let share = |r: &RecordSpectrum| r.segments as f64 / total;
    let density: Vec<f64> = (0..bins).map(|k| records.iter().map(|r| share(r) * r.density[k]).sum::<f64>()).collect();
    let averages = total * total / (total + 2.0 * pairs as f64 * HALF_OVERLAP);
    let several = records.iter().filter(|r| r.segments > 0).count() > 1;
    let record_error = (0..bins)
        .map(|k| {
            let square = |r: &RecordSpectrum| share(r).powi(2) * (r.density[k] - density[k]).powi(2) / (1.0 - share(r));
            let sum: f64 = records.iter().filter(|r| r.segments > 0).map(square).sum();
            if several { sum.sqrt() } else { f64::NAN }
        })
        .collect();
    let standard_error = density.iter().map(|p| p / averages.sqrt()).collect();
    Ok(AveragedSpectrum { density, standard_error, record_error, averages, segments })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;
    use crate::signal::{Detrend, Welch};

    #[test]
    fn both_errors_are_the_scatter_over_seeds() {
        let (seeds, stretches, samples) = (200, 6, 3 * 64);
        let (mut sum, mut square, mut stated, mut seen, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for seed in 0..seeds {
            let records: Vec<RecordSpectrum> = (0..stretches)
                .map(|record| {
                    let mut welch = Welch::new(64, 1.0, Detrend::Mean).unwrap();
                    welch.push(&white_noise(samples, 1.0, seed * 100 + record));
                    let average = welch.average().unwrap();
                    let pairs = average.segments - 1;
                    RecordSpectrum { density: average.density, segments: average.segments, pairs }
                })
                .collect();
            let got = average_spectra(&records).unwrap();
            // 5 segments and 4 pairs each
            assert!((got.averages - 900.0 / (30.0 + 48.0 / 36.0)).abs() < 1e-12 && got.segments == 30);
            for k in (4..30).step_by(3) {
                sum += got.density[k];
                square += (got.density[k] - 2.0).powi(2);
                stated += got.standard_error[k].powi(2);
                seen += got.record_error[k].powi(2);
                count += 1.0;
            }
        }
        // 1800 values, correlated by 1 % at three bins: mean 0.4 %, variances sqrt(2 / 1800) = 3.3 %; four of them
        assert!((sum / count / 2.0 - 1.0).abs() < 0.018, "{}", sum / count);
        // stated is of the estimate: E density^2 is 1 + 1 / averages above the square of the mean
        assert!(
            (square / stated - 1.0).abs() < 0.17 && (square / seen - 1.0).abs() < 0.17,
            "{} {}",
            square / stated,
            square / seen
        );
    }

    #[test]
    fn nothing_and_unequal_lengths_are_refused() {
        let record = |bins: usize, segments: usize| RecordSpectrum { density: vec![1.0; bins], segments, pairs: 0 };
        assert!(average_spectra(&[]).is_err() && average_spectra(&[record(4, 0)]).is_err());
        assert!(average_spectra(&[record(4, 1), record(5, 1)]).is_err());
        assert!(average_spectra(&[record(4, 1)]).unwrap().record_error.iter().all(|e| e.is_nan()));
    }
}

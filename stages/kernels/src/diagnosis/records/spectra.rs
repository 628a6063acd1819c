//! Hann periodograms of a record's stretches, at two lengths.

use std::ops::Range;

use crate::signal::{Detrend, Welch};

/// Mean periodogram of one record.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Samples in a window.
    pub length: usize,
    /// Windows averaged.
    pub windows: usize,
    /// One-sided density at the bins `k / (length dt)`, V^2/Hz, single precision.
    pub density: Vec<f32>,
}

/// The same stretches at two lengths: a line grows against its neighbours with the length, a resonance once resolved
/// does not.
#[derive(Debug, Clone, PartialEq)]
pub struct LineSpectra {
    /// A quarter of the long length.
    pub short: Spectrum,
    /// A power of two, at most 32768.
    pub long: Spectrum,
}

/// Longest and shortest long window. 32768 at 5 MS/s resolve 150 Hz: a fifth of the width of the paper's lowest mode.
const LENGTHS: (usize, usize) = (512, 1 << 15);

/// Spectra of those stretches of samples; none where they are too short. The length depends on the record's length
/// alone, so that all records of an archive have the same.
pub(super) fn line_spectra(samples: &[f64], stretches: &[Range<usize>], interval_s: f64) -> Option<LineSpectra> {
    // a random phase in each window: the longer the window, the weaker a line shows
    let sixth = (samples.len() / 6).max(1);
    let length = (1usize << sixth.ilog2()).min(LENGTHS.1);
    if length < LENGTHS.0 {
        return None;
    }
    let long = mean_periodogram(samples, stretches, length, interval_s)?;
    let short = mean_periodogram(samples, stretches, length / 4, interval_s)?;
    Some(LineSpectra { short, long })
}

/// Mean of half-overlapping Hann periodograms, each less its own straight line (P. D. Welch, IEEE Trans. Audio
/// Electroacoust. 15 (1967) 70).
fn mean_periodogram(samples: &[f64], stretches: &[Range<usize>], length: usize, interval_s: f64) -> Option<Spectrum> {
    let mut welch = Welch::new(length, 1.0 / interval_s, Detrend::Line).ok()?;
    for stretch in stretches {
        welch.push(samples.get(stretch.clone()).unwrap_or(&[]));
    }
    let average = welch.average().ok()?;
    let density = average.density.iter().map(|value| *value as f32).collect();
    Some(Spectrum { length, windows: average.segments, density })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_density_of_white_noise_is_twice_its_variance_times_the_interval() {
        let samples = white_noise(1 << 16, 0.5, 4);
        let spectra = line_spectra(&samples, std::slice::from_ref(&(0..40_000)), 1e-3).unwrap();
        for spectrum in [&spectra.short, &spectra.long] {
            let bins = &spectrum.density[4..spectrum.density.len() - 4];
            let mean = bins.iter().map(|&d| f64::from(d)).sum::<f64>() / bins.len() as f64;
            // 40000 samples: their variance is known to 0.7 %
            assert!((mean / (2.0 * 0.25 * 1e-3) - 1.0).abs() < 0.03, "{mean}");
        }
        assert_eq!((spectra.long.length, spectra.short.length), (8192, 2048));
    }

    #[test]
    fn a_stretch_too_short_or_with_gaps_gives_none() {
        let mut samples = white_noise(1 << 16, 0.5, 4);
        assert_eq!(line_spectra(&samples, std::slice::from_ref(&(0..4000)), 1e-3), None);
        samples.iter_mut().step_by(100).for_each(|value| *value = f64::NAN);
        assert_eq!(line_spectra(&samples, std::slice::from_ref(&(0..40_000)), 1e-3), None);
    }
}

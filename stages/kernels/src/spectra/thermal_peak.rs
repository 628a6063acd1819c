//! The thermal peak of one mode, cut out of a spectrum with others.

use super::error::SpectrumError;
use super::presence::Presence;
use super::thermal_fit::{AveragedDensity, ThermalFit, ThermalFitSettings, thermal_fit};

/// Where a peak is sought and how much of the spectrum round it is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakSearch {
    /// The peak lies above this, Hz.
    pub lowest_hz: f64,
    /// The peak lies below this, Hz.
    pub highest_hz: f64,
    /// The fit reaches from `f1 / band` to `f1 * band`.
    pub band: f64,
}

/// Probability that a spectrum without lines loses a bin to the search for lines: once in a thousand records.
const LINE_FALSE_ALARM: f64 = 1e-3;
/// First and last bins of a spectrum that are left out: the removed mean with its leakage, the fold.
const EDGE: usize = 4;

/// Fits the peak that stands out most against 1/f between the limits.
///
/// # Model
/// That of [`thermal_fit`] from `f1 / band` to `f1 * band`: other modes are far off.
/// # Method
/// The largest `f P(f)` after a running mean of five bins is `f1`; then [`thermal_fit`].
/// # Shapes
/// The whole spectrum from frequency 0 on.
/// # Accuracy
/// As [`thermal_fit`].
/// # Errors
/// No bin between the limits, fewer than 24 bins round the peak, no convergence.
pub fn thermal_peak(spectrum: AveragedDensity<'_>, search: PeakSearch) -> Result<ThermalFit, SpectrumError> {
    let PeakSearch { lowest_hz, highest_hz, band } = search;
    let near_hz = strongest(spectrum, search).ok_or(SpectrumError::NoPeak { lowest_hz, highest_hz })?;
    let f = spectrum.frequency_hz;
    let last = f.len().saturating_sub(EDGE);
    let to = f.partition_point(|f| *f <= near_hz * band).min(last);
    let from = f.partition_point(|f| *f < near_hz / band).clamp(EDGE.min(to), to);
    let cut = AveragedDensity { frequency_hz: &f[from..to], density: &spectrum.density[from..to], ..spectrum };
    thermal_fit(
        cut,
        ThermalFitSettings {
            lowest_hz,
            highest_hz: Some(highest_hz),
            line_false_alarm: LINE_FALSE_ALARM,
            flicker: Presence::Auto,
        },
    )
}

fn strongest(spectrum: AveragedDensity<'_>, search: PeakSearch) -> Option<f64> {
    let AveragedDensity { frequency_hz: f, density, .. } = spectrum;
    let smooth = |k: usize| density.get(k.saturating_sub(2)..k + 3).map_or(0.0, |five| five.iter().sum());
    (1..f.len().min(density.len()))
        .filter(|&k| f[k] > search.lowest_hz && f[k] < search.highest_hz)
        .max_by(|&a, &b| (f[a] * smooth(a)).total_cmp(&(f[b] * smooth(b))))
        .map(|k| f[k])
}

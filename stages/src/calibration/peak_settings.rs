//! Parameters that state where the thermal peak of mode 1 lies.

use afmid_pipeline::Faults;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use afmid_kernels::signal::AveragedPeriodogram;
use afmid_kernels::spectra::{AveragedDensity, PeakSearch, SeenThrough, SpectrumError, ThermalFit, thermal_peak};

/// Where the thermal peak is sought and how it is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PeakSettings {
    /// Samples per segment of the spectra, even. Why: bins of 305 Hz at 5 MS/s, a quarter of the paper's peak.
    #[schemars(range(min = 256, max = 4_194_304))]
    pub segment_samples: usize,
    /// The peak lies above this, in Hz.
    #[schemars(range(min = 0.0))]
    pub lowest_hz: f64,
    /// The peak lies below this, in Hz, above `lowest_hz`. Why: below the paper's mode 2.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub highest_hz: f64,
    /// The fit reaches from `f1 / band` to `f1 band`. Why: enough of both flanks for white and 1/f noise, mode 2 far
    /// off.
    #[schemars(range(min = 1.1, max = 10.0))]
    pub band: f64,
}

/// Standard errors by which the variance of a lower peak is above that of a higher one. Why: chance does that once in thirty
/// thousand spectra.
const LEAST_DISTANCE: f64 = 4.0;
/// Quality factor of a lower peak: what 1/f noise is fitted by has less than one, a lever in water two.
const LEAST_QUALITY: f64 = 1.5;

impl Default for PeakSettings {
    fn default() -> Self {
        Self { segment_samples: 16_384, lowest_hz: 10e3, highest_hz: 150e3, band: 2.5 }
    }
}

impl PeakSettings {
    pub(super) fn check(&self, faults: &mut Faults) {
        let (samples, lowest, highest) = (self.segment_samples, self.lowest_hz, self.highest_hz);
        faults.require(samples.is_multiple_of(2), || {
            format!("`peak.segment_samples` is {samples}, wanted an even number")
        });
        faults.require(highest > lowest, || {
            format!("`peak.highest_hz` is {highest}, wanted above `peak.lowest_hz`, {lowest}")
        });
    }

    /// Of the peaks in an averaged spectrum that of mode 1: by equipartition it has the most variance, a higher mode stands
    /// out more against 1/f. Errors: no peak, or no fit.
    pub(super) fn fit_first_mode(&self, spectrum: &AveragedPeriodogram) -> Result<ThermalFit, SpectrumError> {
        let mut first = self.fit(spectrum)?;
        loop {
            let below = Self { highest_hz: first.frequency_hz.value / self.band, ..*self };
            if below.highest_hz <= below.lowest_hz {
                return Ok(first);
            }
            let Ok(lower) = below.fit(spectrum) else { return Ok(first) };
            let (gain, std) =
                (lower.variance.value - first.variance.value, lower.variance.std.hypot(first.variance.std));
            if !(gain > LEAST_DISTANCE * std && lower.quality_factor.value > LEAST_QUALITY) {
                return Ok(first);
            }
            first = lower;
        }
    }

    /// The peak that stands out most in an averaged spectrum. Errors: none, or no fit.
    pub(super) fn fit(&self, spectrum: &AveragedPeriodogram) -> Result<ThermalFit, SpectrumError> {
        let density = AveragedDensity {
            frequency_hz: &spectrum.frequency_hz(),
            density: &spectrum.density,
            averages: spectrum.independent_segments(),
            through: Some(SeenThrough::Hann),
        };
        thermal_peak(density, PeakSearch { lowest_hz: self.lowest_hz, highest_hz: self.highest_hz, band: self.band })
    }
}

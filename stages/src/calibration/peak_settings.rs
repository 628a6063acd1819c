//! Parameters that state where the thermal peak of mode 1 lies.

use afmid_pipeline::StageError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::reading::within;
use afmid_kernels::calibration::AveragedPeriodogram;
use afmid_kernels::spectra::{AveragedDensity, PeakSearch, SeenThrough, SpectrumError, ThermalFit, thermal_peak};

/// Where the thermal peak is sought and how it is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PeakSettings {
    /// Samples per segment of the spectra, even. Default: 16384: bins of 305 Hz at 5 MS/s, a quarter of the paper's
    /// peak.
    #[schemars(range(min = 256, max = 4_194_304))]
    pub segment_samples: usize,
    /// The peak lies above this, in Hz. Default: 10e3.
    pub lowest_hz: f64,
    /// The peak lies below this, in Hz, above `lowest_hz`. Default: 150e3: below the paper's mode 2.
    pub highest_hz: f64,
    /// The fit reaches from `f1 / band` to `f1 band`. Default: 2.5: enough of both flanks for white and 1/f noise, mode
    /// 2 far off.
    #[schemars(range(min = 1.1, max = 10.0))]
    pub band: f64,
}

impl Default for PeakSettings {
    fn default() -> Self {
        Self { segment_samples: 16_384, lowest_hz: 10e3, highest_hz: 150e3, band: 2.5 }
    }
}

impl PeakSettings {
    pub(super) fn check(&self) -> Result<(), StageError> {
        within("peak.segment_samples", self.segment_samples as f64, 256.0, 4_194_304.0)?;
        if self.segment_samples % 2 == 1 {
            return Err(StageError::new(format!(
                "`peak.segment_samples` is {}, wanted an even number",
                self.segment_samples
            )));
        }
        within("peak.lowest_hz", self.lowest_hz, 0.0, 1e12)?;
        within("peak.highest_hz", self.highest_hz, self.lowest_hz, 1e12)?;
        within("peak.band", self.band, 1.1, 10.0)
    }

    /// The peak in an averaged spectrum. Errors: none, or no fit.
    pub(super) fn fit(&self, spectrum: &AveragedPeriodogram) -> Result<ThermalFit, SpectrumError> {
        let density = AveragedDensity {
            frequency_hz: &spectrum.frequency_hz(),
            density: &spectrum.density_v2_per_hz,
            averages: spectrum.independent_segments(),
            through: Some(SeenThrough::Hann),
        };
        thermal_peak(density, PeakSearch { lowest_hz: self.lowest_hz, highest_hz: self.highest_hz, band: self.band })
    }
}

//! Calibration and noise control: sensitivity, spring constant, delay, thermal spectra.
//!
//! [`Blocks`] reduce a record to levels and slopes; [`free_stretches`] finds where the lever is at rest; [`contact_slope`] and
//! [`sensitivity`] give the optical lever sensitivity, [`Welch`], [`thermal_peak`] and [`spring_constant`] the stiffness,
//! [`stability`] says whether either changed, [`onset_delay`] what is known of the delay.

mod blocks;
mod chi_square;
mod contact_slope;
mod delay;
mod error;
mod example;
mod free_rule;
mod free_stretches;
mod half_sample_mode;
mod onset_delay;
mod peak_settings;
pub(crate) mod reading;
mod sensitivity;
mod sensitivity_model;
mod spring_constant;
mod stability;
mod stiffness;
mod thermal;
mod thermal_peak;
mod welch;

#[cfg(test)]
mod stage_tests;
#[cfg(test)]
mod tests;

pub use blocks::Blocks;
pub use chi_square::{chi_square_tail, gamma_tail, normal_two_sided};
pub use contact_slope::{ContactSlope, SlopeStretch, contact_slope, contact_stretches};
pub use delay::Delay;
pub use error::CalibrationError;
pub(crate) use example::free_records;
pub use free_rule::FreeSettings;
pub use free_stretches::{FreeRule, FreeStretches, free_stretches};
pub use half_sample_mode::{half_sample_mode, median};
pub use onset_delay::{OnsetDelay, OnsetRule, onset_delay};
pub use peak_settings::PeakSettings;
pub use sensitivity::{SensitivitySummary, SlopeSensitivity};
pub use sensitivity_model::{Estimate, Sensitivity, SlopeGauge, sensitivity};
pub use spring_constant::{SpringConstant, ThermalGauge, UNIFORM_BEAM_FACTOR, ringdown_s, spring_constant};
pub use stability::{Stability, stability};
pub use stiffness::{RelativeErrors, StiffnessSummary, ThermalStiffness};
pub use thermal::Thermal;
pub(crate) use thermal_peak::inverse;
pub use thermal_peak::{PeakSearch, ThermalPeak, thermal_peak};
pub use welch::{AveragedPeriodogram, Welch};

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] =
    &[Entry::of::<Delay>(), Entry::of::<SlopeSensitivity>(), Entry::of::<ThermalStiffness>(), Entry::of::<Thermal>()];

//! Calibration and noise control: sensitivity, spring constant, delay, thermal spectra.
//!
//! [`Blocks`] reduce a record to levels and slopes; [`free_stretches`] finds where the lever is at rest; [`contact_slope`] and
//! [`sensitivity`] give the optical lever sensitivity, [`spring_constant`] the stiffness from the thermal peak that
//! [`crate::spectra::thermal_peak`] fits,
//! [`stability`] says whether either changed, [`onset_delay`] what is known of the delay.

mod blocks;
mod contact_slope;
mod error;
mod free_stretches;
mod onset_delay;
mod sensitivity_model;
mod spring_constant;
mod stability;
#[cfg(test)]
mod tests;

pub use blocks::Blocks;
pub use contact_slope::{ContactSlope, SlopeStretch, contact_slope, contact_stretches};
pub use error::CalibrationError;
pub use free_stretches::{FreeRule, FreeStretches, free_stretches};
pub use onset_delay::{OnsetDelay, OnsetRule, onset_delay};
pub use sensitivity_model::{Estimate, Sensitivity, SlopeGauge, sensitivity};
pub use spring_constant::{SpringConstant, ThermalGauge, UNIFORM_BEAM_FACTOR, ringdown_s, spring_constant};
pub use stability::{Stability, stability};

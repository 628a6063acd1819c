//! Calibration and noise control: sensitivity, spring constant, delay, thermal spectra.
//!
//! [`Blocks`] reduce a record to levels and slopes; [`free_stretches`] finds where the lever is at rest; [`contact_slope`] and
//! [`sensitivity`] give the optical lever sensitivity, [`spring_constant`] the stiffness from the thermal peak that
//! [`crate::spectra::thermal_peak`] fits,
//! [`stability`] says whether either changed, [`onset_delay`] what is known of the delay.
//!
//! ```
//! use afmid_kernels::calibration::{
//!     Blocks, Estimate, FreeRule, SlopeGauge, contact_slope, contact_stretches, free_stretches, sensitivity,
//! };
//! // two records: free for 32,000 samples, then pressed on while the piezo falls by 2 V; -0.5 V per volt, with noise
//! let noise = |k: usize| 1e-3 * ((k * k) as f64).sin();
//! let piezo: Vec<f64> = (0..64_000).map(|k| 5.0 - 4.0 * k as f64 / 64_000.0).collect();
//! let mut stretches = Vec::new();
//! for record in 0..2 {
//!     let pressed = |k: usize| (3.0 - piezo[k]).max(0.0) * 0.5;
//!     let deflection: Vec<f64> = (0..64_000).map(|k| pressed(k) + noise(k + 70_001 * record)).collect();
//!     let mut blocks = Blocks::new(64);
//!     blocks.push(&deflection, &piezo);
//!     let rule = FreeRule { settle_samples: 640, guard_samples: 640, shortest_samples: 6400 };
//!     stretches.extend(contact_stretches(&blocks, &free_stretches(&blocks, rule)?)?);
//! }
//! let gauge = SlopeGauge {
//!     piezo_m_per_v: Estimate { value: 30e-9, std: 0.3e-9 },
//!     contact_stiffness_n_per_m: None,
//!     stiffness_n_per_m: None,
//! };
//! let found = sensitivity(&contact_slope(&stretches)?, gauge)?.corrected_v_per_m;
//! // 0.5 over 30 nm, of which the piezo is known to 1 %
//! assert!((found.value - 0.5 / 30e-9).abs() < 3.0 * found.std && (found.std / found.value - 0.01).abs() < 1e-3);
//! # Ok::<(), afmid_kernels::calibration::CalibrationError>(())
//! ```

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

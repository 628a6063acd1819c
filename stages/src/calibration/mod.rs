//! The stages of calibration and noise control: sensitivity, spring constant, delay, thermal spectra. Kernels:
//! [`afmid_kernels::calibration`].

mod contact_spring;
mod delay;
mod example;
mod free_rule;
mod peak_settings;
pub(crate) mod reading;
mod sensitivity;
mod stiffness;
mod thermal;

#[cfg(test)]
mod stage_tests;
pub use contact_spring::ContactSpring;
pub use delay::Delay;
pub(crate) use example::free_records;
pub use free_rule::FreeSettings;
pub use peak_settings::PeakSettings;
pub use sensitivity::{SensitivitySummary, SlopeSensitivity};
pub use stiffness::{RelativeErrors, StiffnessSummary, ThermalStiffness};
pub use thermal::Thermal;

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] =
    &[Entry::of::<Delay>(), Entry::of::<SlopeSensitivity>(), Entry::of::<ThermalStiffness>(), Entry::of::<Thermal>()];

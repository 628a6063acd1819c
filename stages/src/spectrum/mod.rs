//! The stages of parameter-free estimates: windows, periodograms, ETFE, smoothing. Kernels: [`afmid_kernels::spectra`].

mod etfe;
mod example;
mod frf;
mod frf_example;
mod joined;
mod measured_example;
mod measured_frf;
mod periodogram;
mod smoothing;
mod thermal;
mod thermal_example;
mod welch;
mod window;

#[cfg(test)]
mod chain_tests;
#[cfg(test)]
mod columns_tests;
#[cfg(test)]
mod measured_frf_tests;
pub use etfe::Etfe;
pub use frf::Frf;
pub use measured_frf::{BlocksAre, EstimatorIs, MeasuredFrf};
pub use periodogram::Periodogram;
pub use smoothing::{Smoothing, SmoothingMethod};
pub use thermal::{SpectrumWindow, Thermal};
pub use welch::Welch;
pub use window::Window;

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] = &[
    Entry::of::<Window>(),
    Entry::of::<Periodogram>(),
    Entry::of::<Etfe>(),
    Entry::of::<Frf>(),
    Entry::of::<MeasuredFrf>(),
    Entry::of::<Smoothing>(),
    Entry::of::<Thermal>(),
    Entry::of::<Welch>(),
];

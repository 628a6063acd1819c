//! The stage that finds snap-offs and snaps to contact. Kernels: [`afmid_kernels::events`].

mod correlation;
mod example;
mod extraction;
mod listing;
mod segments;
mod window;

#[cfg(test)]
mod archive_tests;
pub use correlation::Correlation;
pub use extraction::{Extraction, ExtractionSettings, Found, Refused, extract};
pub use window::{EventWindow, WindowSettings, Windows, cut_windows, quality_outliers};

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] = &[Entry::of::<Correlation>()];
#[cfg(test)]
#[path = "../../kernels/src/events/curves.rs"]
pub(crate) mod curves;

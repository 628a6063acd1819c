//! The stages that find snap-offs, snaps to contact and free decays. Kernels: [`afmid_kernels::events`].

mod correlation;
mod decay;
pub(crate) mod decay_example;
mod decay_rows;
mod example;
mod extraction;
mod listing;
mod segments;
mod window;

#[cfg(test)]
mod archive_tests;
pub use correlation::Correlation;
pub(crate) use decay::DECAYS;
pub use decay::{Decay, RecordsAre};
pub use extraction::{Extraction, ExtractionSettings, Found, Refused, extract};
pub use window::{EventWindow, WindowSettings, Windows, cut_windows, quality_outliers};

use afmid_pipeline::Entry;

/// The stages of this domain.
pub const STAGES: &[Entry] = &[Entry::of::<Correlation>(), Entry::of::<Decay>()];
#[cfg(test)]
#[path = "../../kernels/src/events/curves.rs"]
pub(crate) mod curves;

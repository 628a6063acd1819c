//! Event extraction: snap-off and snap-to-contact.

use afmid_pipeline::Entry;

mod block_means;
mod correlation;
mod correlation_averaging;
mod cross_correlation;
mod despike;
mod detection;
mod example;
mod extraction;
mod fractional_shift;
mod level_change;
mod listing;
mod onset;
mod saturation;
mod segments;
mod shift_refinement;
mod window;

pub use block_means::{BlockMeans, Sample};
pub use correlation::Correlation;
pub use correlation_averaging::{Aligned, Averaging, AveragingSettings, Misfit, correlation_average};
pub use cross_correlation::{CrossCorrelator, Match};
pub use despike::despike;
pub use detection::{Candidate, Detection, DetectionSettings, Dismissal, Dismissed, EventKind, detect};
pub use extraction::{Extraction, ExtractionSettings, Found, Refused, extract};
pub use fractional_shift::{REACH, band_limited_derivative, fractional_shift};
pub use level_change::{LevelChange, level_change};
pub use onset::{Baseline, Onset, baseline, first_sustained_departure};
pub use saturation::saturated_samples;
pub use shift_refinement::{Refined, refine_shift};
pub use window::{EventWindow, WindowSettings, Windows, cut_windows, quality_outliers};

/// The stages of this domain.
pub const STAGES: &[Entry] = &[Entry::of::<Correlation>()];

#[cfg(test)]
mod archive_tests;
#[cfg(test)]
pub(crate) mod curves;

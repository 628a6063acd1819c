//! Event extraction: snap-off and snap-to-contact; free decays in [`decay`].

mod block_means;
mod correlation_averaging;
mod cross_correlation;
pub mod decay;
mod despike;
mod detection;
mod fractional_shift;
mod kind;
mod level_change;
mod onset;
mod saturation;
mod shift_refinement;

pub use block_means::{BlockMeans, Sample};
pub use correlation_averaging::{Aligned, Averaging, AveragingSettings, Misfit, correlation_average};
pub use cross_correlation::{CrossCorrelator, Match};
pub use despike::despike;
pub use detection::{Candidate, Detection, DetectionSettings, Dismissal, Dismissed, detect};
pub(crate) use fractional_shift::interpolation_weights;
pub use fractional_shift::{REACH, band_limited_derivative, fractional_shift};
pub use kind::EventKind;
pub use level_change::{LevelChange, level_change};
pub use onset::{Baseline, Onset, baseline, first_sustained_departure};
pub use saturation::saturated_samples;
pub use shift_refinement::{Refined, refine_shift};

#[cfg(test)]
pub(crate) mod curves;

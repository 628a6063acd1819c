//! Event extraction: snap-off and snap-to-contact; free decays in [`decay`].
//!
//! ```
//! use afmid_kernels::events::first_sustained_departure;
//! // a line with a drift and noise, from sample 700 on a release
//! let step = |k: usize| if k < 700 { 0.0 } else { 0.5 * (1.0 - (-((k - 699) as f64) / 3.0).exp()) };
//! let y: Vec<f64> = (0..1024).map(|k| 1e-5 * k as f64 + step(k) + 1e-3 * ((k * k) as f64).sin()).collect();
//! // the first of three samples in a row that are five standard deviations off the line of the 300 samples before
//! let onset = first_sustained_departure(&y, 500..1000, 300, 5.0, 3, 0.0).ok_or("nothing departs")?;
//! assert_eq!(onset.index, 700);
//! // 1e-3 times a sine
//! assert!((onset.baseline.noise_std - 0.7e-3).abs() < 0.1e-3);
//! # Ok::<(), &str>(())
//! ```

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
pub use saturation::{saturated_ends, saturated_samples};
pub use shift_refinement::{Refined, refine_shift};

#[cfg(test)]
pub(crate) mod curves;

//! Averages over aligned events, and what their spread says.
//!
//! An ensemble is a row-major array `[event, time]`: every row one event, aligned so that the release (or the snap)
//! lies on the same sample. The rows differ by an amplitude (adhesion scatters by 6 to 30 %), by an offset (records
//! wander by millivolts) and by the slope with which the piezo loads the lever; what is left is noise, and only this
//! enters standard errors.

use afmid_pipeline::Entry;

mod average;
mod drift;
mod error;
pub(crate) mod example;
mod gram;
mod moments;
mod rows;
mod scatter;
mod shape_drift;
mod split;

pub use average::Average;
pub use drift::Drift;
pub use error::EnsembleError;
pub use moments::{Moments, moments};
pub use rows::Rows;
pub use scatter::{Scatter, scatter};
pub use shape_drift::{DriftSettings, ShapeDrift, SubEnsemble, shape_drift};
pub use split::{LEAST_EVENTS, Split, split_halves};

/// The stages of this domain.
pub const STAGES: &[Entry] = &[Entry::of::<Average>(), Entry::of::<Drift>()];

#[cfg(test)]
mod streaming_tests;

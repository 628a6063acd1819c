//! The whole-record channels of a diagnosis: what shows in the records themselves, before any ringdown is fitted.
//!
//! [`summarise`] reduces one record at a time to a small [`RecordSummary`]; [`judge`] looks at all of them and returns a [`RecordSign`] per cause
//! found: `clipping` from the histogram of the extreme values, `mains-hum` and slow lines from a regression over the
//! whole record, faster lines (`spurious-line`) from periodograms of the free stretches, `piezo-crosstalk`,
//! `interference-fringe` and `ac-coupling` from the free level against the piezo's position and what was measured
//! before. Noise is never assumed white: records are the replicates, neighbouring frequencies the yardstick.

mod basis;
mod clipping;
mod crosstalk;
mod droop;
mod error;
mod extremes;
mod free_level;
mod fringe;
mod fringe_fit;
mod judge;
mod lines;
mod points;
mod position;
mod position_course;
mod replicates;
mod segments;
mod sign;
mod slow_lines;
mod slow_regression;
mod spectra;
mod summary;
mod yardstick;

pub use droop::without_droop;
pub use error::RecordError;
pub use extremes::{Extremes, Tally};
pub use judge::{Begun, CHANNELS, JudgeOptions, Resonance, abstentions, judge};
pub use position_course::PositionCourse;
pub use segments::{Segment, SegmentKind};
pub use sign::{Abstention, RecordSign};
pub use spectra::{LineSpectra, Spectrum};
pub use summary::{RecordEvent, RecordInput, RecordSummary, summarise};

#[cfg(test)]
mod archive;
#[cfg(test)]
mod calibration_tests;

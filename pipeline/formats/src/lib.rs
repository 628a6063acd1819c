//! Readers of recorded files that are not afmid's own: what data acquisition programs, microscopes and numerical
//! programs write.
//!
//! [`recognise`] finds the format of a file, [`Known::open`] reads everything of it but the samples, and each channel's
//! [`Source`] reads any stretch of these. Nothing here knows physics, HDF5 or the rest of afmid.

mod archive;
mod axes;
mod budget;
mod calendar;
mod columnar;
mod evenness;
mod facts;
mod fail;
mod fields;
mod frequency;
mod grid;
mod guess;
mod half;
mod inflating;
mod joined;
mod labels;
mod lanes;
mod listing;
mod measurement;
mod number;
mod opened;
mod packed;
mod pinned;
mod printed;
mod rate;
mod raw;
pub mod readers;
mod regular;
mod resample;
mod responses;
mod straight;
mod text;
mod time_units;
mod together;

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use axes::{contradiction, mean_rate, settle as settle_axes};
pub use budget::most_inflated;
pub use evenness::even_step;
pub use facts::is_fact;
pub use frequency::hertz;
pub use grid::numbers_in_file;
pub use labels::{Labels, lane_names};
pub use lanes::Lanes;
pub use measurement::{joined, names_of_files, put_together};
pub use number::Number;
pub use rate::{
    Clue, LEAST_RATE_HZ, MOST_RATE_HZ, WANTED_RATE, agreed_rate, agreed_start, brief_number, is_rate, one_number,
    rate_in, rates_agree, start_in, unit_names,
};
pub use raw::Raw;
pub use readers::raw_binary::{RawBinary, SampleType};
pub use readers::{HEAD_BYTES, Known, formats, head_of, recognise};
pub use regular::{append_regular, open_regular, read_regular};
pub use resample::is_of_resampling;
pub use responses::{
    Degree, FoundResponse, Frequencies, Parts, gains_without_phase, responses, says_frequencies, unit_ratio,
};
pub use time_units::{names_times, seconds};
pub use together::{begun_together, one_rate};

/// Where a channel's samples come from: any stretch can be read, again and again, from several threads.
///
/// Holds no open file between reads; reads no more than it is asked for (plus, for compressed data, what that takes).
pub trait Source: std::fmt::Debug + Send + Sync {
    /// Reads `count` raw samples from sample `start`. Errors: beyond the end; the file cannot be read, is damaged, or
    /// has changed its size since it was opened.
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError>;

    /// The stretch that is cheapest to read at once (a storage chunk).
    fn preferred_samples(&self) -> usize {
        1 << 16
    }

    /// Bytes that it keeps in memory, or will once it has been read: parsed text, inflated data.
    fn kept_bytes(&self) -> u64 {
        0
    }

    /// Whether a stretch costs what its bytes cost, however often it is asked for: nothing to inflate, to parse or to
    /// search.
    fn is_direct(&self) -> bool {
        false
    }
}

/// A channel of a file.
#[derive(Debug, Clone)]
pub struct FoundChannel {
    /// How it is asked for: `/Group/Channel`, a variable's name, a column's.
    pub location: String,
    /// Number of samples.
    pub samples: usize,
    /// Unit of the values; empty if the file states none.
    pub unit: String,
    /// What it is, for people.
    pub long_name: String,
    /// Samples per second; none if the file does not say.
    pub sample_rate_hz: Option<f64>,
    /// Standard error of that rate, relative: of times and intervals that are rounded or that jitter; 0 where it is stated.
    pub rate_relative_std: f64,
    /// Whether the rate follows from times, an interval or a rate without a unit, which were taken as seconds or hertz.
    pub rate_is_guess: bool,
    /// When the first sample was taken, in seconds on the clock of the file's other channels; none if the file does not
    /// say.
    pub start_s: Option<f64>,
    /// value = stored * scale_factor + add_offset. Scalings that are no straight line are applied by the source, which
    /// then gives `Float64`, and these are 1 and 0.
    pub scale_factor: f64,
    /// See `scale_factor`.
    pub add_offset: f64,
    /// The stored code that marks a missing sample, if the file declares one.
    pub fill_code: Option<f64>,
    /// Samples before which the recording was interrupted: a restart, a lost buffer. Ascending.
    pub gaps: Vec<usize>,
    /// Whether it is an axis (times, frequencies, a counter) and no signal.
    pub is_axis: bool,
    /// Type of the stored samples, for people: `int16`, `float64`.
    pub stored_as: &'static str,
    /// Where the samples come from.
    pub source: Arc<dyn Source>,
}

impl FoundChannel {
    /// A channel that is described by nothing but its name: no unit, no rate, values as they are stored.
    pub fn new(location: impl Into<String>, samples: usize, stored_as: &'static str, source: Arc<dyn Source>) -> Self {
        Self {
            location: location.into(),
            samples,
            unit: String::new(),
            long_name: String::new(),
            sample_rate_hz: None,
            rate_relative_std: 0.0,
            rate_is_guess: false,
            start_s: None,
            scale_factor: 1.0,
            add_offset: 0.0,
            fill_code: None,
            gaps: Vec::new(),
            is_axis: false,
            stored_as,
            source,
        }
    }
}

/// What a file holds.
#[derive(Debug, Clone)]
pub struct Contents {
    /// The format with its version, for people: `NI TDMS 2.0 (4713), little-endian`.
    pub format: String,
    /// When the acquisition began, ISO 8601; empty if unknown.
    pub started_at: String,
    /// Its channels of numbers, in the file's order.
    pub channels: Vec<FoundChannel>,
    /// Its frequency responses that are stored as complex numbers, in the file's order.
    pub responses: Vec<FoundResponse>,
    /// Whatever a user should know: parts that are no channel of numbers and why, missing metadata, a truncated end.
    pub remarks: Vec<String>,
}

/// Why a file, or a part of it, cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{problem}{}{}", at_byte.map(|byte| format!(", at byte {byte}")).unwrap_or_default(), file.as_ref().map(|file| format!(" ({})", file.display())).unwrap_or_default())]
pub struct FormatError {
    /// The file, where it is known.
    pub file: Option<PathBuf>,
    /// Byte in the file where it was seen, if that is known.
    pub at_byte: Option<u64>,
    /// What was found and what was wanted, in one sentence, without a full stop.
    pub problem: String,
    /// What to do about it, if there is something to do.
    pub help: Option<String>,
}

impl FormatError {
    /// An error that belongs to no byte.
    pub fn new(problem: impl Into<String>, help: impl Into<String>) -> Self {
        fail::plain(problem, help)
    }

    /// Names the file that it is about, unless one is named already.
    #[must_use]
    pub fn in_file(mut self, file: &Path) -> Self {
        self.file.get_or_insert_with(|| file.to_owned());
        self
    }
}

/// The description of a format, to people and to programs: its only description, from which the registry, the fuzz
/// targets and the table in docs/archives.md are made.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// How it is asked for (`format = "tdms"`), and the name of its fuzz target and corpus.
    pub name: &'static str,
    /// What it is, for people.
    pub title: &'static str,
    /// What of it is read.
    pub reads: &'static str,
    /// What is refused or left out.
    pub leaves_out: &'static str,
    /// Who describes it.
    pub described_by: &'static str,
    /// Where a file of it can state rate and times; empty if it cannot.
    pub clock: &'static str,
    /// Where a file of it can state the unit of its values; empty if it cannot.
    pub unit: &'static str,
}

/// What every format's module offers.
pub trait Format {
    /// Its description.
    const ROW: Row;
    /// Whether a file's first bytes (up to [`HEAD_BYTES`]) and its name say that it is of this format.
    fn recognises(head: &[u8], path: &Path) -> bool;
    /// Opens it: everything but the samples. Errors: no such file, not of this format, damaged.
    fn open(path: &Path) -> Result<Contents, FormatError>;
}

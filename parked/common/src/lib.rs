//! What a file of recorded samples holds, whatever its format. In the real project these types live in `afmid_pipeline::recording`.

use std::path::Path;
use std::sync::Arc;

/// Raw samples of one stretch, as stored.
#[derive(Debug, Clone, PartialEq)]
pub enum Raw {
    /// 16-bit codes (8-bit ones are widened).
    Int16(Vec<i16>),
    /// 32-bit codes (unsigned 16-bit ones are widened).
    Int32(Vec<i32>),
    /// Single precision.
    Float32(Vec<f32>),
    /// Double precision (unsigned 32-bit and 64-bit codes as well).
    Float64(Vec<f64>),
}

/// Where a channel's samples come from: any stretch can be read, again and again, from several threads.
///
/// Holds no open file between reads; reads no more than it is asked for (plus, for compressed data, what that takes).
pub trait Source: std::fmt::Debug + Send + Sync {
    /// Reads `count` raw samples from sample `start`. Errors: beyond the end; the file cannot be read, is damaged, or has changed its size since it was opened.
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError>;

    /// The stretch that is cheapest to read at once.
    fn preferred_samples(&self) -> usize {
        1 << 16
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
    /// value = stored * scale_factor + add_offset. Scalings that are no straight line are applied by the source, which then gives `Float64`, and these are 1 and 0.
    pub scale_factor: f64,
    /// See `scale_factor`.
    pub add_offset: f64,
    /// The stored code that marks a missing sample, if the file declares one.
    pub fill_code: Option<f64>,
    /// Samples before which the recording was interrupted: a restart, a lost buffer. Ascending.
    pub gaps: Vec<usize>,
    /// Type of the stored samples, for people: `int16`, `float64`.
    pub stored_as: &'static str,
    /// Where the samples come from.
    pub source: Arc<dyn Source>,
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
    /// Whatever a user should know: parts that are no channel of numbers and why, missing metadata, a truncated end.
    pub remarks: Vec<String>,
}

/// Why a file, or a part of it, cannot be read.
#[derive(Debug, Clone, PartialEq)]
pub struct FormatError {
    /// Byte in the file where it was seen, if that is known.
    pub at_byte: Option<u64>,
    /// What was found and what was wanted, in one sentence, without a full stop.
    pub problem: String,
    /// What to do about it, if there is something to do.
    pub help: Option<String>,
}

/// What every format's module offers.
pub trait Format {
    /// Whether a file's first bytes (up to 4096) and its name say that it is of this format.
    fn recognises(head: &[u8], path: &Path) -> bool;
    /// Opens it: everything but the samples. Errors: no such file, not of this format, damaged.
    fn open(path: &Path) -> Result<Contents, FormatError>;
}

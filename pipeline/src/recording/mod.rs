//! Recordings: lazy, re-readable record files. They are streamed, never held whole.

mod chunk;
mod global_heap;
mod hash;
mod native;
mod recent;
mod series;
mod source;
mod stamps;
mod write;

#[cfg(test)]
mod foreign_tests;
#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::sync::Arc;

pub use hash::hash_file;
pub(crate) use native::is_native;
pub use native::{Wanted, open_native};
pub use series::{read_number_attribute, read_series};
pub(crate) use source::DeferredSource;
pub(crate) use stamps::keep_in as keep_stamps_in;
pub use write::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};

use crate::error::StageError;

/// An ordered set of records, each one acquisition file.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    /// The records, in processing order.
    pub records: Vec<Record>,
}

/// One acquisition file with all its channels.
#[derive(Debug, Clone)]
pub struct Record {
    /// The file's name without its folder: what tables and messages show.
    pub name: String,
    /// Where it lies.
    pub path: PathBuf,
    /// Its size in bytes.
    pub size: u64,
    /// BLAKE3 hash of its bytes, in hexadecimal.
    pub blake3: String,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// When the acquisition began, ISO 8601; empty if unknown.
    pub started_at: String,
    /// The channels that were asked for, by role.
    pub channels: Vec<Channel>,
}

/// A channel of a record: a source of raw samples and how to turn them into values.
#[derive(Debug, Clone)]
pub struct Channel {
    /// What it is to the stages: `deflection`, `piezo`.
    pub role: String,
    /// Where it lies in the file: `/deflection`.
    pub location: String,
    /// Number of samples.
    pub samples: usize,
    /// Unit of the values.
    pub unit: String,
    /// What it is, for people.
    pub long_name: String,
    /// value = stored * scale_factor + add_offset.
    pub scale_factor: f64,
    /// See `scale_factor`.
    pub add_offset: f64,
    /// The stored code that marks a missing sample, if the file declares one.
    pub fill_code: Option<f64>,
    /// Where the samples come from.
    pub source: Arc<dyn Source>,
}

/// Raw samples of one chunk, as stored.
#[derive(Debug, Clone, PartialEq)]
pub enum Raw {
    /// 16-bit codes, as from an analog-to-digital converter.
    Int16(Vec<i16>),
    /// 32-bit codes.
    Int32(Vec<i32>),
    /// Single precision.
    Float32(Vec<f32>),
    /// Double precision.
    Float64(Vec<f64>),
}

impl Raw {
    /// How many samples.
    pub fn len(&self) -> usize {
        match self {
            Self::Int16(codes) => codes.len(),
            Self::Int32(codes) => codes.len(),
            Self::Float32(codes) => codes.len(),
            Self::Float64(codes) => codes.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Appends `stored * scale + offset` for every sample.
    pub fn scale_into(&self, scale: f64, offset: f64, out: &mut Vec<f64>) {
        match self {
            Self::Int16(codes) => out.extend(codes.iter().map(|&code| f64::from(code) * scale + offset)),
            Self::Int32(codes) => out.extend(codes.iter().map(|&code| f64::from(code) * scale + offset)),
            Self::Float32(codes) => out.extend(codes.iter().map(|&code| f64::from(code) * scale + offset)),
            Self::Float64(codes) => out.extend(codes.iter().map(|&code| code * scale + offset)),
        }
    }
}

/// Where a channel's samples come from: any stretch can be read, again and again, from several threads.
pub trait Source: std::fmt::Debug + Send + Sync {
    /// Reads `count` raw samples from sample `start`. Errors: beyond the end; the file cannot be read or is damaged.
    fn read(&self, start: usize, count: usize) -> Result<Raw, StageError>;

    /// The stretch that is cheapest to read at once (a storage chunk).
    fn preferred_samples(&self) -> usize {
        1 << 16
    }
}

impl Record {
    /// The channel with this role. Errors: the record has none.
    pub fn channel(&self, role: &str) -> Result<&Channel, StageError> {
        self.channels.iter().find(|channel| channel.role == role).ok_or_else(|| {
            let have: Vec<&str> = self.channels.iter().map(|channel| channel.role.as_str()).collect();
            StageError::new(format!("the record has no `{role}` channel; it has: {}", have.join(", "))).at(&self.path)
        })
    }
}

impl Channel {
    /// Raw samples from `start`. Errors: as [`Source::read`].
    pub fn read_raw(&self, start: usize, count: usize) -> Result<Raw, StageError> {
        self.source.read(start, count)
    }

    /// Values in the channel's unit from `start`. Errors: as [`Source::read`].
    pub fn read(&self, start: usize, count: usize) -> Result<Vec<f64>, StageError> {
        let mut values = Vec::with_capacity(count);
        self.read_raw(start, count)?.scale_into(self.scale_factor, self.add_offset, &mut values);
        Ok(values)
    }
}

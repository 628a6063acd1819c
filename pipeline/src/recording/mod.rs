//! Recordings: lazy, re-readable record files. They are streamed, never held whole.

mod chunk;
mod chunk_cache;
mod contents;
mod equal;
mod errors;
mod foreign_hdf5;
mod how;
mod inflated;
mod input_files;
mod lazy_source;
mod measurement;
mod native;
mod open;
mod opened_files;
mod rate;
mod responses;
mod rows;
mod series;
mod source;
mod stretches;
mod whole;
mod write;

#[cfg(test)]
mod foreign_tests;
#[cfg(test)]
mod open_tests;
#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::sync::Arc;

pub(crate) use input_files::HashedFile;
pub use input_files::InputFiles;
pub(crate) use lazy_source::LazySource;
pub(crate) use native::is_native;
pub use native::{Wanted, open_native};
pub use series::{read_number_attribute, read_series};
pub use write::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native, write_native_in};

pub use afmid_formats::{
    Contents, Degree, FormatError, FoundChannel, FoundResponse, Parts, Raw, RawBinary, Row, Source, WANTED_RATE,
    begun_together, brief_number, contradiction, even_step, formats, gains_without_phase, hertz, is_fact,
    is_of_resampling, is_rate, joined, lane_names, mean_rate, most_inflated, names_of_files, one_rate, put_together,
    rates_agree, responses, says_frequencies, unit_ratio,
};
pub use contents::{UnpackedContents, is_hdf5_file, open_contents, open_unpacked};
pub use equal::{SamplePrint, equal_samples};
pub use how::{How, Reading};
pub use measurement::Measurement;
pub use open::{Opened, open_records, recognised};
pub use rate::{AgreedRate, agreed_rate};
pub use responses::{FileResponse, read_responses};
pub use rows::rows;
pub use whole::WholeFile;

use crate::error::StageError;

/// An ordered set of records, each one acquisition file.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    /// The records, in processing order.
    pub records: Vec<Record>,
}

/// One uninterrupted acquisition with all its channels: a file, or a stretch of one.
#[derive(Debug, Clone)]
pub struct Record {
    /// The file's name without its folder, and the number of the stretch if there are several (`file.tdms[2]`): what
    /// tables and messages show.
    pub name: String,
    /// Where it lies.
    pub path: PathBuf,
    /// Its size in bytes.
    pub size: u64,
    /// BLAKE3 hash of its bytes, in hexadecimal.
    pub blake3: String,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// Standard error of that rate, relative: of times and intervals that are rounded or jitter; 0 where it is stated.
    pub rate_relative_std: f64,
    /// When the acquisition began, ISO 8601; empty if unknown.
    pub started_at: String,
    /// Sample of the file's channels that is the record's first: a file whose recording was interrupted is one record
    /// per uninterrupted stretch.
    pub first_sample: usize,
    /// Which reader opens the file.
    pub reading: Reading,
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

impl Recording {
    /// Bytes of all its files, each counted once however many stretches it has.
    pub fn file_bytes(&self) -> u64 {
        let mut files: Vec<(&std::path::Path, u64)> =
            self.records.iter().map(|record| (record.path.as_path(), record.size)).collect();
        files.sort_unstable();
        files.dedup();
        files.into_iter().map(|(_, size)| size).sum()
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
        Ok(self.source.read(start, count)?)
    }

    /// Values in the channel's unit from `start`. Errors: as [`Source::read`].
    pub fn read(&self, start: usize, count: usize) -> Result<Vec<f64>, StageError> {
        let mut values = Vec::with_capacity(count);
        self.read_raw(start, count)?.scale_into(self.scale_factor, self.add_offset, &mut values);
        Ok(values)
    }
}

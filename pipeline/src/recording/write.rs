//! Writing native records.

use std::path::Path;

use hdf5::{Group, H5Type};

use crate::error::StoreError;
use crate::files::{FilledFolder, replace_file};
use crate::hdf5_files::write;

/// Samples per chunk of a compressed channel.
const CHUNK: usize = 1 << 16;

/// A record to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct NativeRecord {
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// When the acquisition began, ISO 8601; empty if unknown.
    pub started_at: String,
    /// The channels.
    pub channels: Vec<NativeChannel>,
}

/// A channel to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct NativeChannel {
    /// Where it lies in the file: a name without slashes, such as `deflection`; a leading slash is taken off.
    pub location: String,
    /// The samples as stored.
    pub codes: Codes,
    /// Unit of the values.
    pub unit: String,
    /// value = stored * scale_factor + add_offset.
    pub scale_factor: f64,
    /// See `scale_factor`.
    pub add_offset: f64,
    /// What it is, for people.
    pub long_name: String,
}

/// Stored samples.
#[derive(Debug, Clone, PartialEq)]
pub enum Codes {
    /// Converter codes.
    Int16(Vec<i16>),
    /// Single precision.
    Float32(Vec<f32>),
    /// Double precision.
    Float64(Vec<f64>),
}

/// How samples are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordStorage {
    /// In one stretch, as they are: fastest.
    Raw,
    /// In chunks, deflated at this level (1 to 9): a third to half the size, eight times slower to write.
    Deflate(u8),
}

/// Writes a native record: to a temporary file in the same folder, synced, then renamed, so that a kill leaves the old
/// file, the new one or none, never half of one. Same record, same bytes.
///
/// Errors: the folder cannot be written; a channel's name is empty, used twice or holds a slash.
pub fn write_native(path: &Path, record: &NativeRecord, storage: RecordStorage) -> Result<(), StoreError> {
    replace_file(path, |temporary| write_file(temporary, record, storage).map_err(|error| error.file(path)))
}

/// The same into a folder that this program fills: the file is listed there, and one that this program did not write,
/// or that was changed since, is not replaced. One that is not listed has to be the same, byte for byte.
///
/// Errors: as [`write_native`]; the file is another's.
pub fn write_native_in(
    folder: &FilledFolder,
    name: &str,
    record: &NativeRecord,
    storage: RecordStorage,
) -> Result<(), StoreError> {
    folder.replace_or_same(name, |temporary| {
        write_file(temporary, record, storage).map_err(|error| error.file(&folder.folder().join(name)))
    })
}

fn write_file(path: &Path, record: &NativeRecord, storage: RecordStorage) -> Result<(), StoreError> {
    let file = write::create_file(path)?;
    write::attribute(&file, "sample_rate_hz", &record.sample_rate_hz)?;
    write::text_attribute(&file, "started_at", &record.started_at)?;
    for channel in &record.channels {
        match &channel.codes {
            Codes::Int16(codes) => write_channel(&file, channel, codes, storage),
            Codes::Float32(codes) => write_channel(&file, channel, codes, storage),
            Codes::Float64(codes) => write_channel(&file, channel, codes, storage),
        }?;
    }
    Ok(file.close()?)
}

fn write_channel<T: H5Type>(
    file: &Group,
    channel: &NativeChannel,
    codes: &[T],
    storage: RecordStorage,
) -> Result<(), StoreError> {
    let name = channel.location.trim_start_matches('/');
    let dataset = match storage {
        RecordStorage::Deflate(level) if !codes.is_empty() => {
            write::check_name(name)?;
            let dataset = file
                .new_dataset::<T>()
                .obj_track_times(false)
                .chunk([CHUNK.min(codes.len())])
                .deflate(level.clamp(1, 9))
                .shape([codes.len()])
                .create(name)?;
            dataset.write_raw(codes)?;
            dataset
        }
        _ => write::dataset(file, name, &[codes.len()], codes)?,
    };
    write::text_attribute(&dataset, "units", &channel.unit)?;
    write::attribute(&dataset, "scale_factor", &channel.scale_factor)?;
    write::attribute(&dataset, "add_offset", &channel.add_offset)?;
    write::text_attribute(&dataset, "long_name", &channel.long_name)
}

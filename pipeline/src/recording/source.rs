//! Samples of one HDF5 dataset: HDF5 says where they lie, everything else is plain file reading on the caller's thread.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;

use super::chunk::{ChunkFilter, undo_filters};
use super::chunk_cache::ChunkCache;
use super::input_files::{require_same, require_state};
use super::{FormatError, Raw, Source};
use crate::error::StageError;
use crate::files::{FileState, open_regular};
use crate::hdf5_files::Vetted;
use crate::hdf5_files::read::open_file;
use afmid_formats::Number;

/// Samples read at once through the library, under its global lock: short enough to let others in between.
const LIBRARY_SLICE: usize = 1 << 16;

/// Where the samples lie.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Place {
    /// One stretch of the file.
    Contiguous {
        /// Byte offset in the file.
        offset: u64,
    },
    /// Chunks of equal length, each filtered on its own.
    Chunked {
        /// Samples per chunk.
        length: usize,
        /// In order of their samples.
        chunks: Vec<ChunkPlace>,
        /// In the order in which they were applied.
        filters: Vec<ChunkFilter>,
    },
    /// Somewhere only the library finds them: rare filters, compact or virtual layouts, chunks never written.
    Library,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ChunkPlace {
    pub(super) offset: u64,
    pub(super) bytes: usize,
    pub(super) skipped_filters: u32,
}

/// An element of a dataset: a number, or a record with a number in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Item {
    pub(super) bytes: usize,
    /// Byte of the number.
    pub(super) offset: usize,
}

/// A [`Source`] over one HDF5 dataset. Holds no handle between reads.
#[derive(Debug)]
pub(super) struct Hdf5Source {
    pub(super) path: PathBuf,
    /// The state in which it was opened: every read sees that it is still in it.
    pub(super) state: FileState,
    pub(super) vetted: Vetted,
    pub(super) location: String,
    pub(super) samples: usize,
    pub(super) kind: Number,
    /// Bytes from one sample to the next, and of what lies before the number: a column of a table of records.
    pub(super) item: Item,
    pub(super) big_endian: bool,
    pub(super) place: Place,
    pub(super) chunks: ChunkCache,
    /// Tells its chunks from those of other sources.
    pub(super) number: u64,
}

impl Source for Hdf5Source {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        Ok(self.stretch(start, count)?)
    }

    fn preferred_samples(&self) -> usize {
        match &self.place {
            Place::Chunked { length, .. } => (*length).max(1),
            Place::Contiguous { .. } | Place::Library => LIBRARY_SLICE,
        }
    }

    fn is_direct(&self) -> bool {
        matches!(self.place, Place::Contiguous { .. }) && self.is_plain()
    }
}

impl Hdf5Source {
    fn stretch(&self, start: usize, count: usize) -> Result<Raw, StageError> {
        let end = start.checked_add(count).filter(|&end| end <= self.samples).ok_or_else(|| {
            self.error(format!("samples {start} to {start} + {count} asked for, there are {}", self.samples))
        })?;
        if count == 0 {
            return Ok(self.kind.decode(&[], self.big_endian));
        }
        let file = self.open()?;
        match &self.place {
            Place::Contiguous { offset } => {
                let at = offset + start as u64 * self.item.bytes as u64;
                if self.is_plain() {
                    return self.kind.read(count, self.big_endian, |bytes| self.fill(&file, at, bytes));
                }
                let mut items = vec![0; count * self.item.bytes];
                self.fill(&file, at, &mut items)?;
                Ok(self.kind.decode(&self.numbers_of(items), self.big_endian))
            }
            Place::Chunked { length, chunks, filters } => {
                let bytes = self.read_chunks(&file, start, end, *length, chunks, filters)?;
                Ok(self.kind.decode(&self.numbers_of(bytes), self.big_endian))
            }
            Place::Library => self.read_by_library(start, end),
        }
    }

    /// Whether the elements are the numbers.
    fn is_plain(&self) -> bool {
        self.item.bytes as u64 == self.kind.bytes()
    }

    /// The numbers in elements that lie side by side.
    fn numbers_of(&self, items: Vec<u8>) -> Vec<u8> {
        if self.is_plain() {
            return items;
        }
        let Item { bytes, offset } = self.item;
        let number = offset..offset + self.kind.bytes() as usize;
        items.chunks_exact(bytes).flat_map(|item| item.get(number.clone()).unwrap_or_default()).copied().collect()
    }

    fn error(&self, problem: impl std::fmt::Display) -> StageError {
        StageError::new(format!("{}: {problem}", self.location)).at(&self.path)
    }

    fn open(&self) -> Result<File, StageError> {
        let fail = |error: std::io::Error| self.error(format!("the file cannot be read: {error}"));
        let file = open_regular(&self.path).map_err(fail)?;
        let now = FileState::of(&file).map_err(fail)?;
        require_same(&self.path, &now, &self.state)
            .map_err(|error| StageError { problem: format!("{}: {}", self.location, error.problem), ..error })?;
        Ok(file)
    }

    fn fill(&self, file: &File, offset: u64, bytes: &mut [u8]) -> Result<(), StageError> {
        let count = bytes.len();
        file.read_exact_at(bytes, offset)
            .map_err(|error| self.error(format!("{count} bytes at {offset} cannot be read: {error}")))
    }

    fn read_chunks(
        &self,
        file: &File,
        start: usize,
        end: usize,
        length: usize,
        chunks: &[ChunkPlace],
        filters: &[ChunkFilter],
    ) -> Result<Vec<u8>, StageError> {
        let sample = self.item.bytes;
        let mut bytes = Vec::with_capacity((end - start) * sample);
        for index in start / length..=(end - 1) / length {
            let place = chunks.get(index).ok_or_else(|| self.error(format!("chunk {index} is missing")))?;
            let chunk = self.chunks.chunk((self.number, index), || {
                let mut stored = vec![0; place.bytes];
                self.fill(file, place.offset, &mut stored)?;
                undo_filters(stored, filters, place.skipped_filters, sample, length * sample)
                    .map_err(|problem| self.error(format!("damaged near sample {}: {problem}", index * length)))
            })?;
            let first = index * length;
            let (from, to) = (start.max(first) - first, end.min(first + length) - first);
            bytes.extend_from_slice(&chunk[from * sample..to * sample]);
        }
        Ok(bytes)
    }

    fn read_by_library(&self, start: usize, end: usize) -> Result<Raw, StageError> {
        macro_rules! slices {
            ($stored:ty, $kind:ident) => {{
                let mut samples = Vec::with_capacity(end - start);
                for from in (start..end).step_by(LIBRARY_SLICE) {
                    let to = end.min(from.saturating_add(LIBRARY_SLICE));
                    let slice = self.read_slice::<$stored>(from, to)?;
                    samples.extend(slice);
                }
                Raw::$kind(samples)
            }};
        }
        Ok(match self.kind {
            Number::I8 | Number::U8 | Number::I16 => slices!(i16, Int16),
            Number::U16 | Number::I24 | Number::I32 => slices!(i32, Int32),
            Number::F16 | Number::F32 => slices!(f32, Float32),
            Number::U32 | Number::I64 | Number::U64 | Number::F64 => slices!(f64, Float64),
        })
    }

    fn read_slice<T: hdf5::H5Type>(&self, from: usize, to: usize) -> Result<Vec<T>, StageError> {
        let file = open_file(&self.path, &self.vetted)?;
        let fail = |error: hdf5::Error| self.error(format!("samples {from} to {to} cannot be read: {error}"));
        let dataset = file.dataset(&self.location).map_err(fail)?;
        let samples = dataset.read_slice_1d::<T, _>(from..to).map_err(fail)?.into_raw_vec_and_offset().0;
        // the library opened it by name
        require_state(&self.path, &self.state)?;
        Ok(samples)
    }
}

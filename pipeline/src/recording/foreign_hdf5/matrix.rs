//! Rows or columns of a dataset.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use afmid_formats::{FormatError, Number, Raw, Source, most_inflated, numbers_in_file};
use hdf5::dataset::Layout;
use hdf5::datatype::ByteOrder;
use hdf5::{H5Type, Selection};
use ndarray::Ix1;

use super::walk::Found;
use crate::error::StageError;
use crate::files::FileState;
use crate::hdf5_files::Vetted;
use crate::hdf5_files::read::open_file;
use crate::recording::input_files::{HashedHdf5, require_state};

/// Samples read at once through the library, under its global lock: short enough to let others in between.
const SLICE: usize = 1 << 16;

/// The library inflates a chunk at once.
const MOST_CHUNK_BYTES: u64 = 128 << 20;

/// A dataset of one or two dimensions.
#[derive(Debug)]
pub(super) struct Matrix {
    path: PathBuf,
    state: FileState,
    vetted: Vetted,
    location: String,
    /// Length of its last axis, and whether it has another.
    columns: usize,
    flat: bool,
    number: Number,
    big_endian: bool,
    /// Byte of the first number, if all lie in one stretch.
    offset: Option<u64>,
}

/// One row or column.
#[derive(Debug)]
pub(super) struct Lane {
    matrix: Arc<Matrix>,
    first: u64,
    step: u64,
    samples: usize,
}

impl Matrix {
    /// Errors: damaged; a chunk larger than the file allows.
    pub(super) fn of(
        found: &Found,
        (path, hashed): (&Path, &HashedHdf5),
        shape: &[usize],
        number: Number,
    ) -> Result<Self, StageError> {
        let hdf5 = |error: hdf5::Error| StageError::new(format!("damaged: {error}"));
        let creation = found.dataset.dcpl().map_err(hdf5)?;
        let file_size = hashed.state.size();
        let chunk = creation.chunk().unwrap_or_default();
        let chunk_bytes = chunk.iter().fold(number.bytes(), |product, &size| product.saturating_mul(size as u64));
        if !chunk.is_empty() && chunk_bytes > MOST_CHUNK_BYTES.min(most_inflated(file_size)) {
            return Err(StageError::new(format!(
                "stored in chunks of the shape {chunk:?}, wanted at most {MOST_CHUNK_BYTES} bytes each, and not more \
                 than the file can hold"
            )));
        }
        let contiguous = matches!(creation.layout(), Layout::Contiguous);
        Ok(Self {
            path: path.to_owned(),
            state: hashed.state,
            vetted: hashed.vetted,
            location: found.location.clone(),
            columns: shape.last().copied().unwrap_or(1),
            flat: shape.len() == 1,
            number,
            big_endian: matches!(found.dataset.dtype().map_err(hdf5)?.byte_order(), ByteOrder::BigEndian),
            offset: found.dataset.offset().filter(|_| contiguous),
        })
    }

    fn read<T: H5Type>(
        &self,
        selection: impl Fn(usize, usize) -> Selection,
        from: usize,
        to: usize,
    ) -> Result<Vec<T>, StageError> {
        let fail = |error: hdf5::Error| {
            StageError::new(format!("{}: samples {from} to {to} cannot be read: {error}", self.location)).at(&self.path)
        };
        let mut samples = Vec::with_capacity(to - from);
        for start in (from..to).step_by(SLICE) {
            // opened for each slice: no handle stays open, and others get in between
            let dataset = open_file(&self.path, &self.vetted)?.dataset(&self.location).map_err(fail)?;
            let slice = dataset.read_slice::<T, _, Ix1>(selection(start, to.min(start + SLICE))).map_err(fail)?;
            samples.extend(slice);
        }
        Ok(samples)
    }
}

impl Lane {
    /// The samples from element `first` of the dataset on, every `step`-th.
    pub(super) fn new(matrix: &Arc<Matrix>, first: u64, step: u64, samples: usize) -> Self {
        Self { matrix: Arc::clone(matrix), first, step, samples }
    }

    /// Read straight from the file where the numbers lie in one stretch, else through the library. Errors: outside of
    /// the file.
    pub(super) fn source(self) -> Result<Arc<dyn Source>, StageError> {
        let matrix = &self.matrix;
        let Some(offset) = matrix.offset else { return Ok(Arc::new(self)) };
        let bytes = matrix.number.bytes();
        let first = offset.saturating_add(self.first.saturating_mul(bytes));
        let place = (first, self.step.saturating_mul(bytes));
        Ok(numbers_in_file(&matrix.path, place, self.samples, matrix.number, matrix.big_endian)?)
    }

    /// The part of the dataset that holds samples `from..to` of the lane.
    fn selection(&self, from: usize, to: usize) -> Selection {
        let columns = self.matrix.columns.max(1) as u64;
        let (row, column) = ((self.first / columns) as usize, (self.first % columns) as usize);
        let along_row = self.step == 1 && self.matrix.columns > 1;
        match (self.matrix.flat, along_row) {
            (true, _) => (from..to).into(),
            (false, true) => (row, from..to).into(),
            (false, false) => (from..to, column).into(),
        }
    }
}

impl Source for Lane {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        let matrix = &self.matrix;
        let Some(end) = start.checked_add(count).filter(|&end| end <= self.samples) else {
            let problem = format!("samples {start} to {start} + {count} asked for, there are {}", self.samples);
            return Err(StageError::new(problem).at(&matrix.path).into());
        };
        require_state(&matrix.path, &matrix.state)?;
        let selection = |from, to| self.selection(from, to);
        let samples = match matrix.number {
            Number::I8 | Number::U8 | Number::I16 => Raw::Int16(matrix.read(selection, start, end)?),
            Number::U16 | Number::I24 | Number::I32 => Raw::Int32(matrix.read(selection, start, end)?),
            Number::F16 | Number::F32 => Raw::Float32(matrix.read(selection, start, end)?),
            Number::U32 | Number::I64 | Number::U64 | Number::F64 => Raw::Float64(matrix.read(selection, start, end)?),
        };
        // the library opened it by name
        require_state(&matrix.path, &matrix.state)?;
        Ok(samples)
    }
}

//! Variables that are too large for memory: written block by block, left in the file when a stage's result is read.
//!
//! A contiguous dataset of little-endian doubles is what rows in a file are: they are read where it lies.

use std::fs::File;
use std::path::{Path, PathBuf};

use hdf5::datatype::ByteOrder;
use hdf5::types::{FloatSize, TypeDescriptor};
use hdf5::{Dataset, Group};
use ndarray::{ArrayView2, s};

use crate::error::{Result, StoreError};
use crate::files::{FileState, open_regular};
use crate::hdf5_files::read::Node;
use crate::hdf5_files::{read, write};
use crate::rows::{RowSource, Scratch, StoredRows, in_blocks};

/// Writes rows as [`write::dataset`] would if all were in memory: the same bytes. Errors: those of the rows, and as
/// there.
pub(crate) fn write_rows(parent: &Group, name: &str, shape: &[usize], rows: &StoredRows) -> Result<Dataset> {
    let wrap = |error: hdf5::Error| StoreError::from(error).at(write::path_of(parent, name));
    let (count, length) = (rows.rows(), rows.row_length());
    if shape != [count, length] {
        return Err(StoreError::new(format!("{count} rows of {length} values do not fill {shape:?}")));
    }
    let dataset = write::empty::<f64>(parent, name, shape)?;
    let all: Vec<usize> = (0..count).collect();
    in_blocks(rows, &all, |first, block| {
        let values = block.concat();
        let view = ArrayView2::from_shape((block.len(), length), &values)
            .map_err(|error| StoreError::new(format!("a block of rows: {error}")))?;
        dataset.write_slice(view, s![first..first + block.len(), ..]).map_err(wrap)
    })?;
    Ok(dataset)
}

/// A stage file, held open beside HDF5's own handle, in the state in which it was opened.
pub(super) struct Backing {
    file: File,
    path: PathBuf,
    state: FileState,
}

impl Backing {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let open = || open_regular(path).and_then(|file| Ok((FileState::of(&file)?, file)));
        let (state, file) = open().map_err(|error| StoreError::io("cannot be opened", path, &error))?;
        Ok(Self { file, path: path.to_owned(), state })
    }

    /// Whether the path names this file and nobody has touched it since it was opened: HDF5 opens by name, and what was
    /// read by name since was read from these bytes.
    pub(super) fn is_untouched(&self) -> bool {
        FileState::at(&self.path).is_ok_and(|now| now == self.state)
    }
}

/// A variable over two axes as rows in its file; none if it is small enough for memory, or cannot be read that way.
/// Errors: damaged.
pub(super) fn read_rows(parent: &Node, name: &str, backing: &Backing) -> Result<Option<StoredRows>> {
    let dataset = read::dataset(parent, name)?;
    let [rows, row_length] = dataset.shape()[..] else { return Ok(None) };
    let bytes = rows.saturating_mul(row_length).saturating_mul(size_of::<f64>());
    let plain = read::descriptor(&dataset)? == TypeDescriptor::Float(FloatSize::U8)
        && dataset.dtype()?.byte_order() == ByteOrder::LittleEndian;
    if bytes <= Scratch::default().limit_bytes() || !plain {
        return Ok(None);
    }
    read::check_samples(&dataset, size_of::<f64>(), dataset.allowance())
        .map_err(|error| error.at(write::path_of(parent, name)))?;
    // none for what is chunked, that is, for what this program does not write
    let Some(offset) = dataset.offset() else { return Ok(None) };
    let file =
        backing.file.try_clone().map_err(|error| StoreError::io("cannot be held open", &backing.path, &error))?;
    let rows = StoredRows::pinned(file, &backing.path, offset, rows, row_length);
    rows.map(Some).map_err(|error| StoreError::io("cannot be read", &backing.path, &error))
}

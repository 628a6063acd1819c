//! Rows in a file.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use super::RowSource;
use super::pinned::Pinned;
use super::source::no_such_row;
use crate::error::StageError;

/// Real numbers in rows of equal length, in a file: little-endian doubles, row after row from some byte on. Cloning is
/// cheap.
///
/// The file is held open: removing or replacing it takes nothing away. If it is cut short all the same, reading says
/// so. Of a file that others can open, every read sees that the bytes are those that it held when it was opened
/// (`pinned`), whatever its size and times say.
#[derive(Debug, Clone)]
pub struct StoredRows(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    file: File,
    /// For messages.
    path: PathBuf,
    offset: u64,
    rows: usize,
    row_length: usize,
    /// What blocks of rows hashed to when the file was opened; none of a file without a name, which is nobody else's.
    pinned: Option<Pinned>,
    /// All values, once somebody has asked for them.
    whole: OnceLock<Vec<f64>>,
}

impl StoredRows {
    /// Rows that begin at byte `offset` of an open file; `path` is its name in messages.
    pub(crate) fn new(file: File, path: &Path, offset: u64, rows: usize, row_length: usize) -> Self {
        let (path, whole) = (path.to_owned(), OnceLock::new());
        Self(Arc::new(Inner { file, path, offset, rows, row_length, pinned: None, whole }))
    }

    /// The same of a file that others can change: reads it once. The caller sees that nobody changed it meanwhile.
    /// Errors: it cannot be read.
    pub(crate) fn pinned(
        file: File,
        path: &Path,
        offset: u64,
        rows: usize,
        row_length: usize,
    ) -> std::io::Result<Self> {
        let pinned = Pinned::of(&file, offset, rows, row_length)?;
        let (path, whole) = (path.to_owned(), OnceLock::new());
        Ok(Self(Arc::new(Inner { file, path, offset, rows, row_length, pinned: Some(pinned), whole })))
    }

    /// All values, row-major. The first call reads them, and they stay in memory: what goes by rows uses
    /// [`in_blocks`](super::in_blocks).
    ///
    /// Errors: the file cannot be read, or was cut short.
    pub fn whole(&self) -> Result<&[f64], StageError> {
        if let Some(values) = self.0.whole.get() {
            return Ok(values);
        }
        let mut values = vec![0.0; self.len()];
        for (row, into) in values.chunks_exact_mut(self.0.row_length.max(1)).enumerate() {
            self.read(row, into)?;
        }
        Ok(self.0.whole.get_or_init(|| values))
    }

    /// Values in all rows.
    pub fn len(&self) -> usize {
        self.0.rows * self.0.row_length
    }

    /// Whether there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl RowSource for StoredRows {
    fn rows(&self) -> usize {
        self.0.rows
    }

    fn row_length(&self) -> usize {
        self.0.row_length
    }

    fn borrowed(&self, row: usize) -> Option<&[f64]> {
        self.0.whole.get()?.chunks_exact(self.0.row_length.max(1)).nth(row)
    }

    fn read(&self, row: usize, into: &mut [f64]) -> Result<(), StageError> {
        let Inner { path, rows, row_length, .. } = &*self.0;
        if row >= *rows || into.len() != *row_length {
            return Err(no_such_row(row, *rows, *row_length, into.len()));
        }
        let bytes = self.0.row(row).map_err(|error| {
            let what = match error.kind() {
                std::io::ErrorKind::UnexpectedEof => {
                    format!("the file was cut short: row {row} of {rows} is not there")
                }
                std::io::ErrorKind::InvalidData => format!(
                    "the file was changed while it was read: row {row} of {rows} has other bytes than when it was \
                     opened; nothing made from it is kept"
                ),
                _ => format!("row {row} of {rows} cannot be read: {error}"),
            };
            StageError::new(what).at(path).help("run it again; something changes files that a run still needs")
        })?;
        for (value, bytes) in into.iter_mut().zip(bytes.as_chunks::<8>().0) {
            *value = f64::from_le_bytes(*bytes);
        }
        Ok(())
    }
}

impl Inner {
    /// The bytes of a row. Errors: the system's; `InvalidData`: they are not those that were pinned.
    fn row(&self, row: usize) -> std::io::Result<Vec<u8>> {
        let length = self.row_length * size_of::<f64>();
        let Some(pinned) = &self.pinned else {
            let mut bytes = vec![0; length];
            self.file.read_exact_at(&mut bytes, self.offset + (row * length) as u64)?;
            return Ok(bytes);
        };
        let (first, mut bytes) = pinned.block_with(row, self.rows, length);
        self.file.read_exact_at(&mut bytes, self.offset + (first * length) as u64)?;
        if !pinned.holds(row, &bytes) {
            return Err(std::io::ErrorKind::InvalidData.into());
        }
        bytes.truncate((row + 1 - first) * length);
        Ok(bytes.split_off((row - first) * length))
    }
}

/// Equal numbers; what cannot be read equals nothing.
impl PartialEq for StoredRows {
    fn eq(&self, other: &Self) -> bool {
        let shape = |rows: &Self| (rows.0.rows, rows.0.row_length);
        let row = |rows: &Self, row: usize| {
            let mut values = vec![0.0; rows.0.row_length];
            rows.read(row, &mut values).ok().map(|()| values)
        };
        shape(self) == shape(other)
            && (0..self.0.rows).all(|at| row(self, at).is_some_and(|values| Some(values) == row(other, at)))
    }
}

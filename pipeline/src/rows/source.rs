//! Where rows come from.

use super::StoredRows;
use crate::error::StageError;

/// Rows of equal length, read one at a time. Implementations are called from several threads.
pub trait RowSource: Sync {
    /// How many rows.
    fn rows(&self) -> usize;
    /// Values in a row.
    fn row_length(&self) -> usize;
    /// The row, where it lies in memory anyway.
    fn borrowed(&self, row: usize) -> Option<&[f64]>;
    /// Copies a row into `into`, which has its length. Errors: there is no such row; it cannot be read.
    fn read(&self, row: usize, into: &mut [f64]) -> Result<(), StageError>;
}

impl<S: RowSource + ?Sized> RowSource for &S {
    fn rows(&self) -> usize {
        (**self).rows()
    }
    fn row_length(&self) -> usize {
        (**self).row_length()
    }
    fn borrowed(&self, row: usize) -> Option<&[f64]> {
        (**self).borrowed(row)
    }
    fn read(&self, row: usize, into: &mut [f64]) -> Result<(), StageError> {
        (**self).read(row, into)
    }
}

/// The rows of a variable, wherever they lie.
#[derive(Debug, Clone, Copy)]
pub enum RowView<'a> {
    /// In memory, row-major, each of this length.
    Memory(&'a [f64], usize),
    /// In a file.
    Stored(&'a StoredRows),
}

impl RowSource for RowView<'_> {
    fn rows(&self) -> usize {
        match self {
            Self::Memory(values, length) => values.len() / (*length).max(1),
            Self::Stored(rows) => rows.rows(),
        }
    }

    fn row_length(&self) -> usize {
        match self {
            Self::Memory(_, length) => *length,
            Self::Stored(rows) => rows.row_length(),
        }
    }

    fn borrowed(&self, row: usize) -> Option<&[f64]> {
        match self {
            Self::Memory(values, length) => values.get(row.checked_mul(*length)?..)?.get(..*length),
            Self::Stored(rows) => rows.borrowed(row),
        }
    }

    fn read(&self, row: usize, into: &mut [f64]) -> Result<(), StageError> {
        match self {
            Self::Memory(_, length) => {
                let found = self.borrowed(row).filter(|found| found.len() == into.len());
                into.copy_from_slice(found.ok_or_else(|| no_such_row(row, self.rows(), *length, into.len()))?);
                Ok(())
            }
            Self::Stored(rows) => rows.read(row, into),
        }
    }
}

pub(super) fn no_such_row(row: usize, rows: usize, length: usize, wanted: usize) -> StageError {
    StageError::new(format!("row {row} with {wanted} values was asked for; there are {rows} rows of {length}"))
}

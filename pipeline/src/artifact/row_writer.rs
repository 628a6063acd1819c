//! Rows on their way into a variable.

use std::fs::File;
use std::os::unix::fs::FileExt;

use super::Values;
use crate::error::StageError;
use crate::rows::{Scratch, StoredRows};

/// Takes rows of equal length: up to a limit they stay in memory, beyond it all go into a file without a name.
#[derive(Debug)]
pub struct RowWriter {
    scratch: Scratch,
    row_length: usize,
    rows: usize,
    memory: Vec<f64>,
    file: Option<File>,
}

impl RowWriter {
    /// A writer of rows with `row_length` values.
    pub fn new(scratch: Scratch, row_length: usize) -> Self {
        Self { scratch, row_length, rows: 0, memory: Vec::new(), file: None }
    }

    /// Adds a row and tells its number. Errors: it has another length; the file cannot be made or written (a full disk).
    pub fn push(&mut self, row: &[f64]) -> Result<usize, StageError> {
        if row.len() != self.row_length {
            return Err(StageError::new(format!("a row has {} values, the others {}", row.len(), self.row_length)));
        }
        let bytes = (self.rows + 1).saturating_mul(size_of_val(row));
        if self.file.is_none() && bytes > self.scratch.limit_bytes() {
            let file = self.scratch.file()?;
            for (number, row) in self.memory.chunks_exact(self.row_length).enumerate() {
                self.write(&file, number, row)?;
            }
            (self.file, self.memory) = (Some(file), Vec::new());
        }
        match &self.file {
            Some(file) => self.write(file, self.rows, row)?,
            None => self.memory.extend_from_slice(row),
        }
        self.rows += 1;
        Ok(self.rows - 1)
    }

    fn write(&self, file: &File, number: usize, row: &[f64]) -> Result<(), StageError> {
        let bytes: Vec<u8> = row.iter().flat_map(|value| value.to_le_bytes()).collect();
        file.write_all_at(&bytes, (number * bytes.len()) as u64).map_err(|error| {
            let folder = self.scratch.path().parent().unwrap_or(self.scratch.path());
            StageError::new(format!("row {number} cannot be written to a temporary file: {error}"))
                .at(folder)
                .help("make room there, or choose another folder with --cache")
        })
    }

    /// What was written, as the values of a variable over rows and their samples.
    pub fn finish(self) -> Values {
        match self.file {
            Some(file) => Values::Stored(StoredRows::new(file, self.scratch.path(), 0, self.rows, self.row_length)),
            None => Values::Real(self.memory),
        }
    }
}

//! Rows on their way into a variable.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
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
    /// The first file could not be written, and the rows went to another.
    moved: bool,
}

impl RowWriter {
    /// A writer of rows with `row_length` values.
    pub fn new(scratch: Scratch, row_length: usize) -> Self {
        Self { scratch, row_length, rows: 0, memory: Vec::new(), file: None, moved: false }
    }

    /// Adds a row and tells its number. Where the cache's disk is full, all rows go to the system's folder for
    /// temporary files.
    ///
    /// Errors: it has another length; no file can be made or written.
    pub fn push(&mut self, row: &[f64]) -> Result<usize, StageError> {
        if row.len() != self.row_length {
            return Err(StageError::new(format!("a row has {} values, the others {}", row.len(), self.row_length)));
        }
        let bytes = (self.rows + 1).saturating_mul(size_of_val(row));
        if self.file.is_none() && bytes > self.scratch.limit_bytes() {
            let mut file = self.scratch.file()?;
            let memory = std::mem::take(&mut self.memory);
            for (number, row) in memory.chunks_exact(self.row_length).enumerate() {
                file = self.written(file, number, row)?;
            }
            self.file = Some(file);
        }
        match self.file.take() {
            Some(file) => self.file = Some(self.written(file, self.rows, row)?),
            None => self.memory.extend_from_slice(row),
        }
        self.rows += 1;
        Ok(self.rows - 1)
    }

    /// The file with this row, the one that it was or another. Errors: neither can be written.
    fn written(&mut self, file: File, number: usize, row: &[f64]) -> Result<File, StageError> {
        let bytes: Vec<u8> = row.iter().flat_map(|value| value.to_le_bytes()).collect();
        let start = (number * bytes.len()) as u64;
        let Err(error) = file.write_all_at(&bytes, start) else { return Ok(file) };
        let copied = if self.moved { None } else { self.copied(&file, start).ok() };
        self.moved = true;
        let failed = |error: std::io::Error| {
            let folder = self.scratch.path().parent().unwrap_or(self.scratch.path());
            StageError::new(format!("row {number} cannot be written to a temporary file: {error}"))
                .at(folder)
                .help("make room there, choose another folder with --cache, or set TMPDIR to one with room")
        };
        let file = copied.ok_or_else(|| failed(error))?;
        file.write_all_at(&bytes, start).map_err(failed)?;
        Ok(file)
    }

    /// The first bytes of a file in another folder. Errors: there is no room either.
    fn copied(&self, file: &File, bytes: u64) -> std::io::Result<File> {
        let (mut from, mut to) = (file, self.scratch.elsewhere()?);
        from.seek(SeekFrom::Start(0))?;
        match std::io::copy(&mut from.take(bytes), &mut to)? {
            all if all == bytes => Ok(to),
            _ => Err(std::io::ErrorKind::UnexpectedEof.into()),
        }
    }

    /// What was written, as the values of a variable over rows and their samples.
    pub fn finish(self) -> Values {
        match self.file {
            Some(file) => Values::Stored(StoredRows::new(file, self.scratch.path(), 0, self.rows, self.row_length)),
            None => Values::Real(self.memory),
        }
    }
}

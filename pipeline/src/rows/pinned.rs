//! What rows in a file hashed to when it was opened: a file that is changed in place and changed back gives no other
//! numbers.

use std::fs::File;
use std::os::unix::fs::FileExt;

use rayon::prelude::*;

/// Least bytes that are hashed together. Why: a row is read with its block, so that short rows cost more than their own
/// bytes; the hashes take a thousandth of the rows' bytes at most.
const BLOCK_BYTES: usize = 16 << 10;

/// Bytes of a hash that are kept. Why: nobody finds other bytes of the same 128 bits.
const HASH_BYTES: usize = 16;

/// Bytes that are read at once while a file is hashed.
const READ_BYTES: usize = 4 << 20;

/// The hashes of blocks of rows, each of so many, the last perhaps of fewer.
#[derive(Debug)]
pub(super) struct Pinned {
    rows_per_block: usize,
    hashes: Vec<[u8; HASH_BYTES]>,
}

impl Pinned {
    /// Of rows that begin at byte `offset`. Streams. Errors: they cannot be read.
    pub(super) fn of(file: &File, offset: u64, rows: usize, row_length: usize) -> std::io::Result<Self> {
        let length = row_length * size_of::<f64>();
        let rows_per_block = BLOCK_BYTES.div_ceil(length.max(1));
        let block = rows_per_block * length;
        let (mut hashes, mut buffer) = (Vec::with_capacity(rows.div_ceil(rows_per_block)), Vec::new());
        let at_once = (READ_BYTES / block.max(1)).max(1) * rows_per_block;
        for first in (0..rows).step_by(at_once) {
            buffer.resize(at_once.min(rows - first) * length, 0);
            file.read_exact_at(&mut buffer, offset + (first * length) as u64)?;
            match rayon::current_thread_index() {
                Some(_) => hashes.par_extend(buffer.par_chunks(block.max(1)).map(hash)),
                None => hashes.extend(buffer.chunks(block.max(1)).map(hash)),
            }
        }
        Ok(Self { rows_per_block, hashes })
    }

    /// The first row of the block with this row, and room for the block. Shapes: of `rows`, each of `length` bytes.
    pub(super) fn block_with(&self, row: usize, rows: usize, length: usize) -> (usize, Vec<u8>) {
        let first = row - row % self.rows_per_block;
        (first, vec![0; self.rows_per_block.min(rows - first) * length])
    }

    /// Whether these are the bytes that the block with this row had.
    pub(super) fn holds(&self, row: usize, block: &[u8]) -> bool {
        self.hashes.get(row / self.rows_per_block).is_some_and(|known| *known == hash(block)) || block.is_empty()
    }
}

fn hash(block: &[u8]) -> [u8; HASH_BYTES] {
    let mut short = [0; HASH_BYTES];
    short.copy_from_slice(&blake3::hash(block).as_bytes()[..HASH_BYTES]);
    short
}

#[cfg(test)]
mod tests {
    use std::fs::{File, OpenOptions};
    use std::os::unix::fs::FileExt;

    use super::super::{RowSource, StoredRows};
    use crate::files::fixture::Folder;

    const OFFSET: u64 = 24;

    fn rows(folder: &Folder, rows: usize, length: usize) -> (StoredRows, File) {
        let path = folder.file("rows");
        let values = (0..rows * length).flat_map(|value| (value as f64).to_le_bytes());
        std::fs::write(&path, [0; OFFSET as usize].into_iter().chain(values).collect::<Vec<u8>>()).unwrap();
        let stored = StoredRows::pinned(File::open(&path).unwrap(), &path, OFFSET, rows, length).unwrap();
        (stored, OpenOptions::new().write(true).open(&path).unwrap())
    }

    fn read(stored: &StoredRows, row: usize) -> Result<Vec<f64>, String> {
        let mut values = vec![f64::NAN; stored.row_length()];
        stored.read(row, &mut values).map(|()| values).map_err(|error| error.to_string())
    }

    #[test]
    fn rows_are_those_of_the_file_and_a_changed_one_is_an_error_until_it_is_changed_back() {
        // blocks of many rows, of two, of one; a last block that is shorter
        for (count, length) in [(5000, 3), (7, 1024), (3, 5000), (1, 1), (0, 4)] {
            let folder = Folder::new("pinned");
            let (stored, file) = rows(&folder, count, length);
            for row in (0..count).step_by(count / 5 + 1) {
                let wanted: Vec<f64> = (row * length..(row + 1) * length).map(|value| value as f64).collect();
                assert_eq!(read(&stored, row), Ok(wanted.clone()));
                let at = OFFSET + (row * length * 8) as u64;
                file.write_all_at(&f64::to_le_bytes(-1.0), at).unwrap();
                assert!(read(&stored, row).unwrap_err().contains("was changed while it was read"));
                assert!(stored.whole().is_err());
                file.write_all_at(&wanted[0].to_le_bytes(), at).unwrap();
                assert_eq!(read(&stored, row), Ok(wanted));
            }
            file.set_len(OFFSET).unwrap();
            assert!(count == 0 || read(&stored, 0).unwrap_err().contains("cut short"));
        }
    }
}

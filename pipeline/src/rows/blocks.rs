//! Going through rows a block at a time.

use rayon::prelude::*;

use super::RowSource;
use crate::error::StageError;

/// Most bytes of rows in a block (one row at least). Small beside what a program needs anyway; large enough that
/// reading it costs no more than copying it.
pub const BLOCK_BYTES: usize = 4 << 20;

/// Hands the `chosen` rows to `work` in their order, a block at a time, with the number of those handed before. Rows in
/// memory are borrowed, others are read into one buffer: no more than [`BLOCK_BYTES`] of them are held (or one row).
///
/// Whether rows lie in memory or in a file, the blocks are the same: so are all sums over them, bit for bit.
/// Errors: those of `work`, and of the source.
pub fn in_blocks<E: From<StageError>>(
    source: &dyn RowSource,
    chosen: &[usize],
    mut work: impl FnMut(usize, &[&[f64]]) -> Result<(), E>,
) -> Result<(), E> {
    let length = source.row_length();
    let most = rows_per_block(length, BLOCK_BYTES);
    let mut buffer = Vec::new();
    for (number, part) in chosen.chunks(most).enumerate() {
        let borrowed: Option<Vec<&[f64]>> = part.iter().map(|&row| source.borrowed(row)).collect();
        match borrowed {
            Some(rows) => work(number * most, &rows)?,
            None => {
                buffer.resize(part.len() * length, 0.0);
                read(source, part, &mut buffer)?;
                work(number * most, &buffer.chunks_exact(length.max(1)).collect::<Vec<_>>())?;
            }
        }
    }
    Ok(())
}

/// Reads rows, in parallel on a pool's own threads: others, such as the one that keeps results, would wait for one to
/// be free.
fn read(source: &dyn RowSource, rows: &[usize], buffer: &mut [f64]) -> Result<(), StageError> {
    // a row of no values has nothing to read
    let length = source.row_length().max(1);
    match rayon::current_thread_index() {
        Some(_) => buffer.par_chunks_exact_mut(length).zip(rows).try_for_each(|(into, &row)| source.read(row, into)),
        None => buffer.chunks_exact_mut(length).zip(rows).try_for_each(|(into, &row)| source.read(row, into)),
    }
}

/// How many rows of this length fit into so many bytes, one at least.
pub(crate) fn rows_per_block(length: usize, bytes: usize) -> usize {
    (bytes / size_of::<f64>() / length.max(1)).max(1)
}

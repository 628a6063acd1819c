//! Rows of equal length that need not all be in memory: windows of events, of which an archive may hold more than a
//! machine has room for.
//!
//! A `RowWriter` of the floor above takes rows one at a time and keeps them in memory up to a limit, in an unlinked
//! file ([`Scratch`]) beyond it. Block by block ([`in_blocks`]), no more than [`BLOCK_BYTES`] of rows from a file are
//! in memory at once; a slice (`Array::real`) reads all of them.

mod blocks;
mod pinned;
mod scratch;
mod source;
mod stored;

#[cfg(test)]
pub(crate) use blocks::rows_per_block;
pub use blocks::{BLOCK_BYTES, in_blocks};
pub use scratch::Scratch;
pub use source::{RowSource, RowView};
pub use stored::StoredRows;

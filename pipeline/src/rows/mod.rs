//! Rows of equal length that need not all be in memory: windows of events, of which an archive may hold more than a machine has room for.
//!
//! A `RowWriter` of the floor above takes rows one at a time and keeps them in memory up to a limit, in an unlinked file ([`Scratch`]) beyond it. Whoever goes through it block by block ([`in_blocks`]) never holds more than
//! [`BLOCK_BYTES`] of rows that lie in a file; whoever wants a slice (`Array::real`) gets all of it, and pays for that.

mod blocks;
mod scratch;
mod source;
mod stored;

#[cfg(test)]
pub(crate) use blocks::rows_per_block;
pub use blocks::{BLOCK_BYTES, in_blocks};
pub use scratch::Scratch;
pub use source::{RowSource, RowView};
pub use stored::StoredRows;

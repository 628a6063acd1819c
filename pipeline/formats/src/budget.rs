//! How much compressed data may come to.

/// Data that inflate to at most this are short.
pub(crate) const SHORT_BYTES: u64 = 64 << 20;

/// Measured data deflate to a third; columns of equal small numbers to a twentieth.
const MOST_SHRINKING: u64 = 32;

/// Bytes that the compressed data of a file of `file_bytes` may come to: 64 MiB, or 32 times the file. More is no
/// measurement but a file that is made to fill the memory.
pub fn most_inflated(file_bytes: u64) -> u64 {
    file_bytes.saturating_mul(MOST_SHRINKING).max(SHORT_BYTES)
}

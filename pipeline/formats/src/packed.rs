//! A compressed stretch of a file, inflated once when it is first wanted.

use crate::FormatError;
use crate::fail;
use crate::inflating::{Inflating, MOST_FOR_ONE_BYTE};
use crate::pinned::Pinned;
use flate2::Crc;
use std::sync::{Arc, Mutex, PoisonError};

/// Bytes inflated at once.
const PIECE_BYTES: u64 = 1 << 20;

/// Compressed data up to this size are inflated to their end while the file is opened, so that damage shows at once; that takes
/// about a tenth of a second. Longer ones are verified when they are first read.
const VERIFIED_AT_OPENING_BYTES: u64 = 16 << 20;

/// What surrounds the deflated data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wrapper {
    /// zlib's two leading bytes and its Adler-32.
    Zlib,
    /// Nothing; the archive's directory states the CRC-32.
    Bare { crc32: u32 },
}

/// A compressed stretch and, once it has been wanted, its inflated bytes: channels of one variable share them.
#[derive(Debug)]
pub(crate) struct Packed {
    file: Pinned,
    at: u64,
    packed_bytes: u64,
    inflated_bytes: u64,
    wrapper: Wrapper,
    kept: Mutex<Option<Arc<Vec<u8>>>>,
}

impl Packed {
    /// Errors: the stretch cannot hold as many inflated bytes as it says, or ends behind the file's end.
    pub(crate) fn new(
        file: &Pinned,
        at: u64,
        packed_bytes: u64,
        inflated_bytes: u64,
        wrapper: Wrapper,
    ) -> Result<Self, FormatError> {
        if at.checked_add(packed_bytes).is_none_or(|end| end > file.bytes()) {
            let problem = format!("{packed_bytes} compressed bytes are announced, the file ends before");
            return Err(fail::at(at, problem, fail::COPY_AGAIN));
        }
        if inflated_bytes > packed_bytes.saturating_mul(MOST_FOR_ONE_BYTE) {
            let problem = format!(
                "{inflated_bytes} bytes cannot come from {packed_bytes} compressed ones, {MOST_FOR_ONE_BYTE} from each are possible"
            );
            return Err(fail::at(at, problem, fail::COPY_AGAIN));
        }
        Ok(Self { file: file.clone(), at, packed_bytes, inflated_bytes, wrapper, kept: Mutex::new(None) })
    }

    /// Bytes that it holds once it was read.
    pub(crate) fn inflated_bytes(&self) -> u64 {
        self.inflated_bytes
    }

    /// A decoder at the beginning.
    pub(crate) fn inflating(&self) -> Result<Inflating, FormatError> {
        let zlib = self.wrapper == Wrapper::Zlib;
        Ok(Inflating::new(self.file.reopen()?, self.at, self.at + self.packed_bytes, zlib))
    }

    /// Inflates it all without keeping it, if it is short: see `VERIFIED_AT_OPENING_BYTES`.
    pub(crate) fn verify_if_short(&self) -> Result<(), FormatError> {
        if self.packed_bytes <= VERIFIED_AT_OPENING_BYTES { self.inflate(|_| ()) } else { Ok(()) }
    }

    /// The inflated bytes, exactly as many as were announced.
    pub(crate) fn bytes(&self) -> Result<Arc<Vec<u8>>, FormatError> {
        // A panic of another thread cannot leave half of the bytes here: they are stored whole.
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(bytes) = kept.as_ref() {
            return Ok(Arc::clone(bytes));
        }
        let mut bytes = Vec::new();
        self.inflate(|piece| bytes.extend_from_slice(piece))?;
        let bytes = Arc::new(bytes);
        *kept = Some(Arc::clone(&bytes));
        Ok(bytes)
    }

    fn inflate(&self, mut with: impl FnMut(&[u8])) -> Result<(), FormatError> {
        let mut inflating = self.inflating()?;
        let mut buffer = vec![0; self.inflated_bytes.min(PIECE_BYTES) as usize];
        let mut crc = Crc::new();
        let mut left = self.inflated_bytes;
        while left > 0 {
            let some = left.min(PIECE_BYTES);
            let piece = buffer.get_mut(..some as usize).unwrap_or_default();
            inflating.fill(piece)?;
            crc.update(piece);
            with(piece);
            left -= some;
        }
        inflating.finish()?;
        match self.wrapper {
            Wrapper::Bare { crc32 } if crc32 != crc.sum() => {
                let problem =
                    format!("the inflated data have the checksum {:08x}, the archive says {crc32:08x}", crc.sum());
                Err(fail::at(self.at, problem, fail::COPY_AGAIN))
            }
            _ => Ok(()),
        }
    }
}

//! Numbers at equal spacing: the samples of one channel.

use crate::fail;
use crate::number::Number;
use crate::packed::Packed;
use crate::pinned::{Pinned, read_at, stretch_end};
use crate::{FormatError, Raw, Source};
use std::path::Path;
use std::sync::Arc;

/// Bytes read at once where samples of other channels lie between.
const BLOCK_BYTES: u64 = 1 << 20;

/// From this distance on each sample is read alone: a call costs about as much as copying this many bytes.
const FAR_BYTES: u64 = 1 << 13;

/// Where the bytes are.
#[derive(Debug, Clone)]
pub(crate) enum Store {
    /// In the file as they are.
    File(Pinned),
    /// Compressed; positions count inflated bytes.
    Packed(Arc<Packed>),
}

/// Samples of one type, the first at byte `first`, each `step` bytes behind the one before.
#[derive(Debug, Clone)]
pub(crate) struct Grid {
    /// Where the bytes are.
    pub(crate) store: Store,
    /// Byte of sample 0.
    pub(crate) first: u64,
    /// Bytes from one sample to the next, at least one sample's.
    pub(crate) step: u64,
    /// Number of samples.
    pub(crate) samples: usize,
    /// Their type.
    pub(crate) number: Number,
    /// Their byte order.
    pub(crate) big_endian: bool,
}

/// A source of numbers at equal spacing in a file: the first at byte `first`, each `step` bytes behind the one before.
///
/// Errors: no such file; the numbers would lie outside of it.
pub fn numbers_in_file(
    path: &Path,
    (first, step): (u64, u64),
    samples: usize,
    number: Number,
    big_endian: bool,
) -> Result<Arc<dyn Source>, FormatError> {
    let (pinned, _) = Pinned::open(path).map_err(|error| error.in_file(path))?;
    let length =
        (samples as u64).saturating_sub(1).checked_mul(step).and_then(|bytes| bytes.checked_add(number.bytes()));
    let end = length.and_then(|length| first.checked_add(length)).unwrap_or(u64::MAX);
    if samples > 0 && (end > pinned.bytes() || step < number.bytes()) {
        return Err(fail::truncated("samples", first, end.saturating_sub(first), pinned.bytes()).in_file(path));
    }
    Ok(Arc::new(Grid { store: Store::File(pinned), first, step, samples, number, big_endian }))
}

impl Source for Grid {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        stretch_end(start, count, self.samples)?;
        if count == 0 {
            return Ok(self.number.decode(&[], self.big_endian));
        }
        let at = self.first.saturating_add((start as u64).saturating_mul(self.step));
        let bytes = match &self.store {
            Store::File(file) if self.is_direct() => {
                let file = file.reopen()?;
                return self.number.read(count, self.big_endian, |bytes| read_at(&file, at, bytes));
            }
            Store::File(file) => {
                let file = file.reopen()?;
                self.spread_bytes(at, count, |at, block| read_at(&file, at, block))?
            }
            Store::Packed(packed) if self.step == self.number.bytes() => {
                return self.number.read(count, self.big_endian, |bytes| packed.read(at, bytes));
            }
            Store::Packed(packed) => self.spread_bytes(at, count, |at, block| packed.read(at, block))?,
        };
        Ok(self.number.decode(&bytes, self.big_endian))
    }

    fn is_direct(&self) -> bool {
        matches!(self.store, Store::File(_)) && self.step == self.number.bytes()
    }

    fn kept_bytes(&self) -> u64 {
        match &self.store {
            Store::File(_) => 0,
            Store::Packed(packed) => packed.kept_bytes(),
        }
    }
}

/// Samples that are stored with the last recorded one first.
#[derive(Debug, Clone)]
pub(crate) struct Backwards(pub(crate) Grid);

impl Source for Backwards {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        let end = stretch_end(start, count, self.0.samples)?;
        self.0.read(self.0.samples - end, count).map(Raw::reversed)
    }
}

impl Grid {
    /// Of numbers that do not lie side by side.
    fn spread_bytes(
        &self,
        at: u64,
        count: usize,
        mut read: impl FnMut(u64, &mut [u8]) -> Result<(), FormatError>,
    ) -> Result<Vec<u8>, FormatError> {
        let size = self.number.bytes();
        let at_once = if self.step > FAR_BYTES { 1 } else { (BLOCK_BYTES / self.step).max(1) as usize };
        let mut bytes = Vec::with_capacity(count * size as usize);
        let mut block = Vec::new();
        let mut done = 0;
        while done < count {
            let some = at_once.min(count - done);
            block.resize(((some as u64 - 1) * self.step + size) as usize, 0);
            read(at + done as u64 * self.step, &mut block)?;
            self.pick(&block, &mut bytes);
            done += some;
        }
        Ok(bytes)
    }

    /// One number from each step.
    fn pick(&self, block: &[u8], into: &mut Vec<u8>) {
        let size = self.number.bytes() as usize;
        for item in block.chunks(self.step as usize) {
            into.extend_from_slice(item.get(..size).unwrap_or_default());
        }
    }
}

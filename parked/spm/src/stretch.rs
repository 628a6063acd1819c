//! Samples that lie one after the other in a file.

use std::path::Path;
use std::sync::Arc;

use common::{FormatError, Raw, Source};

use crate::damage;
use crate::file::Opened;
use crate::samples::{Code, Order, reversed};

/// Uncompressed samples of one channel, one after the other.
#[derive(Debug)]
pub(crate) struct Stretch {
    /// The file.
    pub(crate) path: Arc<Path>,
    /// Its size when its header was read.
    pub(crate) file_bytes: u64,
    /// Byte of the first stored sample.
    pub(crate) at: u64,
    /// How many there are.
    pub(crate) samples: usize,
    /// Their type.
    pub(crate) code: Code,
    /// Their byte order.
    pub(crate) order: Order,
    /// Whether the sample that was recorded first is stored last.
    pub(crate) backwards: bool,
}

impl Source for Stretch {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        check_range(start, count, self.samples)?;
        let first = if self.backwards { self.samples - start - count } else { start };
        let from = self.at + first as u64 * self.code.bytes();
        let file = Opened::again(&self.path, self.file_bytes)?;
        let raw = self.code.decode(&file.read("samples", from, count as u64 * self.code.bytes())?, self.order);
        Ok(if self.backwards { reversed(raw) } else { raw })
    }
}

/// Errors: the stretch from `start` goes beyond the last of `samples`.
pub(crate) fn check_range(start: usize, count: usize, samples: usize) -> Result<(), FormatError> {
    if start.checked_add(count).is_some_and(|end| end <= samples) {
        return Ok(());
    }
    Err(damage::whole(
        format!("wanted {count} samples from sample {start}, found a channel of {samples}"),
        "ask for a stretch inside the channel",
    ))
}

//! Reads samples of a TDMS channel.

use super::decode;
use super::extents::{Extents, Shape};
use super::kind::Kind;
use super::scale::Scaling;
use crate::fail;
use crate::pinned::{Pinned, read_at, stretch_end};
use crate::{FormatError, Raw, Source};

/// Bytes read at once: large enough that the call does not count, small enough for a cache.
const BLOCK: u64 = 1 << 20;
/// Chunks in which a channel has fewer bytes in a row than this are read whole, neighbours included: a page of the disk
/// is read anyhow.
const WORTH_A_READ: u64 = 4096;

/// Where a channel's samples come from.
#[derive(Debug)]
pub(super) struct Samples {
    pub(super) pinned: Pinned,
    pub(super) extents: Extents,
    pub(super) kind: Kind,
    pub(super) digital: bool,
    /// A scaling that is no straight line.
    pub(super) curve: Option<Scaling>,
}

impl Source for Samples {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        let end = stretch_end(start, count, self.extents.samples())?;
        let file = self.pinned.reopen()?;
        let mut raw = decode::empty(self.kind, self.digital, count);
        let mut block = Vec::new();
        let mut sample = start;
        while sample < end {
            let found = self.extents.find(sample);
            let (shape, at, first, left) = found
                .ok_or_else(|| fail::plain(format!("sample {sample} is nowhere in the file"), fail::COPY_AGAIN))?;
            let count = at_once(&shape, first).min(left).min((end - sample) as u64).max(1);
            let from = shape.byte_of(first);
            let width = u64::from(shape.kind.width().unwrap_or(0));
            block.resize((shape.byte_of(first + count - 1) + width - from) as usize, 0);
            read_at(&file, at + from, &mut block)?;
            decode::append(&mut raw, &shape, &block, first, count);
            sample += count as usize;
        }
        Ok(self.scaled(raw))
    }
}

impl Samples {
    fn scaled(&self, raw: Raw) -> Raw {
        let Some(curve) = &self.curve else { return raw };
        Raw::Float64(raw.widened().into_iter().map(|code| curve.value(code)).collect())
    }
}

/// Samples from `first` on that are read at once.
fn at_once(shape: &Shape, first: u64) -> u64 {
    let per_chunk = shape.per_chunk.max(1);
    let left_in_chunk = per_chunk - first % per_chunk;
    if per_chunk.saturating_mul(shape.stride) < WORTH_A_READ && shape.chunk_stride <= BLOCK {
        let more_chunks = (BLOCK / shape.chunk_stride.max(1)).saturating_sub(1);
        return left_in_chunk + more_chunks * per_chunk;
    }
    left_in_chunk.min(BLOCK / shape.stride.max(1)).max(1)
}

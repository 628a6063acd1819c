//! Where one channel's samples lie, segment after segment.

use super::kind::Kind;
use crate::number::Order;

/// How samples lie in the chunks of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    pub(super) kind: Kind,
    pub(super) order: Order,
    /// Bit of a digital line.
    pub(super) bit: Option<u8>,
    /// Samples of the channel in a chunk, at least 1.
    pub(super) per_chunk: u64,
    /// Bytes from one chunk to the next.
    pub(super) chunk_stride: u64,
    /// Bytes from one sample to the next in a chunk.
    pub(super) stride: u64,
}

impl Shape {
    /// Byte of a sample, counted from the first one's.
    pub(super) fn byte_of(&self, sample: u64) -> u64 {
        let per_chunk = self.per_chunk.max(1);
        (sample / per_chunk) * self.chunk_stride + (sample % per_chunk) * self.stride
    }
}

/// The samples of one segment.
#[derive(Debug, Clone, Copy)]
struct Extent {
    first: usize,
    at: u64,
    shape: u32,
}

/// All samples of a channel. Shapes are kept once as long as they don't change: a long recording has many segments of
/// one shape.
#[derive(Debug, Clone, Default)]
pub(super) struct Extents {
    extents: Vec<Extent>,
    shapes: Vec<Shape>,
    samples: usize,
}

impl Extents {
    pub(super) fn samples(&self) -> usize {
        self.samples
    }

    pub(super) fn push(&mut self, at: u64, samples: u64, shape: Shape) {
        if samples == 0 {
            return;
        }
        if self.shapes.last() != Some(&shape) {
            self.shapes.push(shape);
        }
        let shape = self.shapes.len().saturating_sub(1) as u32;
        self.extents.push(Extent { first: self.samples, at, shape });
        self.samples = self.samples.saturating_add(samples as usize);
    }

    /// The one type of all samples; none if there are several.
    pub(super) fn kind(&self) -> Option<(Kind, bool)> {
        let of = |shape: &Shape| (shape.kind, shape.bit.is_some());
        let first = self.shapes.first().map(of)?;
        self.shapes.iter().all(|s| of(s) == first).then_some(first)
    }

    /// The segment's part that holds `sample`: its shape, the first sample's byte, the sample within it and how many
    /// follow in it, this one included.
    pub(super) fn find(&self, sample: usize) -> Option<(Shape, u64, u64, u64)> {
        let behind = self.extents.partition_point(|e| e.first <= sample);
        let extent = self.extents.get(behind.checked_sub(1)?)?;
        let end = self.extents.get(behind).map_or(self.samples, |next| next.first);
        let shape = *self.shapes.get(extent.shape as usize)?;
        Some((shape, extent.at, (sample - extent.first) as u64, end.checked_sub(sample)? as u64))
    }
}

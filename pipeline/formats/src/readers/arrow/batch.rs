//! What a record batch says of its columns.

use super::layout::{Leaf, Level, Place};
use super::message::Message;
use super::stored::damaged;
use crate::FormatError;
use crate::columnar::{Buffer, Codec};

/// Number of values, and how many are missing.
const NODE_BYTES: usize = 16;

/// First byte within the body, and length.
const BUFFER_BYTES: usize = 16;

/// Some bytes of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) at: u64,
    pub(super) bytes: u64,
}

/// Part of a column: that of one record batch.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    pub(super) rows: u64,
    /// How its buffers are packed, if they are.
    pub(super) codec: Option<Codec>,
    /// Which values are there, a bit each, and which of the structs around them; empty if none is missing.
    pub(super) there: Vec<Span>,
    pub(super) data: Span,
}

/// A batch that is being read.
#[derive(Debug)]
struct Batch<'a> {
    message: &'a Message,
    buffer: Buffer<'a>,
    rows: u64,
    codec: Option<Codec>,
    /// Where its nodes, buffers and numbers of buffers are in the description, and how many there are.
    nodes: (usize, usize),
    buffers: (usize, usize),
    /// Buffers of the first columns of views: none, of the first, of the first two, ...
    views: Vec<usize>,
}

/// Adds the part of each column. Errors: damaged; packed in an unknown way.
pub(super) fn add_parts(message: &Message, leaves: &[Leaf], parts: &mut [Vec<Part>]) -> Result<(), FormatError> {
    let wrong = |problem: String| damaged(message.at, &format!("its record batch {problem}"));
    let batch = Batch::of(message).map_err(wrong)?;
    for (leaf, parts) in leaves.iter().zip(parts).filter(|(leaf, _)| !leaf.levels.is_empty()) {
        parts.push(batch.part(leaf).map_err(wrong)?);
    }
    Ok(())
}

impl<'a> Batch<'a> {
    fn of(message: &'a Message) -> Result<Self, String> {
        let (buffer, table) = (message.buffer(), message.table);
        let codec = match buffer.inner(table, 3) {
            None => None,
            Some(packing) => Some(match (buffer.whole::<1>(packing, 0, 0), buffer.whole::<1>(packing, 1, 0)) {
                (0, 0) => Codec::Lz4Frame,
                (1, 0) => Codec::Zstandard,
                (codec, _) => return Err(format!("is packed in an unknown way ({codec}), wanted LZ4 or Zstandard")),
            }),
        };
        let rows = buffer.whole::<8>(table, 0, 0) as u64;
        let nodes = buffer.structs(table, 1, NODE_BYTES).unwrap_or((0, 0));
        let buffers = buffer.structs(table, 2, BUFFER_BYTES).unwrap_or((0, 0));
        let (first, count) = buffer.structs(table, 4, 8).unwrap_or((0, 0));
        let mut views = vec![0];
        for number in 0..count {
            let more = buffer.number::<8>(first + 8 * number).filter(|more| *more <= buffers.1);
            let more = more.ok_or("has columns of texts with more buffers than there are")?;
            views.push(views.last().copied().unwrap_or(0) + more);
        }
        Ok(Self { message, buffer, rows, codec, nodes, buffers, views })
    }

    fn part(&self, leaf: &Leaf) -> Result<Part, String> {
        let mut there = Vec::new();
        for level in &leaf.levels {
            if self.misses_some(level)? {
                there.push(self.span(level.there)?);
            }
        }
        Ok(Part { rows: self.rows, codec: self.codec, there, data: self.span(leaf.data)? })
    }

    fn misses_some(&self, level: &Level) -> Result<bool, String> {
        let at = (level.node < self.nodes.1).then(|| self.nodes.0 + NODE_BYTES * level.node);
        let pair = at.and_then(|at| self.buffer.number::<8>(at).zip(self.buffer.number::<8>(at + 8)));
        let (rows, missing) = pair.ok_or("does not describe each column")?;
        if rows as u64 != self.rows {
            return Err(format!("has {} rows, one of its columns {rows}", self.rows));
        }
        Ok(missing > 0)
    }

    fn span(&self, place: Place) -> Result<Span, String> {
        let views = self.views.get(place.views).ok_or("does not say in how many buffers its texts are")?;
        let number = place.buffer.saturating_add(*views);
        let at = (number < self.buffers.1).then(|| self.buffers.0 + BUFFER_BYTES * number);
        let pair = at.and_then(|at| self.buffer.number::<8>(at).zip(self.buffer.number::<8>(at + 8)));
        let (from, bytes) = pair.map(|(from, bytes)| (from as u64, bytes as u64)).ok_or("has too few buffers")?;
        if from.checked_add(bytes).is_none_or(|end| end > self.message.body_bytes) {
            return Err(format!("has a buffer of {bytes} bytes from byte {from} in {}", self.message.body_bytes));
        }
        Ok(Span { at: self.message.body_at + from, bytes })
    }
}

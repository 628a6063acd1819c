//! How the objects share a segment's chunks.

use super::index::Index;
use super::kind::Kind;
use super::object::Object;
use crate::FormatError;
use crate::fail;

/// One row of samples in a chunk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    /// Which object's.
    pub(super) object: usize,
    pub(super) scaler: Option<u32>,
    pub(super) kind: Kind,
    pub(super) bit: Option<u8>,
    /// The block of the chunk it lies in, and the byte in that block.
    pub(super) block: usize,
    pub(super) offset: u64,
    /// Samples per chunk.
    pub(super) values: u64,
}

/// A part of a chunk: rows of equal width, one after the other. Contiguous data have a block per channel, interleaved
/// data one, DAQmx data one per raw buffer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub(super) row_width: u64,
    pub(super) bytes: u64,
}

/// The chunk.
#[derive(Debug, Default)]
pub(super) struct Plan {
    pub(super) entries: Vec<Entry>,
    pub(super) blocks: Vec<Block>,
    pub(super) chunk_bytes: u64,
}

impl Plan {
    /// Arranges the listed objects. `at` is the segment's byte, for errors.
    pub(super) fn of(objects: &[Object], listed: &[usize], interleaved: bool, at: u64) -> Result<Self, FormatError> {
        let with_data = || {
            listed.iter().filter_map(|&number| {
                let object = objects.get(number).filter(|o| o.has_data)?;
                Some((number, object, object.index.as_ref().filter(|i| i.values > 0)?))
            })
        };
        let daqmx = with_data().filter(|(_, _, index)| index.daqmx.is_some()).count();
        let mut plan = Self::default();
        if daqmx > 0 && daqmx < with_data().count() {
            return Err(fail::at(at, "the segment mixes DAQmx raw data with others", fail::COPY_AGAIN));
        }
        for (number, object, index) in with_data() {
            let added = match (&index.daqmx, interleaved) {
                (Some(_), _) => plan.add_daqmx(number, index),
                (None, true) => plan.add_interleaved(number, index),
                (None, false) => plan.add_contiguous(number, index),
            };
            added.map_err(|why| fail::at(at, format!("{}: {why}", object.path), fail::COPY_AGAIN))?;
        }
        let sum = plan.blocks.iter().try_fold(0_u64, |sum, block| sum.checked_add(block.bytes));
        plan.chunk_bytes = sum.ok_or_else(|| fail::at(at, "a chunk has more than 2^64 bytes", fail::COPY_AGAIN))?;
        Ok(plan)
    }

    fn add_contiguous(&mut self, object: usize, index: &Index) -> Result<(), String> {
        // Text has no rows: its block is whole or it is nothing.
        let row_width = index.kind.width().map_or(index.bytes, u64::from);
        let block = self.blocks.len();
        self.blocks.push(Block { row_width, bytes: index.bytes });
        self.entries.push(entry(object, index, block, 0));
        Ok(())
    }

    fn add_interleaved(&mut self, object: usize, index: &Index) -> Result<(), String> {
        let width = index.kind.width().ok_or_else(|| format!("{} cannot be interleaved", index.kind.name()))?;
        if self.entries.first().is_some_and(|e| e.values != index.values) {
            return Err(format!("{} values where the others of its rows have another number", index.values));
        }
        if self.blocks.is_empty() {
            self.blocks.push(Block { row_width: 0, bytes: 0 });
        }
        let Some(block) = self.blocks.first_mut() else { return Ok(()) };
        self.entries.push(entry(object, index, 0, block.row_width));
        block.row_width += u64::from(width);
        block.bytes = block.row_width.checked_mul(index.values).ok_or("more values than a file can hold")?;
        Ok(())
    }

    fn add_daqmx(&mut self, object: usize, index: &Index) -> Result<(), String> {
        let Some(daqmx) = &index.daqmx else { return Ok(()) };
        let widths = || daqmx.row_widths.iter().map(|&w| u64::from(w));
        if self.blocks.is_empty() {
            self.blocks = widths().map(|row_width| Block { row_width, bytes: 0 }).collect();
        }
        if !widths().eq(self.blocks.iter().map(|b| b.row_width)) {
            return Err("the raw buffers' widths differ from those of the channels before it".to_owned());
        }
        for scaler in &daqmx.scalers {
            let offset = u64::from(scaler.offset);
            let block = self.blocks.get_mut(scaler.buffer).ok_or("no such raw buffer")?;
            let bytes = block.row_width.checked_mul(index.values).ok_or("more values than a file can hold")?;
            block.bytes = block.bytes.max(bytes);
            self.entries.push(Entry {
                scaler: Some(scaler.id),
                kind: scaler.kind,
                bit: scaler.bit,
                ..entry(object, index, scaler.buffer, offset)
            });
        }
        Ok(())
    }
}

fn entry(object: usize, index: &Index, block: usize, offset: u64) -> Entry {
    Entry { object, scaler: None, kind: index.kind, bit: None, block, offset, values: index.values }
}

//! Walks the segments: gathers objects, properties and where samples lie, past the raw data.

use super::bytes::Bytes;
use super::extents::Shape;
use super::index::{self, Stated};
use super::lead_in::{LEAD_IN, LeadIn};
use super::object::Object;
use super::plan::Plan;
use super::property;
use crate::FormatError;
use crate::fail;
use crate::number::Order;
use crate::pinned::read_at;
use std::collections::HashMap;
use std::fs::File;

/// What the segments hold.
#[derive(Debug)]
pub(super) struct Recorded {
    pub(super) version: u32,
    pub(super) order: Order,
    /// In the order of their first appearance.
    pub(super) objects: Vec<Object>,
    pub(super) remarks: Vec<String>,
}

#[derive(Debug, Default)]
struct Walk {
    objects: Vec<Object>,
    numbers: HashMap<String, usize>,
    /// The present list of objects, in the order of their data.
    listed: Vec<usize>,
    list: usize,
    plan: Plan,
    /// Whether the plan's chunks are interleaved.
    interleaved: bool,
    /// Whether the plan has to be made again.
    changed: bool,
    extents_left: u64,
    /// Segments, apart from a cut off last one, whose data are no whole number of chunks.
    odd_segments: usize,
    remarks: Vec<String>,
}

/// Reads all metadata.
pub(super) fn walk(file: &File, file_bytes: u64) -> Result<Recorded, FormatError> {
    // Each stretch of samples takes at least a byte of the file, so that a file that needs more of them is made to fill
    // the memory.
    let mut walk = Walk { extents_left: file_bytes, ..Walk::default() };
    let mut first = None;
    let mut at = 0;
    while at < file_bytes {
        if file_bytes - at < LEAD_IN {
            walk.cut_off(at, file_bytes, first.is_some())?;
            break;
        }
        let mut lead = [0; LEAD_IN as usize];
        read_at(file, at, &mut lead)?;
        let lead = LeadIn::read(&lead, at, file_bytes)?;
        first.get_or_insert(lead);
        if lead.data_at > file_bytes {
            walk.cut_off(at, file_bytes, walk.objects.iter().any(|o| o.samples() > 0))?;
            break;
        }
        walk.segment(file, &lead)?;
        if lead.cut_off {
            walk.remarks
                .push(format!("the file ends before the segment at byte {at} does: the whole values are given"));
        }
        at = lead.end;
    }
    let Some(first) = first else {
        return Err(fail::at(0, "the file is empty, a TDMS segment was wanted", fail::COPY_AGAIN));
    };
    if walk.odd_segments > 0 {
        let odd = walk.odd_segments;
        walk.remarks.push(format!("{odd} segments hold no whole number of chunks: their last, smaller chunk is given"));
    }
    Ok(Recorded { version: first.version, order: first.order, objects: walk.objects, remarks: walk.remarks })
}

impl Walk {
    /// The file ends in a segment's metadata: the segments before it are whole.
    fn cut_off(&mut self, at: u64, end: u64, something: bool) -> Result<(), FormatError> {
        if !something {
            let problem = format!("the file ends at byte {end}, within the first segment's metadata");
            return Err(fail::at(at, problem, fail::COPY_AGAIN));
        }
        self.remarks.push(format!("the file ends within the metadata of the segment at byte {at}: it is left out"));
        Ok(())
    }

    fn segment(&mut self, file: &File, lead: &LeadIn) -> Result<(), FormatError> {
        if lead.has_metadata {
            // The metadata lie within the file: `walk` has looked.
            let metadata_at = lead.at + LEAD_IN;
            let mut metadata = vec![0; lead.data_at.saturating_sub(metadata_at) as usize];
            read_at(file, metadata_at, &mut metadata)?;
            self.metadata(&mut Bytes::new(&metadata, metadata_at, lead.order), lead)?;
        }
        if !lead.has_raw_data {
            return Ok(());
        }
        if std::mem::take(&mut self.changed) || lead.interleaved != self.interleaved {
            self.interleaved = lead.interleaved;
            self.plan = Plan::of(&self.objects, &self.listed, lead.interleaved, lead.at)?;
        }
        let plan = std::mem::take(&mut self.plan);
        let placed = self.place(&plan, lead);
        self.plan = plan;
        placed
    }

    fn metadata(&mut self, bytes: &mut Bytes, lead: &LeadIn) -> Result<(), FormatError> {
        if lead.new_object_list {
            self.listed.clear();
            self.list += 1;
            self.changed = true;
        }
        let count = bytes.u32("the number of objects")?;
        for _ in 0..count {
            let path = bytes.text("an object's path")?;
            let at = bytes.at();
            let number = self.number_of(path);
            let stated = index::read(bytes)?;
            let properties = bytes.u32("the number of properties")?;
            let Some(object) = self.objects.get_mut(number) else { continue };
            if object.listed_in != Some(self.list) {
                object.listed_in = Some(self.list);
                self.listed.push(number);
                self.changed = true;
            }
            self.changed |= apply(object, stated, at)?;
            for _ in 0..properties {
                let (name, value) = property::read(bytes)?;
                object.retimed |= name.starts_with("wf_") || name.starts_with("NI_Exp");
                object.properties.keep(name, value);
            }
        }
        Ok(())
    }

    fn number_of(&mut self, path: String) -> usize {
        let next = self.objects.len();
        let number = *self.numbers.entry(path.clone()).or_insert(next);
        if number == next {
            // The first samples settle the timing, whatever properties there are.
            self.objects.push(Object { path, retimed: true, ..Object::default() });
        }
        number
    }

    /// Notes where the segment's samples are.
    fn place(&mut self, plan: &Plan, lead: &LeadIn) -> Result<(), FormatError> {
        let total = lead.end.saturating_sub(lead.data_at);
        if total == 0 {
            return Ok(());
        }
        if plan.chunk_bytes == 0 {
            let problem = format!("the segment holds {total} bytes of raw data, none of its objects has any");
            return Err(fail::at(lead.data_at, problem, fail::COPY_AGAIN));
        }
        let (chunks, rest) = (total / plan.chunk_bytes, total % plan.chunk_bytes);
        self.odd_segments += usize::from(rest > 0 && !lead.cut_off);
        let rest_sizes = rest_sizes(plan, rest, lead.cut_off || lead.interleaved);
        let rest_at = lead.data_at + chunks * plan.chunk_bytes;
        // Bytes before each block in a whole chunk, and in the rest.
        let (mut before, mut before_rest) = (0, 0);
        let mut starts = Vec::with_capacity(plan.blocks.len());
        for (block, rest) in plan.blocks.iter().zip(&rest_sizes) {
            starts.push((before, before_rest, *rest));
            before += block.bytes;
            before_rest += rest;
        }
        for entry in &plan.entries {
            let Some((block, &(start, rest_start, rest))) = plan.blocks.get(entry.block).zip(starts.get(entry.block))
            else {
                continue;
            };
            let Some(object) = self.objects.get_mut(entry.object) else { continue };
            // Text: a block is one sample here, which nobody reads.
            let values = if entry.kind.width().is_some() { entry.values } else { 1 };
            let rest_values = rest.checked_div(block.row_width).unwrap_or(0).min(values);
            if chunks == 0 && rest_values == 0 {
                continue;
            }
            let stretches = u64::from(chunks > 0) + u64::from(rest_values > 0);
            self.extents_left = self.extents_left.checked_sub(stretches).ok_or_else(|| {
                let problem = "the segments describe more stretches of samples than the file has bytes";
                fail::at(lead.at, problem, fail::COPY_AGAIN)
            })?;
            object.settle_timing();
            let shape = Shape {
                kind: entry.kind,
                order: lead.order,
                bit: entry.bit,
                per_chunk: values,
                chunk_stride: plan.chunk_bytes,
                stride: block.row_width,
            };
            let stream = object.stream(entry.scaler);
            if chunks > 0 {
                stream.push(lead.data_at + start + entry.offset, chunks * values, shape);
            }
            stream.push(rest_at + rest_start + entry.offset, rest_values, shape);
        }
        Ok(())
    }
}

/// Bytes of each block in a last, smaller chunk of `rest` bytes: what there is, one block after the other, where the
/// writer was interrupted; otherwise it wrote fewer values of every channel, in proportion.
fn rest_sizes(plan: &Plan, rest: u64, in_turn: bool) -> Vec<u64> {
    let mut left = rest;
    let in_turn = in_turn || plan.entries.iter().any(|e| e.scaler.is_some());
    let size = |block: &super::plan::Block| {
        if in_turn {
            let size = block.bytes.min(left);
            left -= size;
            return size;
        }
        let rows = block.bytes.checked_div(block.row_width).unwrap_or(0);
        // Below chunk_bytes, hence below 2^64, as rest < chunk_bytes.
        let rows = u128::from(rows) * u128::from(rest) / u128::from(plan.chunk_bytes.max(1));
        rows as u64 * block.row_width
    };
    plan.blocks.iter().map(size).collect()
}

/// Takes over what a segment says about an object's raw data. True if that changed the chunks.
fn apply(object: &mut Object, stated: Stated, at: u64) -> Result<bool, FormatError> {
    let before = object.has_data;
    match stated {
        Stated::Nothing => object.has_data = false,
        Stated::AsBefore if object.index.is_none() => {
            let problem = format!("{} has raw data «as before», but none came before", object.path);
            return Err(fail::at(at, problem, fail::COPY_AGAIN));
        }
        Stated::AsBefore => object.has_data = true,
        Stated::New(index) => {
            let same = object.index.as_ref() == Some(&index);
            object.has_data = true;
            object.index = Some(index);
            return Ok(!same || !before);
        }
    }
    Ok(before != object.has_data)
}

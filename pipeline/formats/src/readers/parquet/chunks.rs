//! The chunks of a column: a chunk for each group of rows.

use super::footer::Chunk;
use super::pages::Reading;
use crate::budget::most_inflated;
use crate::columnar::{Groups, Values};
use crate::number::Number;
use crate::pinned::{Pinned, read_at};
use crate::{FormatError, fail};

/// Where the numbers of a column are.
#[derive(Debug)]
pub(super) struct Chunks {
    pub(super) file: Pinned,
    pub(super) location: String,
    pub(super) number: Number,
    /// In how many ways a value may be missing.
    pub(super) optional: u32,
    pub(super) chunks: Vec<Chunk>,
}

impl Groups for Chunks {
    fn values(&self, group: usize) -> Result<Values, FormatError> {
        let wrong = |at, problem: String| fail::at(at, format!("{}: {problem}", self.location), fail::COPY_AGAIN);
        let chunk = self.chunks.get(group).ok_or_else(|| wrong(0, "a row group is missing".to_owned()))?;
        let codec = chunk.codec.map_err(|name| wrong(chunk.at, format!("it is packed with {name}")))?;
        let mut bytes = vec![0; chunk.bytes as usize];
        read_at(&self.file.reopen()?, chunk.at, &mut bytes)?;
        let most_bytes = most_inflated(self.file.bytes());
        let reading = Reading { number: self.number, optional: self.optional, codec, most_bytes };
        reading.values(&bytes, chunk).map_err(|problem| wrong(chunk.at, problem))
    }
}

//! Inflating a stretch of a file piece by piece.

use crate::FormatError;
use crate::fail;
use crate::pinned::read_at;
use flate2::{Decompress, FlushDecompress, Status};
use std::fs::File;

/// Packed bytes read at once.
const PIECE_BYTES: u64 = 1 << 16;

/// No deflate stream gives more than 1032 bytes for one: 258 bytes for a length code of 1 bit and a distance code of 1
/// bit.
pub(crate) const MOST_FOR_ONE_BYTE: u64 = 1032;

/// A decoder of the bytes `at..end` of a file. Unlike `flate2`'s readers it knows a stream that stops early from one
/// that ends.
#[derive(Debug)]
pub(crate) struct Inflating {
    file: File,
    at: u64,
    end: u64,
    piece: Vec<u8>,
    used: usize,
    state: Decompress,
    ended: bool,
}

impl Inflating {
    /// Begins at byte `at`, with (`zlib`) or without zlib's two leading bytes and checksum.
    pub(crate) fn new(file: File, at: u64, end: u64, zlib: bool) -> Self {
        Self { file, at, end, piece: Vec::new(), used: 0, state: Decompress::new(zlib), ended: false }
    }

    /// Gives at least one byte, or 0 where the stream ends (or `into` is empty).
    pub(crate) fn read(&mut self, into: &mut [u8]) -> Result<usize, FormatError> {
        while !self.ended && !into.is_empty() {
            if self.used >= self.piece.len() && self.at < self.end {
                self.load()?;
            }
            let packed = self.piece.get(self.used..).unwrap_or_default();
            let (taken, given) = (self.state.total_in(), self.state.total_out());
            let status = self.state.decompress(packed, into, FlushDecompress::None).map_err(|e| {
                fail::at(self.here(), format!("the compressed data cannot be inflated: {e}"), fail::COPY_AGAIN)
            })?;
            let taken = (self.state.total_in() - taken) as usize;
            let given = (self.state.total_out() - given) as usize;
            self.used += taken;
            self.ended = status == Status::StreamEnd;
            if given > 0 {
                return Ok(given);
            }
            let all_used = self.used >= self.piece.len() && self.at >= self.end;
            if !self.ended && taken == 0 && (all_used || self.used < self.piece.len()) {
                let problem = "the compressed data stop before their end mark";
                return Err(fail::at(self.here(), problem, fail::COPY_AGAIN));
            }
        }
        Ok(0)
    }

    /// Fills `into`. Errors: the stream is damaged or ends before.
    pub(crate) fn fill(&mut self, into: &mut [u8]) -> Result<(), FormatError> {
        let mut filled = 0;
        while let Some(rest) = into.get_mut(filled..).filter(|rest| !rest.is_empty()) {
            match self.read(rest)? {
                0 => return Err(self.too_short()),
                some => filled += some,
            }
        }
        Ok(())
    }

    /// Inflates `count` bytes and forgets them.
    pub(crate) fn skip(&mut self, count: u64) -> Result<(), FormatError> {
        let mut left = count;
        let mut waste = vec![0; left.min(PIECE_BYTES) as usize];
        while left > 0 {
            let some = (waste.len() as u64).min(left) as usize;
            self.fill(waste.get_mut(..some).unwrap_or_default())?;
            left -= some as u64;
        }
        Ok(())
    }

    /// The stream must end here: its checksum is verified with its end.
    pub(crate) fn finish(&mut self) -> Result<(), FormatError> {
        match self.read(&mut [0])? {
            0 => Ok(()),
            _ => {
                let problem = "the compressed data give more bytes than their header says";
                Err(fail::at(self.here(), problem, fail::COPY_AGAIN))
            }
        }
    }

    fn load(&mut self) -> Result<(), FormatError> {
        let size = (self.end - self.at).min(PIECE_BYTES);
        self.piece.resize(size as usize, 0);
        read_at(&self.file, self.at, &mut self.piece)?;
        self.at += size;
        self.used = 0;
        Ok(())
    }

    /// Byte of the file that is decoded next.
    fn here(&self) -> u64 {
        self.at - (self.piece.len().saturating_sub(self.used)) as u64
    }

    fn too_short(&self) -> FormatError {
        let problem = "the compressed data give fewer bytes than their header says";
        fail::at(self.here(), problem, fail::COPY_AGAIN)
    }
}

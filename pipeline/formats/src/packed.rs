//! A compressed stretch of a file: short ones are inflated once and kept, long ones by stream whenever they are read.

use crate::FormatError;
use crate::budget::{SHORT_BYTES, most_inflated};
use crate::fail;
use crate::inflating::{Inflating, MOST_FOR_ONE_BYTE};
use crate::pinned::Pinned;
use flate2::Crc;
use std::sync::{Arc, Mutex, PoisonError};

/// Bytes inflated at once.
const PIECE_BYTES: u64 = 1 << 20;

/// Decoders of one stretch that wait for who reads on: a thread each, as a rule.
const MOST_STREAMS: usize = 4;

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
    kept: Mutex<Kept>,
}

/// What is there for the next who reads.
#[derive(Debug, Default)]
struct Kept {
    whole: Option<Arc<Vec<u8>>>,
    streams: Vec<Streaming>,
}

/// A decoder, and the byte that it gives next.
#[derive(Debug)]
struct Streaming {
    inflating: Inflating,
    at: u64,
    crc: Crc,
}

impl Packed {
    /// Errors: the stretch cannot hold as many inflated bytes as it says, or ends behind the file's end; all of the
    /// file's come to more than [`most_inflated`].
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
                "{inflated_bytes} bytes cannot come from {packed_bytes} compressed ones, {MOST_FOR_ONE_BYTE} from each \
                 are possible"
            );
            return Err(fail::at(at, problem, fail::COPY_AGAIN));
        }
        if !file.may_inflate(inflated_bytes) {
            let problem = format!(
                "{inflated_bytes} bytes would come from {packed_bytes} compressed ones; all compressed data of a file \
                 of {} bytes may come to {}",
                file.bytes(),
                most_inflated(file.bytes())
            );
            return Err(fail::at(at, problem, "store it uncompressed, if it is no attempt at this machine's memory"));
        }
        Ok(Self { file: file.clone(), at, packed_bytes, inflated_bytes, wrapper, kept: Mutex::default() })
    }

    /// Bytes that it holds once it was read.
    pub(crate) fn kept_bytes(&self) -> u64 {
        if self.is_short() { self.inflated_bytes } else { 0 }
    }

    /// Whether it is kept once it was read, and inflated to its end while the file is opened, so that damage shows at
    /// once. What is longer is verified where a stream reaches its end.
    fn is_short(&self) -> bool {
        self.inflated_bytes <= SHORT_BYTES
    }

    /// A decoder at the beginning.
    pub(crate) fn inflating(&self) -> Result<Inflating, FormatError> {
        let zlib = self.wrapper == Wrapper::Zlib;
        Ok(Inflating::new(self.file.reopen()?, self.at, self.at + self.packed_bytes, zlib))
    }

    /// Inflates it all without keeping it, if it is short.
    pub(crate) fn verify_if_short(&self) -> Result<(), FormatError> {
        if self.is_short() { self.inflate(|_| ()) } else { Ok(()) }
    }

    /// Fills `into` with the inflated bytes from `at`. Errors: damaged; beyond the end.
    pub(crate) fn read(&self, at: u64, into: &mut [u8]) -> Result<(), FormatError> {
        let end = at.checked_add(into.len() as u64).filter(|&end| end <= self.inflated_bytes).ok_or_else(|| {
            let (wanted, all) = (into.len(), self.inflated_bytes);
            fail::plain(format!("{wanted} inflated bytes from {at} were wanted, there are {all}"), fail::COPY_AGAIN)
        })?;
        if self.is_short() {
            let all = self.bytes()?;
            into.copy_from_slice(all.get(at as usize..end as usize).unwrap_or_default());
            return Ok(());
        }
        let mut stream = self.stream_to(at)?;
        stream.skip_to(at)?;
        stream.fill(into)?;
        if stream.at == self.inflated_bytes {
            stream.inflating.finish()?;
            return self.check_sum(&stream.crc);
        }
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.streams.truncate(MOST_STREAMS - 1);
        kept.streams.insert(0, stream);
        Ok(())
    }

    /// The decoder that is nearest before `at`, or a new one.
    fn stream_to(&self, at: u64) -> Result<Streaming, FormatError> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let before = kept.streams.iter().enumerate().filter(|(_, stream)| stream.at <= at);
        let nearest = before.max_by_key(|(_, stream)| stream.at).map(|(index, _)| index);
        match nearest {
            Some(index) => {
                let stream = kept.streams.remove(index);
                drop(kept);
                // the file must still be what it was
                self.file.reopen().map(|_| stream)
            }
            None => Ok(Streaming { inflating: self.inflating()?, at: 0, crc: Crc::new() }),
        }
    }

    /// The inflated bytes, exactly as many as were announced: of headers and short data.
    pub(crate) fn bytes(&self) -> Result<Arc<Vec<u8>>, FormatError> {
        // A panic of another thread cannot leave half of the bytes here: they are stored whole.
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(bytes) = kept.whole.as_ref() {
            return Ok(Arc::clone(bytes));
        }
        let mut bytes = Vec::new();
        self.inflate(|piece| bytes.extend_from_slice(piece))?;
        let bytes = Arc::new(bytes);
        kept.whole = Some(Arc::clone(&bytes));
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
        self.check_sum(&crc)
    }

    fn check_sum(&self, crc: &Crc) -> Result<(), FormatError> {
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

impl Streaming {
    fn fill(&mut self, into: &mut [u8]) -> Result<(), FormatError> {
        self.inflating.fill(into)?;
        self.crc.update(into);
        self.at += into.len() as u64;
        Ok(())
    }

    fn skip_to(&mut self, at: u64) -> Result<(), FormatError> {
        let mut waste = vec![0; at.saturating_sub(self.at).min(PIECE_BYTES) as usize];
        while self.at < at {
            let some = (at - self.at).min(PIECE_BYTES) as usize;
            self.fill(waste.get_mut(..some).unwrap_or_default())?;
        }
        Ok(())
    }
}

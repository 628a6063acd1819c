//! Messages: a description in FlatBuffers, and behind it the bytes that it describes.

use crate::columnar::Buffer;
use crate::opened::Opened;
use crate::{FormatError, fail};

/// What stands before the length of a message; in files before 2019 the length stands alone.
const MARK: [u8; 4] = [0xff; 4];

/// Newest version of the description that is known.
const LAST_VERSION: usize = 4;

/// A description of ten thousand columns has about as many.
const MOST_BYTES: u64 = 64 << 20;

/// What a message describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Schema,
    Dictionary,
    Batch,
    Other,
}

/// A message without its body.
#[derive(Debug)]
pub(super) struct Message {
    pub(super) kind: Kind,
    pub(super) version: usize,
    /// First byte of it in the file.
    pub(super) at: u64,
    /// The description.
    pub(super) bytes: Vec<u8>,
    /// Where in the description the table of this kind is.
    pub(super) table: usize,
    /// First byte of the body in the file, and how many it has.
    pub(super) body_at: u64,
    pub(super) body_bytes: u64,
}

/// What there is at a byte of a file.
#[derive(Debug)]
pub(super) enum Next {
    Message(Message),
    /// The mark of the end, or the end of the file.
    End,
    /// The file ends before the message does.
    Cut,
}

impl Message {
    /// The message at byte `at`. Errors: damaged; unreadable.
    pub(super) fn read(file: &Opened, at: u64) -> Result<Next, FormatError> {
        let damaged = |problem: &str| super::stored::damaged(at, problem);
        let left = file.bytes().saturating_sub(at);
        if left == 0 {
            return Ok(Next::End);
        }
        let head = file.read("a message", at, left.min(8))?;
        let head_bytes = if head.starts_with(&MARK) { 8 } else { 4 };
        let Some(&length) = head.get(head_bytes - 4..).and_then(|word| word.first_chunk::<4>()) else {
            return Ok(Next::Cut);
        };
        let (head_bytes, length) = (head_bytes as u64, u64::from(u32::from_le_bytes(length)));
        if length == 0 {
            return Ok(Next::End);
        }
        if length > MOST_BYTES {
            return Err(damaged(&format!("a description has {length} bytes, more than {MOST_BYTES}")));
        }
        if length > left.saturating_sub(head_bytes) {
            return Ok(Next::Cut);
        }
        let bytes = file.read("the description of a message", at + head_bytes, length)?;
        let (kind, version, table, body_bytes) =
            described(&Buffer::new(&bytes)).ok_or_else(|| damaged("a message has no description"))?;
        if version > LAST_VERSION {
            return Err(fail::at(
                at,
                "a message is of a later version of Arrow than 1.0",
                "save it with an earlier version of the format",
            ));
        }
        let body_at = at + head_bytes + length;
        if body_bytes > file.bytes().saturating_sub(body_at) {
            return Ok(Next::Cut);
        }
        Ok(Next::Message(Self { kind, version, at, bytes, table, body_at, body_bytes }))
    }

    /// First byte behind it in the file.
    pub(super) fn end(&self) -> u64 {
        self.body_at + self.body_bytes
    }

    /// The description, to be read.
    pub(super) fn buffer(&self) -> Buffer<'_> {
        Buffer::new(&self.bytes)
    }
}

/// Kind, version, table and bytes of the body.
fn described(buffer: &Buffer) -> Option<(Kind, usize, usize, u64)> {
    let message = buffer.follow(0)?;
    let kind = match buffer.whole::<1>(message, 1, 0) {
        1 => Kind::Schema,
        2 => Kind::Dictionary,
        3 => Kind::Batch,
        _ => Kind::Other,
    };
    let body = buffer.whole::<8>(message, 3, 0);
    Some((kind, buffer.whole::<2>(message, 0, 0), buffer.inner(message, 2)?, body as u64))
}

/// Whether a file's first bytes are those of a stream: a schema comes first. Its description need not be whole.
pub(super) fn begins_stream(head: &[u8]) -> bool {
    let Some(bytes) = head.strip_prefix(&MARK).and_then(|rest| rest.get(4..)) else { return false };
    let buffer = Buffer::new(bytes);
    let kind = || {
        let message = buffer.follow(0)?;
        Some((buffer.whole::<1>(message, 1, 0), buffer.whole::<2>(message, 0, 0)))
    };
    kind().is_some_and(|(kind, version)| kind == 1 && version <= LAST_VERSION)
}

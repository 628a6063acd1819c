//! A file's schema and its record batches.

use super::message::{Kind, Message, Next};
use crate::columnar::Buffer;
use crate::columnar::arrow_schema::Schema;
use crate::opened::Opened;
use crate::{FormatError, fail};

/// First and last bytes of a file.
pub(super) const MAGIC: &[u8] = b"ARROW1";

/// First bytes of a file of the first version of Feather.
pub(super) const FEATHER_1: &[u8] = b"FEA1";

/// The mark and what fills it up to eight bytes.
const MAGIC_BYTES: u64 = 8;

/// The length of the list of batches and the mark, at the end.
const TAIL_BYTES: u64 = 10;

/// A list of a million record batches has about as many.
const MOST_FOOTER_BYTES: u64 = 64 << 20;

/// Where a record batch is: first byte, bytes of the description, bytes of the body.
const BLOCK_BYTES: usize = 24;

/// What a file has.
#[derive(Debug)]
pub(super) struct Stored {
    /// What kind of file it is, for people.
    pub(super) format: &'static str,
    pub(super) schema: Schema,
    /// Byte of the file at which the schema is, for errors.
    pub(super) schema_at: u64,
    /// The record batches, by their descriptions.
    pub(super) batches: Vec<Message>,
    pub(super) remarks: Vec<String>,
}

/// An error in one line.
pub(super) fn damaged(at: u64, problem: &str) -> FormatError {
    fail::at(at, format!("no readable table of Arrow: {problem}"), fail::COPY_AGAIN)
}

impl Stored {
    /// Errors: no table of Arrow, damaged.
    pub(super) fn read(file: &Opened) -> Result<Self, FormatError> {
        let head = file.head(MAGIC_BYTES)?;
        if head.starts_with(FEATHER_1) {
            let problem = "the file is of the first version of Feather, wanted the second";
            let help = "save it as Feather 2, Parquet or CSV with the program that wrote it";
            return Err(fail::plain(problem, help));
        }
        if !head.starts_with(MAGIC) {
            return Self::stream(file, 0, "Apache Arrow stream");
        }
        let end = file.bytes();
        let tail_at = end.saturating_sub(TAIL_BYTES).max(MAGIC_BYTES.min(end));
        let tail = file.read("the end of the file", tail_at, end - tail_at)?;
        let length = tail.strip_suffix(MAGIC).and_then(|length| length.first_chunk::<4>());
        let Some(&length) = length else {
            let mut found = Self::stream(file, MAGIC_BYTES, "Apache Arrow file")?;
            found.remarks.insert(0, "the file was not finished: the list of its record batches is missing".to_owned());
            return Ok(found);
        };
        Self::by_list(file, tail_at, u64::from(u32::from_le_bytes(length)))
    }

    /// A file with a list of `bytes` bytes, which ends at byte `end`.
    fn by_list(file: &Opened, end: u64, bytes: u64) -> Result<Self, FormatError> {
        let at = end.checked_sub(bytes).filter(|_| bytes <= MOST_FOOTER_BYTES);
        let at = at.ok_or_else(|| damaged(end, "the list of its record batches is longer than the file"))?;
        let footer = file.read("the list of record batches", at, bytes)?;
        let buffer = Buffer::new(&footer);
        let incomplete = || damaged(at, "the list of its record batches is incomplete");
        let table = buffer.follow(0).ok_or_else(incomplete)?;
        let schema =
            buffer.inner(table, 1).and_then(|schema| Schema::read(&buffer, schema, buffer.whole::<2>(table, 0, 0)));
        let mut schema = schema.ok_or_else(|| no_schema(at))?;
        schema.texts.extend(buffer.pairs(table, 4));
        let (first, count) = buffer.structs(table, 3, BLOCK_BYTES).unwrap_or((0, 0));
        let mut batches = Vec::new();
        let mut bytes_left = file.bytes();
        for block in 0..count {
            let place = buffer.number::<8>(first + block * BLOCK_BYTES).ok_or_else(incomplete)? as u64;
            let Next::Message(message) = Message::read(file, place)? else {
                return Err(damaged(place, &format!("record batch {block} is not where the list has it")));
            };
            if message.kind != Kind::Batch {
                return Err(damaged(place, &format!("there is no record batch {block} where the list has it")));
            }
            let left = bytes_left.checked_sub(message.end() - message.at);
            bytes_left = left.ok_or_else(|| damaged(at, "its record batches have more bytes than the file"))?;
            batches.push(message);
        }
        Ok(Self { format: "Apache Arrow file", schema, schema_at: at, batches, remarks: Vec::new() })
    }

    /// Messages from byte `at` on, as far as they are whole.
    fn stream(file: &Opened, at: u64, format: &'static str) -> Result<Self, FormatError> {
        let Next::Message(first) = Message::read(file, at)? else {
            return Err(damaged(at, "it ends before its schema does"));
        };
        let schema = Some(&first).filter(|first| first.kind == Kind::Schema);
        let schema = schema.and_then(|first| Schema::read(&first.buffer(), first.table, first.version));
        let schema = schema.ok_or_else(|| no_schema(at))?;
        let mut found = Self { format, schema, schema_at: at, batches: Vec::new(), remarks: Vec::new() };
        let mut place = first.end();
        loop {
            match Message::read(file, place)? {
                Next::Message(message) => {
                    place = message.end();
                    match message.kind {
                        Kind::Batch => found.batches.push(message),
                        Kind::Schema => return Err(damaged(message.at, "it has a second schema")),
                        Kind::Dictionary | Kind::Other => {}
                    }
                }
                Next::End => return Ok(found),
                Next::Cut => {
                    let (end, count) = (file.bytes(), found.batches.len());
                    found.remarks.push(format!(
                        "the file ends at byte {end}, within the record batch from byte {place}: the {count} before are \
                         read"
                    ));
                    return Ok(found);
                }
            }
        }
    }
}

fn no_schema(at: u64) -> FormatError {
    damaged(at, "its schema is missing, damaged, or has more columns than any recording")
}

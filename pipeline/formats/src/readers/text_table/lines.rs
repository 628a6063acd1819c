//! Lines of a text file, with their number and byte, one at a time.

use super::packed;
use crate::FormatError;
use crate::fail;
use crate::text::{decoded, is_utf16, utf16};
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};

/// Marks UTF-8.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
/// Longest line: 100 000 columns of ten characters. A longer one is no line of a table.
const LONGEST: u64 = 1 << 20;

/// A line without its end.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub(super) text: String,
    /// Counted from 1.
    pub(super) number: usize,
    /// Its first byte.
    pub(super) at: u64,
    /// Whether an end of line follows it.
    pub(super) ended: bool,
}

/// Reads lines.
pub(super) struct Lines {
    reader: Box<dyn BufRead>,
    file_bytes: u64,
    at: u64,
    number: usize,
    /// A line that was looked at and not taken.
    ahead: Option<Line>,
}

impl Lines {
    /// The lines of a file, packed with gzip or not. Errors: it cannot be read.
    pub(super) fn open(file: File, file_bytes: u64) -> Result<Self, FormatError> {
        let mut file = BufReader::with_capacity(1 << 16, file);
        let first = file.fill_buf().map_err(|error| packed::unreadable(&error))?;
        if packed::is_packed(first) {
            let (inside, most) = packed::inside(file, file_bytes);
            return Self::new(inside, most);
        }
        Self::new(Box::new(file), file_bytes)
    }

    fn new(file: Box<dyn Read>, file_bytes: u64) -> Result<Self, FormatError> {
        let mut lines = Self {
            reader: Box::new(BufReader::with_capacity(1 << 16, file)),
            file_bytes,
            at: 0,
            number: 0,
            ahead: None,
        };
        let head = lines.reader.fill_buf().map_err(|e| cannot(0, &e))?;
        if is_utf16(head) {
            let mut bytes = Vec::new();
            lines.reader.read_to_end(&mut bytes).map_err(|e| cannot(0, &e))?;
            let text = utf16(&bytes);
            lines.file_bytes = text.len() as u64;
            lines.reader = Box::new(Cursor::new(text.into_bytes()));
            return Ok(lines);
        }
        if head.starts_with(BYTE_ORDER_MARK) {
            lines.reader.consume(BYTE_ORDER_MARK.len());
            lines.at = BYTE_ORDER_MARK.len() as u64;
        }
        Ok(lines)
    }

    /// Size of the file: no more numbers than this can be in it.
    pub(super) fn file_bytes(&self) -> u64 {
        self.file_bytes
    }

    /// The next line, which stays the next one.
    pub(super) fn peek(&mut self) -> Result<Option<&Line>, FormatError> {
        if self.ahead.is_none() {
            self.ahead = self.fetch()?;
        }
        Ok(self.ahead.as_ref())
    }

    /// The next line.
    pub(super) fn next(&mut self) -> Result<Option<Line>, FormatError> {
        match self.ahead.take() {
            Some(line) => Ok(Some(line)),
            None => self.fetch(),
        }
    }

    fn fetch(&mut self) -> Result<Option<Line>, FormatError> {
        let mut bytes = Vec::new();
        let at = self.at;
        let read = (&mut self.reader).take(LONGEST).read_until(b'\n', &mut bytes).map_err(|e| cannot(at, &e))?;
        if read == 0 {
            return Ok(None);
        }
        self.at += read as u64;
        self.number += 1;
        let ended = bytes.last() == Some(&b'\n');
        if !ended && read as u64 == LONGEST {
            let problem = format!("line {} is longer than {LONGEST} bytes, a row of a table was wanted", self.number);
            return Err(fail::at(at, problem, "is this a table of text with an end of line behind each row?"));
        }
        if let Some(zero) = bytes.iter().position(|&b| b == 0) {
            let problem = format!("line {} has a byte 0, text was wanted", self.number);
            return Err(fail::at(at + zero as u64, problem, "the file is binary or damaged"));
        }
        while bytes.last().is_some_and(|b| matches!(b, b'\n' | b'\r')) {
            bytes.pop();
        }
        Ok(Some(Line { text: decoded(bytes), number: self.number, at, ended }))
    }
}

fn cannot(at: u64, error: &std::io::Error) -> FormatError {
    fail::at(at, format!("the file cannot be read: {error}"), fail::COPY_AGAIN)
}

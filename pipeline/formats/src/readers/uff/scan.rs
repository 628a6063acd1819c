//! Finds the datasets: each lies between two lines `    -1` and begins with its number.

use super::fixed::{stated, text};
use super::header::{Header, RECORDS, Record};
use crate::FormatError;
use crate::fail;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Seek, SeekFrom};

/// What stands, behind blanks, on the line before and behind a dataset.
pub(super) const DELIMITER: &[u8] = b"-1";
/// Of longer lines only this much is kept: records have 80 columns.
const KEPT: usize = 256;

/// A dataset 58.
#[derive(Debug)]
pub(super) struct Dataset {
    pub(super) header: Header,
    pub(super) data: Data,
    /// Bytes of the data.
    pub(super) from: u64,
    pub(super) to: u64,
}

/// How data are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Data {
    Text,
    LittleEndian,
    BigEndian,
}

/// What a file holds.
#[derive(Debug, Default)]
pub(super) struct Scanned {
    pub(super) datasets: Vec<Dataset>,
    /// Other datasets and how many there are of each.
    pub(super) others: BTreeMap<String, usize>,
    pub(super) remarks: Vec<String>,
}

#[derive(Debug)]
struct Scanner {
    reader: BufReader<File>,
    at: u64,
    file_bytes: u64,
}

/// Looks through the whole file; binary data are skipped.
pub(super) fn scan(file: File, file_bytes: u64) -> Result<Scanned, FormatError> {
    let mut scanner = Scanner { reader: BufReader::with_capacity(1 << 16, file), at: 0, file_bytes };
    let mut scanned = Scanned::default();
    let mut any = false;
    while let Some(line) = scanner.line()? {
        if line.line.trim_ascii().is_empty() {
            continue;
        }
        if line.line.trim_ascii() != DELIMITER {
            let found = text(&line.line, 0, 20);
            let problem = format!("«{found}» was found, a line «    -1» in front of a dataset was wanted");
            return Err(fail::at(line.at, problem, fail::COPY_AGAIN));
        }
        let Some(number) = scanner.line()? else { break };
        any = true;
        let is_58 = text(&number.line, 0, 6) == "58";
        if is_58 {
            scanned.datasets.push(scanner.dataset(&number)?);
        } else {
            let name = stated(&number.line, 0, 7).unwrap_or_else(|| "without a number".to_owned());
            scanner.skip_to_delimiter(number.at)?;
            *scanned.others.entry(name).or_insert(0) += 1;
        }
    }
    if !any {
        return Err(fail::at(0, "the file has no dataset, a line «    -1» and a number were wanted", fail::COPY_AGAIN));
    }
    Ok(scanned)
}

impl Scanner {
    /// The next line, without its end.
    fn line(&mut self) -> Result<Option<Record>, FormatError> {
        let at = self.at;
        let mut line = Vec::new();
        loop {
            let buffer = self.reader.fill_buf().map_err(|e| cannot(at, &e))?;
            if buffer.is_empty() {
                return Ok((self.at > at).then_some(Record { line, at }));
            }
            let end = buffer.iter().position(|&b| b == b'\n');
            let part = buffer.get(..end.unwrap_or(buffer.len())).unwrap_or_default();
            line.extend(part.iter().take(KEPT - line.len().min(KEPT)));
            let used = part.len() + usize::from(end.is_some());
            self.reader.consume(used);
            self.at += used as u64;
            if end.is_some() {
                while line.last() == Some(&b'\r') {
                    line.pop();
                }
                return Ok(Some(Record { line, at }));
            }
        }
    }

    /// Skips to behind the line that ends a dataset; gives the byte of that line.
    fn skip_to_delimiter(&mut self, from: u64) -> Result<u64, FormatError> {
        while let Some(line) = self.line()? {
            if line.line.trim_ascii() == DELIMITER {
                return Ok(line.at);
            }
        }
        Err(fail::at(from, "the file ends within this dataset, a line «    -1» was wanted", fail::COPY_AGAIN))
    }

    /// Reads a dataset 58 or 58b behind its number.
    fn dataset(&mut self, number: &Record) -> Result<Dataset, FormatError> {
        let binary = number.line.get(6).is_some_and(|b| b.eq_ignore_ascii_case(&b'b'));
        let mut records = Vec::new();
        for _ in 0..RECORDS {
            let record = self.line()?.filter(|r| r.line.trim_ascii() != DELIMITER);
            let cut = || {
                fail::at(number.at, format!("the dataset ends within its {RECORDS} header records"), fail::COPY_AGAIN)
            };
            records.push(record.ok_or_else(cut)?);
        }
        let header = Header::read(&records)?;
        let from = self.at;
        if !binary {
            let to = self.skip_to_delimiter(number.at)?;
            return Ok(Dataset { header, data: Data::Text, from, to });
        }
        let (data, bytes) = self.binary_form(number)?;
        let to = from + bytes;
        self.reader.seek(SeekFrom::Start(to)).map_err(|e| cannot(to, &e))?;
        self.at = to;
        while let Some(line) = self.line()? {
            if line.line.trim_ascii() == DELIMITER {
                return Ok(Dataset { header, data, from, to });
            }
            if !line.line.is_empty() {
                break;
            }
        }
        let problem = format!("behind {bytes} bytes of data a line «    -1» was wanted, something else is there");
        Err(fail::at(to, problem, "the writer stated a wrong size or line ends were converted: write the file again"))
    }

    /// Byte order and number of bytes from the line with the dataset's number.
    fn binary_form(&self, number: &Record) -> Result<(Data, u64), FormatError> {
        let field = |from, to| text(&number.line, from, to);
        let wrong = |problem: String| fail::at(number.at, problem, fail::COPY_AGAIN);
        if field(13, 19) != "2" {
            let problem = format!("floating point format «{}» was found, 2 (IEEE 754) was wanted", field(13, 19));
            return Err(fail::at(number.at, problem, "convert the file on the machine it was written on"));
        }
        let data = match field(7, 13).as_str() {
            "1" => Data::LittleEndian,
            "2" => Data::BigEndian,
            other => return Err(wrong(format!("byte order «{other}» was found, 1 or 2 was wanted"))),
        };
        if field(19, 31) != RECORDS.to_string() {
            return Err(wrong(format!("«{}» header lines were found, {RECORDS} were wanted", field(19, 31))));
        }
        let bytes: u64 =
            field(31, 43).parse().map_err(|_| wrong("the number of data bytes is no number".to_owned()))?;
        let left = self.file_bytes.saturating_sub(self.at);
        if bytes > left {
            return Err(wrong(format!("{bytes} bytes of data are stated, the file has {left} left")));
        }
        Ok((data, bytes))
    }
}

fn cannot(at: u64, error: &std::io::Error) -> FormatError {
    fail::at(at, format!("the file cannot be read: {error}"), fail::COPY_AGAIN)
}

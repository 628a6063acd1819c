//! Finds the datasets: each lies between two lines `    -1` and begins with its number.

use super::fixed::{stated, text};
use super::header::{Header, RECORDS, Record};
use super::layout::Layout;
use crate::FormatError;
use crate::fail;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};

/// What stands, behind blanks, on the line before and behind a dataset.
pub(super) const DELIMITER: &[u8] = b"-1";
/// Of longer lines only this much is kept: records have 80 columns.
const KEPT: usize = 256;
/// Behind binary data the line that ends the dataset lies within so many bytes.
const BEHIND_BYTES: u64 = 256;

/// A dataset 58.
#[derive(Debug)]
pub(super) struct Dataset {
    pub(super) header: Header,
    pub(super) data: Data,
    /// Bytes of the data.
    pub(super) from: u64,
    pub(super) to: u64,
    /// How binary data lie; none for text, and for data that are not as many as the points.
    pub(super) layout: Option<Layout>,
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
            scanned.datasets.push(scanner.dataset(&number, &mut scanned.remarks)?);
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
    fn dataset(&mut self, number: &Record, remarks: &mut Vec<String>) -> Result<Dataset, FormatError> {
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
            return Ok(Dataset { header, data: Data::Text, from, to, layout: None });
        }
        let (data, stated) = binary_form(number)?;
        let to = self.binary_end(&header, number.at, stated, remarks)?;
        let layout = Layout::fitting(&header, to - from);
        Ok(Dataset { header, data, from, to, layout })
    }

    /// The end of binary data that begin here: behind as many bytes as are stated, or as type, spacing and points imply.
    /// Goes on behind the line that ends the dataset.
    fn binary_end(
        &mut self,
        header: &Header,
        number_at: u64,
        stated: u64,
        remarks: &mut Vec<String>,
    ) -> Result<u64, FormatError> {
        let from = self.at;
        let end = |bytes: u64| from.checked_add(bytes).filter(|end| *end <= self.file_bytes);
        let as_stated = end(stated);
        let implied: Vec<u64> = Layout::of(header).iter().filter_map(|l| l.bytes(header.points)).collect();
        // a writer that counts one number a point states a part of them
        let several = |bytes: u64| stated > 0 && bytes > stated && bytes.is_multiple_of(stated);
        let ends: Vec<(u64, u64)> =
            implied.iter().filter(|bytes| several(**bytes)).filter_map(|bytes| Some((*bytes, end(*bytes)?))).collect();
        if let Some(to) = as_stated
            && let Some((behind, _)) = self.delimiter_behind(to)?
        {
            self.go_on_at(behind)?;
            return Ok(to);
        }
        for (bytes, to) in ends {
            if let Some((behind, true)) = self.delimiter_behind(to)? {
                let response = &header.response;
                remarks.push(format!(
                    "{response}: its dataset 58b states {stated} bytes of data and has {bytes}, which its type and \
                     {} points imply: these are read",
                    header.points
                ));
                self.go_on_at(behind)?;
                return Ok(to);
            }
        }
        let left = self.file_bytes.saturating_sub(from);
        let Some(to) = as_stated else {
            let problem = format!("{stated} bytes of data are stated, the file has {left} left");
            return Err(fail::at(number_at, problem, fail::COPY_AGAIN));
        };
        let implied = implied.iter().map(u64::to_string).collect::<Vec<_>>().join(" or ");
        let problem = format!(
            "behind {stated} bytes of data (stated; {implied} by type and points) a line «    -1» was wanted, something \
             else is there"
        );
        Err(fail::at(to, problem, "the writer stated a wrong size or line ends were converted: write the file again"))
    }

    /// Whether a dataset that ends at a byte is followed by the line `    -1`: the byte behind that line, and whether the
    /// file ends or another dataset begins there.
    fn delimiter_behind(&mut self, to: u64) -> Result<Option<(u64, bool)>, FormatError> {
        self.go_on_at(to)?;
        let mut window = Vec::new();
        self.reader.by_ref().take(BEHIND_BYTES).read_to_end(&mut window).map_err(|e| cannot(to, &e))?;
        let blank = window.iter().take_while(|b| matches!(b, b'\r' | b'\n')).count();
        let behind = window.get(blank..).unwrap_or_default();
        let line = behind.split(|&b| b == b'\n').next().unwrap_or_default();
        if line.trim_ascii() != DELIMITER {
            return Ok(None);
        }
        let used = (blank + line.len() + 1).min(window.len());
        let next = window.get(used..).unwrap_or_default().trim_ascii_start();
        Ok(Some((to + used as u64, next.is_empty() || next.starts_with(DELIMITER))))
    }

    fn go_on_at(&mut self, byte: u64) -> Result<(), FormatError> {
        self.reader.seek(SeekFrom::Start(byte)).map_err(|e| cannot(byte, &e))?;
        self.at = byte;
        Ok(())
    }
}

/// Byte order and stated number of bytes from the line with the dataset's number.
fn binary_form(number: &Record) -> Result<(Data, u64), FormatError> {
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
    let bytes = field(31, 43).parse().map_err(|_| wrong("the number of data bytes is no number".to_owned()))?;
    Ok((data, bytes))
}

fn cannot(at: u64, error: &std::io::Error) -> FormatError {
    fail::at(at, format!("the file cannot be read: {error}"), fail::COPY_AGAIN)
}

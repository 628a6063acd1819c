//! The numbers of a column's chunk.
//!
//! A chunk is a row of pages, each with its description: a dictionary, if there is one, and data of version 1 or 2. A
//! page of data says which values are missing and has the others as they are, as numbers of dictionary entries, in
//! split streams of bytes, or as differences.

use super::codes::{differences, joined_streams, runs};
use super::compact::Value;
use super::footer::Chunk;
use crate::columnar::{Codec, Values, truths};
use crate::number::Number;
use flate2::Crc;

/// What a column is, to read its pages.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading {
    pub(super) number: Number,
    /// In how many ways a value may be missing.
    pub(super) optional: u32,
    pub(super) codec: Codec,
    /// Bytes that the pages may come to.
    pub(super) most_bytes: u64,
}

/// Kinds of pages.
const DATA: i64 = 0;
const DICTIONARY: i64 = 2;
const DATA_2: i64 = 3;

/// Where a page of data says what.
#[derive(Debug)]
struct DataPage<'a> {
    /// Values, missing ones included.
    count: usize,
    encoding: i64,
    /// Which values are there, if any may be missing.
    levels: &'a [u8],
    values: &'a [u8],
}

impl Reading {
    /// All values of a chunk of which these are the bytes. Error: what is wrong.
    pub(super) fn values(self, mut bytes: &[u8], chunk: &Chunk) -> Result<Values, String> {
        let rows = usize::try_from(chunk.rows).map_err(|_| "too many rows".to_owned())?;
        let mut values = Values::default();
        let mut dictionary = Vec::new();
        let mut left = self.most_bytes;
        while values.there.len() < rows {
            let (header, length) = Value::read(bytes).ok_or("the description of a page is incomplete")?;
            let size = |number: i16| header.count(number).ok_or_else(|| "a page does not say its size".to_owned());
            let (unpacked, packed) = (size(2)?, size(3)?);
            let rest = bytes.get(length..).unwrap_or_default();
            let cut = usize::try_from(packed).ok().and_then(|packed| rest.split_at_checked(packed));
            let (page, rest) = cut.ok_or("a page is longer than its column")?;
            bytes = rest;
            intact(&header, page)?;
            left = left.checked_sub(unpacked).ok_or("its pages come to more than a file of this size may")?;
            match header.number(1) {
                Some(DICTIONARY) => dictionary = self.dictionary(&header, page, unpacked as usize)?,
                Some(DATA) => {
                    let page = self.unpacked(page, unpacked as usize)?;
                    self.put(&first_kind(&header, &page, self.optional)?, &dictionary, rows, &mut values)?;
                }
                Some(DATA_2) => {
                    let about = header.field(8).ok_or("a page has no description")?;
                    let page = self.second_kind(about, page, unpacked as usize)?;
                    let levels = level_bytes(about)?.1;
                    let cut = page.split_at_checked(levels).ok_or("a page is shorter than its levels")?;
                    let page = DataPage {
                        count: count(about)?,
                        encoding: about.number(4).unwrap_or(-1),
                        levels: cut.0,
                        values: cut.1,
                    };
                    self.put(&page, &dictionary, rows, &mut values)?;
                }
                // indexes, and what is not known yet
                _ => {}
            }
        }
        Ok(values)
    }

    fn unpacked(self, page: &[u8], length: usize) -> Result<Vec<u8>, String> {
        self.codec.unpack(page, length).ok_or_else(|| format!("a page cannot be unpacked to {length} bytes"))
    }

    /// A page of version 2 with its values unpacked; its levels are never packed.
    fn second_kind(self, about: &Value, page: &[u8], length: usize) -> Result<Vec<u8>, String> {
        let (repeated, levels) = level_bytes(about)?;
        let cut = page.split_at_checked(repeated + levels).ok_or("a page is shorter than its levels")?;
        let mut whole = cut.0.get(repeated..).unwrap_or_default().to_vec();
        let length = length.checked_sub(repeated + levels).ok_or("a page is shorter than its levels")?;
        if length == 0 || about.truth(7) == Some(false) {
            whole.extend_from_slice(cut.1);
        } else {
            whole.extend(self.unpacked(cut.1, length)?);
        }
        Ok(whole)
    }

    fn dictionary(self, header: &Value, page: &[u8], length: usize) -> Result<Vec<u8>, String> {
        let about = header.field(7).ok_or("a dictionary has no description")?;
        if !matches!(about.number(2), Some(0 | 2)) {
            return Err("a dictionary is coded in an unknown way".to_owned());
        }
        let entries = self.unpacked(page, length)?;
        let bytes = count(about)?.checked_mul(self.number.bytes() as usize);
        let entries = bytes.and_then(|bytes| entries.get(..bytes)).ok_or("a dictionary is shorter than it says")?;
        Ok(entries.to_vec())
    }

    /// Adds the values of a page.
    fn put(self, page: &DataPage, dictionary: &[u8], rows: usize, into: &mut Values) -> Result<(), String> {
        if page.count > rows - into.there.len() {
            return Err(format!("its pages have more values than the {rows} rows"));
        }
        let before = into.there.len();
        if self.optional == 0 {
            into.there.resize(before + page.count, true);
        } else {
            let width = u32::BITS - self.optional.leading_zeros();
            let levels = runs(page.levels, width, page.count).ok_or("a page does not say which values are missing")?;
            into.there.extend(levels.into_iter().map(|level| level == self.optional));
        }
        let present = into.there.iter().skip(before).filter(|there| **there).count();
        let values = self.coded(page, dictionary, present);
        into.bytes
            .extend(values.ok_or_else(|| format!("a page of {present} values (coding {}) is damaged", page.encoding))?);
        Ok(())
    }

    /// `count` values of a page. None: damaged, or coded in an unknown way.
    fn coded(self, page: &DataPage, dictionary: &[u8], count: usize) -> Option<Vec<u8>> {
        let width = self.number.bytes() as usize;
        let bytes = page.values;
        // the only numbers of one byte are truths
        let is_truth = width == 1;
        match page.encoding {
            0 if is_truth => truths(bytes, 0, count),
            0 => bytes.get(..width.checked_mul(count)?).map(<[u8]>::to_vec),
            2 | 8 => entries(bytes, dictionary, width, count),
            3 if is_truth => {
                let numbers = runs(bytes.get(4..)?, 1, count)?;
                Some(numbers.into_iter().map(|number| number as u8).collect())
            }
            5 if matches!(self.number, Number::I32 | Number::U32 | Number::I64 | Number::U64) => {
                differences(bytes, width, count)
            }
            9 if !is_truth => joined_streams(bytes, width, count),
            _ => None,
        }
    }
}

/// Errors: the page is not the one of which the checksum was taken. Most programs take none.
fn intact(header: &Value, page: &[u8]) -> Result<(), String> {
    let Some(stated) = header.number(4) else { return Ok(()) };
    let mut found = Crc::new();
    found.update(page);
    // the low 32 bits, whatever their sign
    let stated = stated as u32;
    if found.sum() == stated {
        return Ok(());
    }
    Err(format!("the checksum of a page is {:#010x}, wanted {stated:#010x}", found.sum()))
}

/// Numbers of dictionary entries: the width of the numbers, then the numbers.
fn entries(bytes: &[u8], dictionary: &[u8], width: usize, count: usize) -> Option<Vec<u8>> {
    if count == 0 {
        return Some(Vec::new());
    }
    let (&bits, rest) = bytes.split_first()?;
    let mut values = Vec::new();
    for entry in runs(rest, u32::from(bits), count)? {
        let at = (entry as usize).checked_mul(width)?;
        values.extend_from_slice(dictionary.get(at..at.checked_add(width)?)?);
    }
    Some(values)
}

/// A page of version 1: the length of its levels and they themselves stand before the values.
fn first_kind<'a>(header: &Value, page: &'a [u8], optional: u32) -> Result<DataPage<'a>, String> {
    let about = header.field(5).ok_or("a page has no description")?;
    let (count, encoding) = (count(about)?, about.number(2).unwrap_or(-1));
    if optional == 0 {
        return Ok(DataPage { count, encoding, levels: &[], values: page });
    }
    if about.number(3) != Some(3) {
        return Err("a page says in an unknown way which values are missing".to_owned());
    }
    let cut = page.split_first_chunk::<4>();
    let cut = cut.and_then(|(length, rest)| rest.split_at_checked(u32::from_le_bytes(*length) as usize));
    let (levels, values) = cut.ok_or("a page is shorter than its levels")?;
    Ok(DataPage { count, encoding, levels, values })
}

fn count(about: &Value) -> Result<usize, String> {
    let count = about.count(1).and_then(|count| usize::try_from(count).ok());
    count.ok_or_else(|| "a page does not say how many values it has".to_owned())
}

/// Bytes of the levels of a page of version 2: those of repetitions, and those of missing values.
fn level_bytes(about: &Value) -> Result<(usize, usize), String> {
    let bytes = |number| about.count(number).and_then(|bytes| u32::try_from(bytes).ok()).map(|bytes| bytes as usize);
    bytes(6).zip(bytes(5)).ok_or_else(|| "a page does not say how long its levels are".to_owned())
}

//! The zip archive around a JPK file's headers and samples.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use common::{FormatError, Raw, Source};
use flate2::Crc;
use flate2::read::DeflateDecoder;
use zip::{CompressionMethod, ZipArchive};

use super::properties::{Table, parse};
use crate::damage;
use crate::file::Opened;
use crate::samples::{Code, Order};
use crate::stretch::check_range;

/// Headers of real files have some kB; more is no header but an attempt at this machine's memory.
const MOST_HEADER_BYTES: u64 = 1 << 20;

/// Deflate packs 258 bytes into 2 bits at best, so a larger size is a lie.
const MOST_INFLATION: u64 = 1032;

/// An open archive.
pub(super) struct Archive {
    zip: ZipArchive<BufReader<File>>,
    names: Vec<String>,
    path: Arc<Path>,
    file_bytes: u64,
}

/// Where an entry's bytes lie, whether packed, and what they must come out as.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    at: u64,
    packed: u64,
    /// Bytes when unpacked.
    pub(super) bytes: u64,
    crc: u32,
    deflated: bool,
}

impl Archive {
    /// Reads the directory. Errors: no archive.
    pub(super) fn open(path: &Path) -> Result<Self, FormatError> {
        let file = Opened::new(path)?;
        let file_bytes = file.bytes();
        let zip =
            ZipArchive::new(BufReader::new(file.into_file())).map_err(|e| damaged("the archive's directory", &e))?;
        let names = (0..zip.len())
            .map(|i| zip.name_for_index(i).and_then(Result::ok).unwrap_or_default().into_owned())
            .collect();
        Ok(Self { zip, names, path: Arc::from(path), file_bytes })
    }

    /// Names of the entries, in the archive's order.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// A property file; none if there is no such entry. Errors: it cannot be unpacked.
    pub(super) fn table(&mut self, name: &str) -> Result<Option<Table>, FormatError> {
        let Some(index) = self.zip.index_for_name(name) else { return Ok(None) };
        let entry = self.zip.by_index(index).map_err(|e| damaged(name, &e))?;
        let mut bytes = Vec::new();
        entry.take(MOST_HEADER_BYTES + 1).read_to_end(&mut bytes).map_err(|e| damaged(name, &e))?;
        if bytes.len() as u64 > MOST_HEADER_BYTES {
            return Err(damaged(name, &format!("a header of more than {MOST_HEADER_BYTES} bytes")));
        }
        Ok(Some(parse(&bytes)))
    }

    /// Where an entry lies; none if there is no such entry. Errors: outside the file, encrypted, packed otherwise.
    pub(super) fn locate(&mut self, name: &str) -> Result<Option<Entry>, FormatError> {
        let Some(index) = self.zip.index_for_name(name) else { return Ok(None) };
        let found = self.zip.by_index_raw(index).map_err(|e| damaged(name, &e))?;
        let deflated = match found.compression() {
            CompressionMethod::Stored => false,
            CompressionMethod::Deflated => true,
            other => return Err(damaged(name, &format!("packing {other:?} instead of deflate or none"))),
        };
        if found.encrypted() {
            return Err(damaged(name, &"an encrypted entry"));
        }
        let (packed, bytes, crc) = (found.compressed_size(), found.size(), found.crc32());
        let Some(at) = found.data_start() else { return Err(damaged(name, &"no local header")) };
        if at.checked_add(packed).is_none_or(|end| end > self.file_bytes) {
            return Err(damage::truncated(name, at, packed, self.file_bytes));
        }
        let most = if deflated { packed.saturating_mul(MOST_INFLATION) } else { packed };
        if bytes > most || (!deflated && bytes != packed) {
            return Err(damage::at(
                at,
                format!("{name}: found {packed} stored bytes, which cannot hold the {bytes} announced"),
                COPY_AGAIN,
            ));
        }
        Ok(Some(Entry { at, packed, bytes, crc, deflated }))
    }

    /// The samples of an entry.
    pub(super) fn source(&self, entry: Entry, code: Code) -> Arc<dyn Source> {
        Arc::new(Samples {
            path: Arc::clone(&self.path),
            file_bytes: self.file_bytes,
            entry,
            code,
            unpacked: Mutex::new(None),
        })
    }
}

const COPY_AGAIN: &str = "the archive is damaged: copy it again from where it was recorded";

fn damaged(what: &str, found: &dyn std::fmt::Display) -> FormatError {
    damage::whole(format!("{what}: found {found}, wanted a readable zip entry"), COPY_AGAIN)
}

/// Samples in an entry; a packed one is unpacked at the first read and kept.
#[derive(Debug)]
struct Samples {
    path: Arc<Path>,
    file_bytes: u64,
    entry: Entry,
    code: Code,
    unpacked: Mutex<Option<Arc<Vec<u8>>>>,
}

impl Samples {
    fn samples(&self) -> usize {
        (self.entry.bytes / self.code.bytes()) as usize
    }

    /// The whole entry. Errors: it does not unpack to what the directory announces.
    fn unpacked(&self) -> Result<Arc<Vec<u8>>, FormatError> {
        // the kept bytes are set in one step, so a reader that panicked leaves them sound
        let mut kept = self.unpacked.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(bytes) = kept.as_ref() {
            return Ok(Arc::clone(bytes));
        }
        let Entry { at, packed, bytes: wanted, crc, .. } = self.entry;
        let stored = Opened::again(&self.path, self.file_bytes)?.read("packed samples", at, packed)?;
        let mut bytes = Vec::new();
        let wrong = |found: String| {
            damage::at(
                at,
                format!("packed samples: found {found}, wanted {wanted} bytes of checksum {crc:#010x}"),
                COPY_AGAIN,
            )
        };
        DeflateDecoder::new(stored.as_slice())
            .take(wanted.saturating_add(1))
            .read_to_end(&mut bytes)
            .map_err(|e| wrong(e.to_string()))?;
        let mut sum = Crc::new();
        sum.update(&bytes);
        if bytes.len() as u64 != wanted || sum.sum() != crc {
            return Err(wrong(format!("{} bytes of checksum {:#010x}", bytes.len(), sum.sum())));
        }
        let bytes = Arc::new(bytes);
        *kept = Some(Arc::clone(&bytes));
        Ok(bytes)
    }
}

impl Source for Samples {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        check_range(start, count, self.samples())?;
        let (from, bytes) = (start as u64 * self.code.bytes(), count as u64 * self.code.bytes());
        if !self.entry.deflated {
            let file = Opened::again(&self.path, self.file_bytes)?;
            return Ok(self.code.decode(&file.read("samples", self.entry.at + from, bytes)?, Order::Big));
        }
        let whole = self.unpacked()?;
        let stretch = whole.get(from as usize..(from + bytes) as usize).unwrap_or_default();
        Ok(self.code.decode(stretch, Order::Big))
    }

    fn preferred_samples(&self) -> usize {
        // packed samples are unpacked whole anyhow
        if self.entry.deflated { self.samples().max(1) } else { 1 << 16 }
    }
}

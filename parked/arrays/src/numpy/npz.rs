//! Archives of arrays.

use super::array::Named;
use super::header::{self, Header, LEAD_BYTES};
use super::npy::header_at;
use crate::fail;
use crate::grid::Store;
use crate::listing::Listing;
use crate::packed::{Packed, Wrapper};
use crate::pinned::Pinned;
use common::{Contents, Format, FormatError};
use std::fs::File;
use std::path::Path;
use std::sync::Arc;
use zip::{CompressionMethod, ZipArchive};

const ZIP_MAGIC: &[u8] = b"PK\x03\x04";

/// NPZ archives, as `numpy.savez` and `numpy.savez_compressed` write them.
pub struct Npz;

/// A member of the archive.
struct Member {
    name: String,
    method: CompressionMethod,
    encrypted: bool,
    at: u64,
    packed_bytes: u64,
    bytes: u64,
    crc32: u32,
}

impl Format for Npz {
    /// A zip archive whose first member or own name says so: many other formats are zip archives as well.
    fn recognises(head: &[u8], path: &Path) -> bool {
        let named = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npz"));
        let length =
            head.get(26..28).map_or(0, |bytes| bytes.iter().rev().fold(0, |sum, &byte| sum * 256 + usize::from(byte)));
        let member = head.get(30..).and_then(|rest| rest.get(..length)).is_some_and(|name| name.ends_with(b".npy"));
        head.starts_with(ZIP_MAGIC) && (named || member)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let (pinned, file) = Pinned::open(path)?;
        let mut listing = Listing::default();
        for member in members(&pinned, &file)? {
            let Some(name) = member.name.strip_suffix(".npy") else {
                listing.remark(format!("{} is no array and left out", member.name.escape_debug()));
                continue;
            };
            if let Err(mut error) = list(&mut listing, &pinned, &file, &member, name) {
                error.problem = format!("{}: {}", member.name.escape_debug(), error.problem);
                return Err(error);
            }
        }
        if listing.channels() == 0 {
            listing.remark("the archive has no array of two and more numbers");
        }
        Ok(listing.finish("NumPy NPZ".to_owned()))
    }
}

fn members(pinned: &Pinned, file: &File) -> Result<Vec<Member>, FormatError> {
    let refused = |e| {
        let problem = format!("the archive cannot be read: {e}");
        fail::plain(problem, "the file is damaged, cut off or no NPZ archive: save the arrays again with numpy.savez")
    };
    let mut archive = ZipArchive::new(file).map_err(refused)?;
    let mut members = Vec::new();
    for number in 0..archive.len() {
        let member = archive.by_index_raw(number).map_err(refused)?;
        let at = member.data_start().unwrap_or(u64::MAX);
        let packed_bytes = member.compressed_size();
        if at.checked_add(packed_bytes).is_none_or(|end| end > pinned.bytes()) {
            let problem = format!("a member of {packed_bytes} bytes at byte {at}, the archive ends before its end");
            return Err(fail::at(member.central_header_start(), problem, fail::COPY_AGAIN));
        }
        members.push(Member {
            name: member.name().map_err(refused)?.to_string(),
            method: member.compression(),
            encrypted: member.encrypted(),
            at,
            packed_bytes,
            bytes: member.size(),
            crc32: member.crc32(),
        });
    }
    Ok(members)
}

fn list(listing: &mut Listing, pinned: &Pinned, file: &File, member: &Member, name: &str) -> Result<(), FormatError> {
    let wrapper = Wrapper::Bare { crc32: member.crc32 };
    let (header, store, at) = match member.method {
        _ if member.encrypted => {
            listing.remark(format!("/{name} is encrypted and left out"));
            return Ok(());
        }
        CompressionMethod::Stored => {
            let header = header_at(file, member.at, member.packed_bytes)?;
            (header, Store::File(pinned.clone()), member.at)
        }
        method if method == CompressionMethod::DEFLATE => {
            let packed = Packed::new(pinned, member.at, member.packed_bytes, member.bytes, wrapper)?;
            packed.verify_if_short()?;
            (packed_header(&packed, member)?, Store::Packed(Arc::new(packed)), 0)
        }
        method => {
            listing.remark(format!("/{name} is compressed by {method:?}, only stored and deflated members are read"));
            return Ok(());
        }
    };
    let (wanted, found) = (header.bytes.saturating_add(header.data_bytes), member.bytes);
    // NumPy writes nothing else into a member; what is deflated must not be inflated beyond the array.
    if wanted != found {
        let problem = format!("an array of shape {:?} takes {wanted} bytes, the member has {found}", header.shape);
        return Err(fail::at(member.at, problem, fail::COPY_AGAIN));
    }
    Named { name: &name.escape_debug().to_string(), header: &header, store, at }.list(listing)
}

fn packed_header(packed: &Packed, member: &Member) -> Result<Header, FormatError> {
    let mut inflating = packed.inflating()?;
    let mut head = vec![0; member.bytes.min(LEAD_BYTES as u64) as usize];
    inflating.fill(&mut head)?;
    let in_archive = |mut error: FormatError| {
        error.at_byte = Some(member.at);
        error
    };
    let (version, from, length) = header::lead(&head, member.bytes).map_err(in_archive)?;
    let mut dictionary = vec![0; length as usize];
    // The first bytes of a version 1 dictionary were read with the lead.
    let early = head.get(from as usize..).unwrap_or_default();
    let early = early.get(..dictionary.len().min(early.len())).unwrap_or_default();
    let (before, after) = dictionary.split_at_mut(early.len());
    before.copy_from_slice(early);
    inflating.fill(after)?;
    Header::of(version, from, &dictionary).map_err(in_archive)
}

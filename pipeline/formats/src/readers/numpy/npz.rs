//! Archives of arrays.

use super::array::Named;
use super::dtype::PICKLED;
use super::header::{self, Header, LEAD_BYTES};
use super::npy::header_at;
use crate::archive::{Archive, MAGIC, Member, Refused};
use crate::axes::settle;
use crate::fail;
use crate::grid::Store;
use crate::listing::Listing;
use crate::packed::Packed;
use crate::{Contents, Format, FormatError, Row};
use std::path::Path;
use std::sync::Arc;

/// NPZ archives, as `numpy.savez` and `numpy.savez_compressed` write them.
pub struct Npz;

impl Format for Npz {
    const ROW: Row = Row {
        name: "npz",
        title: "NumPy archive",
        reads: "as NPY, deflated or not; objects leave the other arrays as they are; complex arrays for `io.frf`",
        leaves_out: "objects",
        described_by: "NumPy, \"NEP 1\" and `numpy.lib.format`",
        clock: "arrays of times, moments and time differences; numbers named `fs`, `dt`, `t0`, ...",
        unit: "texts named `units`",
    };

    /// A zip archive whose first member or own name says so: many other formats are zip archives as well.
    fn recognises(head: &[u8], path: &Path) -> bool {
        let named = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npz"));
        let length =
            head.get(26..28).map_or(0, |bytes| bytes.iter().rev().fold(0, |sum, &byte| sum * 256 + usize::from(byte)));
        let member = head.get(30..).and_then(|rest| rest.get(..length)).is_some_and(|name| name.ends_with(b".npy"));
        head.starts_with(MAGIC) && (named || member)
    }

    fn open(path: &Path) -> Result<Contents, FormatError> {
        let mut archive = Archive::open(path)?;
        let mut listing = Listing::default();
        for number in 0..archive.len() {
            let whole = archive.name(number);
            let Some(name) = whole.strip_suffix(".npy") else {
                listing.remark(format!("{} is no array and left out", whole.escape_debug()));
                continue;
            };
            let listed = match archive.member(number) {
                Ok(member) => list(&mut listing, &archive, &member, name),
                Err(Refused::Kind(what)) => {
                    listing.remark(format!("/{} is {what}: left out", name.escape_debug()));
                    continue;
                }
                Err(Refused::Damaged(error)) => Err(error),
            };
            if let Err(mut error) = listed {
                error.problem = format!("{}: {}", whole.escape_debug(), error.problem);
                return Err(error);
            }
        }
        if listing.channels() == 0 {
            listing.remark("the archive has no array of two and more numbers");
        }
        let mut contents = listing.finish("NumPy NPZ".to_owned());
        settle(&mut contents);
        Ok(contents)
    }
}

fn list(listing: &mut Listing, archive: &Archive, member: &Member, name: &str) -> Result<(), FormatError> {
    let (header, store, at) = match archive.packed(member)? {
        None => {
            let header = header_at(archive.file(), member.at, member.packed_bytes)?;
            (header, Store::File(archive.pinned().clone()), member.at)
        }
        Some(packed) => {
            packed.verify_if_short()?;
            (packed_header(&packed, member)?, Store::Packed(Arc::new(packed)), 0)
        }
    };
    if header.is_pickled() {
        listing.remark(format!("/{} holds {PICKLED}, no channel", name.escape_debug()));
        return Ok(());
    }
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

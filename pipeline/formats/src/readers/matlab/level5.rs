//! Level 5: 128 bytes of header, then elements that are arrays, or compressed ones that hold one array each.

use super::class;
use super::element::{Elements, Tag};
use super::matrix::Walk;
use super::stream::Stream;
use crate::facts::HEADER_SAYS;
use crate::fail;
use crate::grid::Store;
use crate::listing::Listing;
use crate::packed::{Packed, Wrapper};
use crate::pinned::Pinned;
use crate::{Contents, FormatError};
use std::sync::Arc;

const HEADER_BYTES: u64 = 128;
/// Version of MATLAB 5 to 7.
const LEVEL_5: u16 = 0x0100;
/// Version of files that are HDF5 behind their first 512 bytes.
const LEVEL_7_3: u16 = 0x0200;
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Byte order and version, from the mark in bytes 126 and 127 and the number before it.
fn version(head: &[u8]) -> Option<(bool, u16)> {
    match *head.get(124..128)? {
        [low, high, b'I', b'M'] => Some((false, u16::from_le_bytes([low, high]))),
        [high, low, b'M', b'I'] => Some((true, u16::from_be_bytes([high, low]))),
        _ => None,
    }
}

/// The mark, one of the two versions, and a text in the first four bytes, where level 4 has a zero.
pub(super) fn recognises(head: &[u8]) -> bool {
    let text = head.get(..4).is_some_and(|bytes| bytes.iter().all(|&byte| byte != 0));
    text && version(head).is_some_and(|(_, version)| version == LEVEL_5 || version == LEVEL_7_3)
}

pub(super) fn open(pinned: &Pinned, head: &[u8]) -> Result<Contents, FormatError> {
    let (big_endian, version) = version(head).unwrap_or_default();
    if version == LEVEL_7_3 || head.get(512..).is_some_and(|rest| rest.starts_with(HDF5)) {
        let problem = "this is a MAT-file of version 7.3, which is HDF5, not one of version 4 to 7";
        return Err(fail::at(124, problem, "open it with the reader of HDF5 files, or save it in MATLAB with -v7"));
    }
    let mut listing = Listing::default();
    let text: Vec<u8> = head.iter().copied().take(116).take_while(|&byte| byte != 0).collect();
    listing.remark(format!("{HEADER_SAYS}: {}", crate::text::latin(&text).trim_end().escape_debug()));
    let stream = Stream::plain(pinned.reopen()?, HEADER_BYTES, pinned.bytes());
    let mut elements = Elements { stream, big_endian };
    while elements.stream.position() < pinned.bytes() {
        let tag = elements.tag_of(&[class::MATRIX, class::COMPRESSED], pinned.bytes(), "a variable")?;
        if tag.kind == class::COMPRESSED {
            compressed(&mut listing, pinned, tag, big_endian)?;
        } else {
            let store = Store::File(pinned.clone());
            let mut walk = Walk { elements, store, listing: &mut listing };
            walk.variable(tag)?;
            elements = walk.elements;
        }
        elements.go_on(tag.next_at, pinned.bytes())?;
    }
    let order = if big_endian { "big" } else { "little" };
    Ok(listing.finish(format!("MATLAB 5 MAT-file, {order}-endian")))
}

/// Walks through a compressed variable without keeping more of it than headers.
fn compressed(listing: &mut Listing, pinned: &Pinned, tag: Tag, big_endian: bool) -> Result<(), FormatError> {
    // Eight bytes say how many there are; the limit on them is that they cannot be inflated from fewer.
    let first = Packed::new(pinned, tag.data_at, tag.bytes, 0, Wrapper::Zlib)?;
    let mut elements = Elements { stream: Stream::inflating(first.inflating()?, tag.at), big_endian };
    let inner = elements.tag_of(&[class::MATRIX], u64::MAX, "a compressed variable")?;
    let end = inner.data_at + inner.bytes;
    let packed = Arc::new(Packed::new(pinned, tag.data_at, tag.bytes, end, Wrapper::Zlib)?);
    packed.verify_if_short()?;
    let inner = Tag { next_at: end, ..inner };
    Walk { elements, store: Store::Packed(packed), listing }.variable(inner)
}

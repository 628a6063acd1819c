//! Arrays: flags, sizes, a name, and then what their class has.

use super::class::{self, Class};
use super::element::{Elements, Tag};
use super::text;
use crate::FormatError;
use crate::fail;
use crate::grid::Store;
use crate::listing::{Array, Listing};
use crate::number::Number;

/// MATLAB's limit is 63; anything beyond this is damage.
const MOST_NAME_BYTES: u64 = 256;
/// 32 axes; MATLAB has no limit, but nobody uses more.
const MOST_AXES_BYTES: u64 = 4 * 32;
/// Structs in cells in structs: deeper ones are left out, so that no file can exhaust the stack.
pub(super) const DEEPEST: usize = 32;

const COMPLEX: u32 = 0x0800;
const GLOBAL: u32 = 0x0400;
const LOGICAL: u32 = 0x0200;

/// Where an array is, in words.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// `/s.field`
    pub(super) location: String,
    /// What it is part of: `/s`, empty for the file.
    pub(super) scope: String,
    /// Its own name: `field`, empty in a cell.
    pub(super) name: String,
    /// How many structs and cells it is in.
    pub(super) depth: usize,
}

/// A walk through the arrays of a file or of a compressed variable.
pub(super) struct Walk<'a> {
    pub(super) elements: Elements,
    pub(super) store: Store,
    pub(super) listing: &'a mut Listing,
}

/// What every array begins with.
#[derive(Debug)]
pub(super) struct Head {
    pub(super) flags: u32,
    pub(super) shape: Vec<usize>,
    pub(super) count: u64,
    pub(super) end: u64,
}

impl Walk<'_> {
    /// A variable of the file.
    pub(super) fn variable(&mut self, tag: Tag) -> Result<(), FormatError> {
        self.array(tag, None)
    }

    /// An array whose tag has been read; without a place it is a variable, which has a name.
    pub(super) fn array(&mut self, tag: Tag, place: Option<Place>) -> Result<(), FormatError> {
        let end = tag.data_at + tag.bytes;
        if tag.bytes == 0 {
            let location = place.map_or_else(|| "a variable".to_owned(), |place| place.location);
            self.listing.remark(format!("{location} is an empty array, no channel"));
            return self.elements.go_on(tag.next_at, tag.next_at);
        }
        let flags_tag = self.elements.tag_of(&[class::UINT32], end, "the flags of an array")?;
        let flags = self.elements.data(flags_tag, 8, end, "the flags of an array")?;
        let flags = flags.first_chunk().map_or(0, |&word| self.elements.u32(word));
        let code = flags as u8;
        let Some(class) = Class::of(code) else {
            let problem = format!("an array of class {code}, 1 to 17 were wanted");
            return Err(self.elements.stream.error(flags_tag.at, problem, fail::COPY_AGAIN));
        };
        // An opaque object has its name where others have sizes.
        let (shape, count) = if class == Class::Opaque { (Vec::new(), 0) } else { self.shape(end)? };
        let name = self.name(end)?;
        let place = place.unwrap_or_else(|| Place {
            location: format!("/{name}"),
            scope: String::new(),
            name: name.clone(),
            depth: 0,
        });
        let head = Head { flags, shape, count, end };
        match class {
            _ if place.location == "/" => {
                self.listing
                    .remark("an array without a name, MATLAB's workspace of functions and objects, is left out");
            }
            Class::Number(class) => self.numbers(&head, &place, class)?,
            Class::Char => self.text(&head, &place)?,
            Class::Cell => self.cell(&head, &place)?,
            Class::Struct => self.structs(&head, &place)?,
            Class::Object => self.object(&head, &place)?,
            Class::Sparse => self.left_out(&place, "a sparse matrix"),
            Class::Function => self.left_out(&place, "a function"),
            Class::Opaque => self.left_out(&place, "an object of a form that only MATLAB knows"),
        }
        self.elements.go_on(tag.next_at, tag.next_at)
    }

    fn left_out(&mut self, place: &Place, what: &str) {
        self.listing.remark(format!("{} is {what}, no channel", place.location));
    }

    fn shape(&mut self, end: u64) -> Result<(Vec<usize>, u64), FormatError> {
        let tag = self.elements.tag_of(&[class::INT32, class::UINT32], end, "the sizes of an array")?;
        let bytes = self.elements.data(tag, MOST_AXES_BYTES, end, "the sizes of an array")?;
        let sizes: Vec<u32> = bytes.as_chunks().0.iter().map(|&word| self.elements.u32(word)).collect();
        let shape: Option<Vec<usize>> =
            sizes.iter().map(|&size| i32::try_from(size).ok().and_then(|size| usize::try_from(size).ok())).collect();
        let count = sizes.iter().try_fold(1_u64, |count, &size| count.checked_mul(size.into()));
        match (shape, count) {
            (Some(shape), Some(count)) if shape.len() >= 2 => Ok((shape, count)),
            _ => {
                let problem = format!("the sizes of an array are {sizes:?}, two or more from 0 to 2^31 were wanted");
                Err(self.elements.stream.error(tag.at, problem, fail::COPY_AGAIN))
            }
        }
    }

    fn name(&mut self, end: u64) -> Result<String, FormatError> {
        let tag = self.elements.tag_of(&[class::INT8, 2, class::UTF8], end, "the name of an array")?;
        let bytes = self.elements.data(tag, MOST_NAME_BYTES, end, "the name of an array")?;
        let name = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
        Ok(String::from_utf8_lossy(name).escape_debug().to_string())
    }

    fn numbers(&mut self, head: &Head, place: &Place, class: &str) -> Result<(), FormatError> {
        let (tag, number) = self.numbers_tag(head, place)?;
        let big_endian = self.elements.big_endian;
        let array = |first: u64, number: Number, long_name: String| Array {
            location: place.location.clone(),
            scope: place.scope.clone(),
            long_name,
            shape: head.shape.clone(),
            first_axis_fastest: true,
            base: 1,
            unit: String::new(),
            store: self.store.clone(),
            first,
            item_bytes: number.bytes(),
            number,
            big_endian,
        };
        if head.flags & COMPLEX != 0 {
            let location = &place.location;
            let real = array(tag.data_at, number, location.clone());
            self.elements.go_on(tag.next_at, head.end)?;
            let (imaginary, second) = self.numbers_tag(head, place)?;
            self.listing.remark(format!("{location} is complex, no channel: real and imaginary part would be two"));
            // parts of two types are left out: nobody writes them for what was measured
            if second == number {
                self.listing.complex(&real, imaginary.data_at);
            }
            return Ok(());
        }
        if head.count == 1 {
            let bytes = self.elements.stream.bytes(tag.bytes, head.end, "a number")?;
            let value = number.decode(&bytes, big_endian).widened().first().copied().unwrap_or_default();
            self.listing.scalar(&place.scope, &place.name, &place.location, value);
            return Ok(());
        }
        let logical = if head.flags & LOGICAL != 0 { "logical " } else { "" };
        let global = if head.flags & GLOBAL != 0 { "global " } else { "" };
        let sizes: Vec<String> = head.shape.iter().map(usize::to_string).collect();
        let long_name = format!("{} ({global}{logical}{class} {})", place.location, sizes.join("x"));
        self.listing.array(&array(tag.data_at, number, long_name));
        Ok(())
    }

    /// The tag of as many numbers as an array has, and their type.
    fn numbers_tag(&mut self, head: &Head, place: &Place) -> Result<(Tag, Number), FormatError> {
        let tag = self.elements.tag(head.end, "the numbers of an array")?;
        let Some(number) = class::number(tag.kind) else {
            let problem = format!("the numbers of {} have type {}, which is none of numbers", place.location, tag.kind);
            return Err(self.elements.stream.error(tag.at, problem, fail::COPY_AGAIN));
        };
        if head.count.checked_mul(number.bytes()) != Some(tag.bytes) {
            let (location, count, bytes) = (&place.location, head.count, tag.bytes);
            let problem = format!("{location} has {count} numbers of {} bytes, in {bytes} bytes", number.bytes());
            return Err(self.elements.stream.error(tag.at, problem, fail::COPY_AGAIN));
        }
        Ok((tag, number))
    }

    fn text(&mut self, head: &Head, place: &Place) -> Result<(), FormatError> {
        let characters = usize::try_from(head.count).unwrap_or(usize::MAX);
        if characters > text::SHORT || head.shape.first() != Some(&1) {
            self.listing.remark(text::remark_long(&place.location, characters));
            return Ok(());
        }
        let tag = self.elements.tag(head.end, "a text")?;
        // Four bytes a character is the most any encoding takes.
        let bytes = self.elements.data(tag, 4 * text::SHORT as u64, head.end, "a text")?;
        let big = self.elements.big_endian;
        let word = |pair: &[u8; 2]| if big { u16::from_be_bytes(*pair) } else { u16::from_le_bytes(*pair) };
        let shown = match tag.kind {
            4 | class::UTF16 => String::from_utf16_lossy(&bytes.as_chunks().0.iter().map(word).collect::<Vec<u16>>()),
            class::UTF32 => {
                let wide = bytes.as_chunks().0.iter().map(|&quad| char::from_u32(self.elements.u32(quad)));
                wide.map(|letter| letter.unwrap_or('\u{fffd}')).collect()
            }
            _ => String::from_utf8_lossy(&bytes).into_owned(),
        };
        self.listing.text(&place.location, &shown, text::remark_short(&place.location, &shown));
        Ok(())
    }
}

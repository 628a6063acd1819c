//! Arrays of arrays: cells, structs, and objects of the old form.

use super::class;
use super::matrix::{DEEPEST, Head, Place, Walk};
use crate::FormatError;
use crate::fail;

/// An array in an array has at least a tag.
const LEAST_BYTES: u64 = 8;

/// 4096 fields of 64 bytes each.
const MOST_NAMES_BYTES: u64 = 1 << 18;

impl Walk<'_> {
    /// A cell array: an array for each of its elements.
    pub(super) fn cell(&mut self, head: &Head, place: &Place) -> Result<(), FormatError> {
        if self.too_deep(place) {
            return Ok(());
        }
        self.room_for(head.count, head, place)?;
        for number in 1..=head.count {
            self.part(head, place, &format!("{{{number}}}"), String::new(), place.location.clone())?;
        }
        Ok(())
    }

    /// Structs: an array for each field of each.
    pub(super) fn structs(&mut self, head: &Head, place: &Place) -> Result<(), FormatError> {
        if self.too_deep(place) {
            return Ok(());
        }
        let what = "the length of field names";
        let tag = self.elements.tag_of(&[class::INT32], head.end, what)?;
        let length = self.elements.data(tag, 4, head.end, what)?;
        let length = length.first_chunk().map_or(0, |&word| self.elements.u32(word)) as usize;
        let tag = self.elements.tag_of(&[class::INT8], head.end, "the field names")?;
        let names = self.elements.data(tag, MOST_NAMES_BYTES, head.end, "the field names")?;
        if !names.is_empty() && (length == 0 || names.len() % length != 0) {
            let problem = format!("{} bytes of field names, {length} bytes each", names.len());
            return Err(self.elements.stream.error(tag.at, problem, fail::COPY_AGAIN));
        }
        let until_zero = |name: &[u8]| {
            let name = name.split(|&byte| byte == 0).next().unwrap_or_default();
            String::from_utf8_lossy(name).escape_debug().to_string()
        };
        let names: Vec<String> = names.chunks(length.max(1)).map(until_zero).collect();
        self.room_for(head.count.saturating_mul(names.len() as u64), head, place)?;
        // A struct without fields has no arrays, however many of it there are.
        let count = if names.is_empty() { 0 } else { head.count };
        for number in 1..=count {
            let index = if count == 1 { String::new() } else { format!("({number})") };
            for name in &names {
                let scope = format!("{}{index}", place.location);
                self.part(head, place, &format!("{index}.{name}"), name.clone(), scope)?;
            }
        }
        Ok(())
    }

    /// An object of the old form: a struct with the name of a class.
    pub(super) fn object(&mut self, head: &Head, place: &Place) -> Result<(), FormatError> {
        let tag = self.elements.tag_of(&[class::INT8], head.end, "the class of an object")?;
        let class = self.elements.data(tag, 1024, head.end, "the class of an object")?;
        let class = String::from_utf8_lossy(&class).trim_end_matches('\0').escape_debug().to_string();
        self.listing.remark(format!("{} is an object of class {class}, read like a struct", place.location));
        self.structs(head, place)
    }

    fn part(
        &mut self,
        head: &Head,
        whole: &Place,
        suffix: &str,
        name: String,
        scope: String,
    ) -> Result<(), FormatError> {
        let tag = self.elements.tag_of(&[class::MATRIX], head.end, "an array in an array")?;
        let location = format!("{}{suffix}", whole.location);
        self.array(tag, Some(Place { location, scope, name, depth: whole.depth + 1 }))
    }

    fn room_for(&self, parts: u64, head: &Head, place: &Place) -> Result<(), FormatError> {
        let at = self.elements.stream.position();
        if parts.saturating_mul(LEAST_BYTES) <= head.end.saturating_sub(at) {
            return Ok(());
        }
        let problem = format!("{} has {parts} arrays in it, its element has no room for them", place.location);
        Err(self.elements.stream.error(at, problem, fail::COPY_AGAIN))
    }

    fn too_deep(&mut self, place: &Place) -> bool {
        let too_deep = place.depth >= DEEPEST;
        if too_deep {
            self.listing.remark(format!("{} is nested more than {DEEPEST} deep and left out", place.location));
        }
        too_deep
    }
}

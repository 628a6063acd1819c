//! The channels of one array.

use super::dtype::{Field, Part};
use super::header::Header;
use crate::grid::{Grid, Store};
use crate::listing::{Array, Listing};
use crate::number::Number;
use crate::{FormatError, Source};

/// An array of a file or archive.
#[derive(Debug)]
pub(super) struct Named<'a> {
    /// Without the slash before it.
    pub(super) name: &'a str,
    pub(super) header: &'a Header,
    pub(super) store: Store,
    /// Byte in the store where the array's header begins.
    pub(super) at: u64,
}

impl Named<'_> {
    /// Lists every numeric part. The data must have been found to be there.
    pub(super) fn list(&self, listing: &mut Listing) -> Result<(), FormatError> {
        let header = self.header;
        let location = format!("/{}", self.name);
        let several = header.shape.iter().filter(|&&size| size > 1).count() > 1;
        if several && header.fields.iter().any(|field| !matches!(field.what, Part::Other(_))) {
            let axes = if header.fortran { "Fortran" } else { "C" };
            listing.remark(format!(
                "{location} has the shape {:?} in {axes} order; NumPy does not say which axis is time: the channels \
                 are its columns, or its rows if they are at most 16 and 16 times as long",
                header.shape
            ));
        }
        for field in &header.fields {
            match &field.what {
                Part::Number(number, big_endian) => self.part(listing, &location, field, *number, *big_endian)?,
                Part::Complex(part, big_endian) => self.complex(listing, &location, field, *part, *big_endian),
                Part::Other(what) => {
                    listing.unread_text(&format!("{location}{}", field.suffix));
                    listing.remark(format!("{location}{} holds {what}, no channel", field.suffix));
                }
            }
        }
        Ok(())
    }

    fn part(
        &self,
        listing: &mut Listing,
        whole: &str,
        field: &Field,
        number: Number,
        big_endian: bool,
    ) -> Result<(), FormatError> {
        let header = self.header;
        if header.shape.iter().all(|&size| size == 1) {
            let Array { location, store, first, item_bytes, .. } = self.array(whole, field, number, big_endian);
            let one = Grid { store, first, step: item_bytes, samples: 1, number, big_endian };
            let value = one.read(0, 1)?.widened().first().copied().unwrap_or_default();
            let (scope, name) =
                if field.suffix.is_empty() { ("", self.name) } else { (whole, field.suffix.trim_start_matches('.')) };
            listing.scalar(scope, name, &location, value);
            return Ok(());
        }
        listing.array(&self.array(whole, field, number, big_endian));
        Ok(())
    }

    /// Complex numbers are no channel: frequency responses, if there are frequencies.
    fn complex(&self, listing: &mut Listing, whole: &str, field: &Field, part: Number, big_endian: bool) {
        let array = self.array(whole, field, part, big_endian);
        listing.remark(format!("{} is complex, no channel: real and imaginary part would be two", array.location));
        listing.complex(&array, array.first.saturating_add(part.bytes()));
    }

    /// The array of numbers that begins each element's field.
    fn array(&self, whole: &str, field: &Field, number: Number, big_endian: bool) -> Array {
        let (header, location) = (self.header, format!("{whole}{}", field.suffix));
        Array {
            long_name: location.clone(),
            location,
            scope: if field.suffix.is_empty() { String::new() } else { whole.to_owned() },
            shape: header.shape.clone(),
            first_axis_fastest: header.fortran,
            base: 0,
            store: self.store.clone(),
            // an empty array may have a field at any offset
            first: (self.at + header.bytes).saturating_add(field.offset),
            item_bytes: header.item_bytes,
            number,
            big_endian,
        }
    }
}

//! The channels of one array.

use super::dtype::{Field, Part};
use super::header::Header;
use crate::facts::remark_on_text;
use crate::grid::{Grid, Store};
use crate::listing::{Array, Listing};
use crate::number::Number;
use crate::{FormatError, Source};

/// Longest text that is read: units and names have at most 64 characters of four bytes.
const MOST_TEXT_BYTES: u64 = 256;

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
        if several && header.fields.iter().any(|field| field.what.no_number().is_none()) {
            let axes = if header.fortran { "Fortran" } else { "C" };
            listing.remark(format!(
                "{location} has the shape {:?} in {axes} order; NumPy does not say which axis is time: the channels \
                 are its columns, or its rows if they are at most 16 and 16 times as long",
                header.shape
            ));
        }
        for field in &header.fields {
            match &field.what {
                Part::Number(number, big_endian) => {
                    self.part(listing, &location, field, (*number, *big_endian), "")?;
                }
                Part::Times { unit, big_endian } => {
                    self.part(listing, &location, field, (Number::I64, *big_endian), unit)?;
                }
                Part::Complex(part, big_endian) => self.complex(listing, &location, field, *part, *big_endian),
                Part::Text { .. } | Part::Other(_) => {
                    let (location, what) = (format!("{location}{}", field.suffix), field.what.no_number());
                    match self.text(field)? {
                        Some(text) => listing.text(&location, &text, remark_on_text(&location, &text)),
                        None => {
                            listing.unread_text(&location);
                            listing.remark(format!("{location} holds {}, no channel", what.unwrap_or_default()));
                        }
                    }
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
        (number, big_endian): (Number, bool),
        unit: &str,
    ) -> Result<(), FormatError> {
        let header = self.header;
        if header.shape.iter().all(|&size| size == 1) {
            let Array { location, store, first, item_bytes, .. } = self.array(whole, field, number, big_endian);
            let one = Grid { store, first, step: item_bytes, samples: 1, number, big_endian };
            let value = one.read(0, 1)?.widened().first().copied().unwrap_or_default();
            let (scope, name) =
                if field.suffix.is_empty() { ("", self.name) } else { (whole, field.suffix.trim_start_matches('.')) };
            listing.scalar_in(scope, name, &location, value, unit);
            return Ok(());
        }
        listing.array(&Array { unit: unit.to_owned(), ..self.array(whole, field, number, big_endian) });
        Ok(())
    }

    /// The text of a field, of one element and if it is no longer than units and names are.
    fn text(&self, field: &Field) -> Result<Option<String>, FormatError> {
        let header = self.header;
        let Part::Text { bytes, wide, big_endian } = field.what else { return Ok(None) };
        if bytes == 0 || bytes > MOST_TEXT_BYTES || header.shape.iter().any(|&size| size != 1) {
            return Ok(None);
        }
        let Array { first, .. } = self.array("", field, Number::U8, false);
        let (store, samples) = (self.store.clone(), bytes as usize);
        let bytes = Grid { store, first, step: 1, samples, number: Number::U8, big_endian: false };
        let codes: Vec<u8> = bytes.read(0, samples)?.widened().into_iter().map(|code| code as u8).collect();
        let wide_code = |code: &[u8; 4]| if big_endian { u32::from_be_bytes(*code) } else { u32::from_le_bytes(*code) };
        let text: String = match wide {
            true => {
                codes.as_chunks().0.iter().map(|code| char::from_u32(wide_code(code)).unwrap_or('\u{fffd}')).collect()
            }
            false => crate::text::decode(&codes),
        };
        Ok(Some(text.trim_end_matches('\0').to_owned()))
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
            unit: String::new(),
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

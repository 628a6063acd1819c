//! Where the values of a config lie in its text.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Where a value lies in the text, with the places of what it holds.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Place {
    /// Bytes of the value; of a table with a header of its own, the header.
    pub value: Range<usize>,
    /// What it holds: key (or index), bytes of the key (or of the element), place of the value.
    inside: Vec<(String, Range<usize>, Place)>,
}

impl Place {
    /// The places of a parsed value, moved `offset` bytes to the right.
    pub(crate) fn of(value: &Spanned<DeValue<'_>>, offset: usize) -> Self {
        let span = shifted(value.span(), offset);
        match value.get_ref() {
            DeValue::Table(table) => Self { value: span, inside: entries(table, offset) },
            DeValue::Array(array) => {
                let inside = array.iter().enumerate().map(|(index, element)| {
                    (index.to_string(), shifted(element.span(), offset), Self::of(element, offset))
                });
                Self { value: span, inside: inside.collect() }
            }
            _ => Self { value: span, inside: Vec::new() },
        }
    }

    /// The place of a table that is not there, or of another kind.
    pub(crate) fn empty(value: Range<usize>) -> Self {
        Self { value, inside: Vec::new() }
    }

    /// The place at `path`, as far as it goes: bytes of the last key found, its place, and how many steps were found.
    pub fn find(&self, path: &[String]) -> (Range<usize>, &Self, usize) {
        let (mut key, mut place) = (self.value.clone(), self);
        for (depth, step) in path.iter().enumerate() {
            let Some((_, span, inner)) = place.inside.iter().find(|(name, _, _)| name == step) else {
                return (key, place, depth);
            };
            (key, place) = (span.clone(), inner);
        }
        (key, place, path.len())
    }
}

fn entries(table: &DeTable<'_>, offset: usize) -> Vec<(String, Range<usize>, Place)> {
    let entry =
        |(key, value): (&Spanned<_>, &_)| (key_text(key), shifted(key.span(), offset), Place::of(value, offset));
    table.iter().map(entry).collect()
}

fn key_text(key: &Spanned<std::borrow::Cow<'_, str>>) -> String {
    key.get_ref().to_string()
}

fn shifted(span: Range<usize>, offset: usize) -> Range<usize> {
    span.start + offset..span.end + offset
}

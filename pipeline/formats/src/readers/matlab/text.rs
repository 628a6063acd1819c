//! Texts, which are remarks.

pub(super) use crate::facts::remark_on_text as remark_short;

/// Texts up to this many characters are shown: units and names are no longer.
pub(super) const SHORT: usize = 64;

pub(super) fn remark_long(location: &str, characters: usize) -> String {
    format!("{location} is a text of {characters} characters, no channel")
}

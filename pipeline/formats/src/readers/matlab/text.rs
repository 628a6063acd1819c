//! Texts, which are remarks.

use crate::facts::ONE_TEXT;

/// Texts up to this many characters are shown: units and names are no longer.
pub(super) const SHORT: usize = 64;

pub(super) fn remark_short(location: &str, text: &str) -> String {
    format!("{location} {ONE_TEXT} \"{}\"", text.escape_debug())
}

pub(super) fn remark_long(location: &str, characters: usize) -> String {
    format!("{location} is a text of {characters} characters, no channel")
}

//! Texts, which are remarks.

/// Texts up to this many characters are shown: units and names are no longer.
pub(super) const SHORT: usize = 64;

/// One byte for one character.
pub(super) fn latin(bytes: &[u8]) -> String {
    bytes.iter().map(|&byte| char::from(byte)).collect()
}

pub(super) fn remark_short(location: &str, text: &str) -> String {
    format!("{location} is the text \"{}\"", text.escape_debug())
}

pub(super) fn remark_long(location: &str, characters: usize) -> String {
    format!("{location} is a text of {characters} characters, no channel")
}

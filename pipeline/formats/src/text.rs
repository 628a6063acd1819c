//! Text in headers: fixed fields and encodings that are not stated.

/// UTF-8 if it is that, else Latin-1 (whose letters that matter here, µ and °, older instruments write).
pub(crate) fn decode(bytes: &[u8]) -> String {
    std::str::from_utf8(bytes).map_or_else(|_| latin(bytes), str::to_owned)
}

/// The same for bytes of one's own, which are not copied.
pub(crate) fn decoded(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap_or_else(|error| latin(error.as_bytes()))
}

/// Marks of UTF-16, little-endian and big-endian.
const UTF_16: [[u8; 2]; 2] = [*b"\xFF\xFE", *b"\xFE\xFF"];

/// Whether bytes begin as UTF-16 does.
pub(crate) fn is_utf16(bytes: &[u8]) -> bool {
    UTF_16.iter().any(|mark| bytes.starts_with(mark))
}

/// UTF-16 without the mark that it begins with; what is no character becomes a replacement.
pub(crate) fn utf16(bytes: &[u8]) -> String {
    let big = bytes.starts_with(&UTF_16[1]);
    let (pairs, _) = bytes.get(2..).unwrap_or_default().as_chunks();
    let units = pairs.iter().map(|pair| if big { u16::from_be_bytes(*pair) } else { u16::from_le_bytes(*pair) });
    char::decode_utf16(units).map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

/// One byte for one character.
pub(crate) fn latin(bytes: &[u8]) -> String {
    bytes.iter().map(|&byte| char::from(byte)).collect()
}

/// A field of fixed size: up to its first zero byte, without blanks around it.
pub(crate) fn field(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
    decode(bytes.get(..end).unwrap_or_default()).trim().to_owned()
}

/// A number that is finite.
pub(crate) fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|x: &f64| x.is_finite())
}

/// A number and the unit behind it, which is empty if none is there: `4E-9`, `1000 Hz`.
pub(crate) fn quantity(text: &str, parse: impl Fn(&str) -> Option<f64>) -> Option<(f64, &str)> {
    let text = text.trim();
    if let Some(number) = parse(text) {
        return Some((number, ""));
    }
    let unit = text.trim_start_matches(|c: char| !c.is_alphabetic() || matches!(c, 'e' | 'E'));
    Some((parse(text.strip_suffix(unit)?)?, unit.trim()))
}

/// At most `most` characters of a text that goes into a message.
pub(crate) fn brief(text: &str, most: usize) -> String {
    let mut out: String = text.chars().take(most).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().nth(most).is_some() {
        out.push('…');
    }
    out
}

/// The file's extension in lower case.
pub(crate) fn extension(path: &std::path::Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase()
}

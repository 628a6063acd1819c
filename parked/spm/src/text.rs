//! Text in headers: fixed fields and encodings that are not stated.

/// UTF-8 if it is that, else Latin-1 (whose letters that matter here, µ and °, older instruments write).
pub(crate) fn decode(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
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

//! Lines of a stream that nobody vouches for: bounded, and text or an error.

use std::io::{BufRead, BufReader, Read};

/// The longest line: a description or an answer with small arrays in it. More belongs into the file.
pub(super) const MOST_BYTES: usize = 16 << 20;

/// What comes out of a plugin.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::plugin) enum Line {
    /// A line without its end.
    Text(String),
    /// A line that is no UTF-8, as far as it can be shown.
    NotText(String),
    /// A line longer than [`MOST_BYTES`]; its beginning.
    TooLong(String),
    /// Bytes after the last end of line.
    CutShort(String),
}

/// Calls `each` with every line, until it says no, the stream ends, or a line is too long.
pub(in crate::plugin) fn read_lines(stream: impl Read, most: usize, mut each: impl FnMut(Line) -> bool) {
    let mut reader = BufReader::with_capacity(1 << 16, stream);
    loop {
        let mut bytes = Vec::new();
        let read = reader.by_ref().take(most as u64 + 1).read_until(b'\n', &mut bytes);
        let line = match (read, bytes.last()) {
            (Ok(_), None) | (Err(_), _) => return,
            (Ok(_), Some(b'\n')) => {
                bytes.truncate(bytes.len() - usize::from(bytes.ends_with(b"\n")));
                bytes.truncate(bytes.len() - usize::from(bytes.ends_with(b"\r")));
                match String::from_utf8(bytes) {
                    Ok(text) => Line::Text(text),
                    Err(error) => Line::NotText(shown(error.as_bytes())),
                }
            }
            (Ok(_), Some(_)) if bytes.len() > most => Line::TooLong(shown(&bytes)),
            (Ok(_), Some(_)) => Line::CutShort(shown(&bytes)),
        };
        let last = matches!(line, Line::TooLong(_));
        if !each(line) || last {
            return;
        }
    }
}

/// The beginning of a line, for messages.
pub(in crate::plugin) fn shown(bytes: &[u8]) -> String {
    const MOST: usize = 120;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * MOST)]);
    let mut short: String = text.chars().take(MOST).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if bytes.len() > short.len() {
        short.push_str("...");
    }
    short
}

#[cfg(test)]
mod tests {
    use super::{Line, read_lines};

    fn lines(bytes: &[u8]) -> Vec<Line> {
        let mut found = Vec::new();
        read_lines(bytes, 8, |line| {
            found.push(line);
            true
        });
        found
    }

    #[test]
    fn a_line_is_bounded_and_text() {
        let text = |text: &str| Line::Text(text.to_owned());
        assert_eq!(lines(b"one\r\n\ntwo\n"), [text("one"), text(""), text("two")]);
        assert_eq!(lines(b"12345678\n"), [text("12345678")], "the bound itself is allowed");
        assert_eq!(lines(b"123456789\nx\n"), [Line::TooLong("123456789".to_owned())], "nothing is read after it");
        assert_eq!(lines(b"cut"), [Line::CutShort("cut".to_owned())]);
        assert_eq!(lines(b"a\xff\n"), [Line::NotText("a\u{fffd}".to_owned())]);
    }
}

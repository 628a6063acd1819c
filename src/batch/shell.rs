//! Words for bash.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;

use crate::printable::acts;

/// A word that bash reads as exactly these bytes. It is printable ASCII or UTF-8 on one line, whatever they are; what
/// acts or is not seen is an escape.
pub fn quoted(word: impl AsRef<OsStr>) -> String {
    let bytes = word.as_ref().as_bytes();
    match std::str::from_utf8(bytes) {
        Ok(text) if !text.is_empty() && text.bytes().all(is_plain) => text.to_owned(),
        Ok(text) if !text.chars().any(|c| c.is_control() || acts(c)) => format!("'{}'", text.replace('\'', r"'\''")),
        _ => {
            let escaped = |&byte: &u8| match byte {
                b'\'' | b'\\' => format!("\\{}", char::from(byte)),
                b' '..=b'~' => char::from(byte).to_string(),
                _ => format!("\\x{byte:02x}"),
            };
            format!("$'{}'", bytes.iter().map(escaped).collect::<String>())
        }
    }
}

/// Bytes that mean themselves anywhere in a word.
fn is_plain(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || b"/._-+,:@%".contains(&byte)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bash_reads_every_word_as_it_was() {
        let words: Vec<Vec<u8>> = vec![
            b"".to_vec(),
            b"/plain/path-1.toml".to_vec(),
            b"a b\tc".to_vec(),
            b"it's \"$HOME\" `id` $(id) \\ !! & ; | < > ( ) { } [ ] * ? ~ # = ^".to_vec(),
            b"two\nlines\r".to_vec(),
            "\u{b5}m \u{201c}x\u{201d}".as_bytes().to_vec(),
            // bytes of no encoding, each before a digit that could be taken for its own
            b"\xff0\x01a\x7f'\\".to_vec(),
            b"-n".to_vec(),
            "a\u{202e}\u{200b}'1".as_bytes().to_vec(),
            (1..=255).collect(),
        ];
        for word in words {
            let text = quoted(OsStr::from_bytes(&word));
            assert!(!text.contains(|c: char| c.is_control() || acts(c)), "{text:?}");
            let script = format!("set -f; w={text}; printf %s \"$w\"; printf '|%s' {text} b");
            let read = std::process::Command::new("bash").arg("-c").arg(script).output().expect("bash starts");
            let wanted = [&word[..], b"|", &word[..], b"|b"].concat();
            assert!(read.stdout == wanted, "{text}: {:?}", String::from_utf8_lossy(&read.stdout));
        }
    }
}

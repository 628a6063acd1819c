//! Tables of text that are packed with gzip.

use crate::FormatError;
use crate::budget::most_inflated;
use crate::fail;
use flate2::read::MultiGzDecoder;
use std::io::{Error, Read};
use std::path::{Path, PathBuf};

const MAGIC: &[u8] = b"\x1f\x8b";

/// What the first bytes of a packed file hold, as far as they can be inflated, and its name without `.gz`; none if it is
/// not packed, or packed within itself.
pub(super) fn head(head: &[u8], path: &Path) -> Option<(Vec<u8>, PathBuf)> {
    let ending = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("gz"));
    if !head.starts_with(MAGIC) || !ending {
        return None;
    }
    let mut inflated = vec![0; head.len()];
    let (mut inside, mut filled) = (MultiGzDecoder::new(head), 0);
    // the bytes end where the file goes on
    while let Ok(count @ 1..) = inside.read(inflated.get_mut(filled..).unwrap_or_default()) {
        filled += count;
    }
    inflated.truncate(filled);
    let bare = path.with_extension("");
    (!inflated.starts_with(MAGIC)).then_some((inflated, bare))
}

/// Whether a file begins as gzip does.
pub(super) fn is_packed(first: &[u8]) -> bool {
    first.starts_with(MAGIC)
}

/// What a packed file holds, and how many bytes that may be at most. More is an error of the reader.
pub(super) fn inside(file: impl Read + 'static, file_bytes: u64) -> (Box<dyn Read>, u64) {
    let most = most_inflated(file_bytes);
    (Box::new(Bounded { inside: MultiGzDecoder::new(file), left: most }), most)
}

/// A reader that fails beyond a number of bytes.
struct Bounded<R> {
    inside: R,
    left: u64,
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Error> {
        let count = self.inside.read(into)?;
        self.left = self.left.checked_sub(count as u64).ok_or_else(|| {
            Error::other("it unpacks to more than a measurement of its size does: unpack it yourself, if it is one")
        })?;
        Ok(count)
    }
}

/// That the file cannot be read.
pub(super) fn unreadable(error: &Error) -> FormatError {
    fail::at(0, format!("the file cannot be read: {error}"), fail::COPY_AGAIN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::GzEncoder;
    use std::io::Write;

    fn packed(text: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(text).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn the_head_of_a_packed_table_is_its_first_lines() {
        let rows: String = (0..3000).map(|k| format!("{},{}\n", k, f64::from(k).sin())).collect();
        let whole = packed(rows.as_bytes());
        let (found, name) = head(&whole[..4096], Path::new("a/b.csv.gz")).unwrap();
        assert!(rows.as_bytes().starts_with(&found) && found.len() > 1000, "{}", found.len());
        assert_eq!(name, Path::new("a/b.csv"));
        assert!(head(&whole, Path::new("a/b.csv")).is_none());
        assert!(head(rows.as_bytes(), Path::new("a/b.csv.gz")).is_none());
        assert!(head(&packed(&whole), Path::new("a/b.csv.gz")).is_none());
    }

    #[test]
    fn what_unpacks_to_too_much_is_an_error() {
        let mut bounded = Bounded { inside: &[7_u8; 100][..], left: 64 };
        let mut all = Vec::new();
        assert!(bounded.read_to_end(&mut all).is_err());
    }
}

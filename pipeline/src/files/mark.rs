//! Marks: a page or a model that this program wrote states the hash of its other bytes, which distinguishes it from a
//! file of others, and from one that somebody edited since.

use std::path::Path;

use super::read_regular;

/// Stands before the digits. Short: the header of a MATLAB file has room for little more.
pub const MARK: &str = "afmid BLAKE3 ";

/// Hexadecimal digits of a hash.
const DIGITS: usize = 64;

/// The bytes with their mark: [`MARK`] and 64 zeros stand somewhere in what `with` makes of these; the zeros become the
/// hash of all bytes as they are with the zeros. None: they do not stand there.
pub fn marked(with: impl FnOnce(&str) -> Vec<u8>) -> Option<Vec<u8>> {
    let blank = format!("{MARK}{}", "0".repeat(DIGITS));
    let mut bytes = with(&blank);
    let at = memchr::memmem::rfind(&bytes, blank.as_bytes())? + MARK.len();
    let hash = blake3::hash(&bytes).to_hex();
    bytes.get_mut(at..at + DIGITS)?.copy_from_slice(hash.as_bytes());
    Some(bytes)
}

/// Whether a file states a mark that fits: it is as this program wrote it. Errors: it cannot be read.
pub fn has_mark(path: &Path) -> std::io::Result<bool> {
    Ok(fits(&read_regular(path, u64::MAX)?))
}

/// Whether a file states a mark, whether it fits or not. Errors: it cannot be read.
pub fn states_mark(path: &Path) -> std::io::Result<bool> {
    Ok(memchr::memmem::find(&read_regular(path, u64::MAX)?, MARK.as_bytes()).is_some())
}

/// The last mark counts: what is shown in a page may quote one.
fn fits(bytes: &[u8]) -> bool {
    let Some(at) = memchr::memmem::rfind(bytes, MARK.as_bytes()).map(|at| at + MARK.len()) else { return false };
    let Some(stated) = bytes.get(at..at + DIGITS) else { return false };
    let mut hasher = blake3::Hasher::new();
    hasher.update(&bytes[..at]).update(&[b'0'; DIGITS]).update(&bytes[at + DIGITS..]);
    hasher.finalize().to_hex().as_bytes() == stated
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_fits_until_a_byte_is_another() {
        let page = |blank: &str| format!("<html>a {MARK}quoted</html>\n<!-- {blank} -->\n").into_bytes();
        let whole = marked(page).unwrap();
        assert!(fits(&whole));
        for at in 0..whole.len() {
            let mut other = whole.clone();
            other[at] ^= 1;
            assert!(!fits(&other), "byte {at}");
        }
        assert!(!fits(&whole[..whole.len() - 1]) && !fits(b"") && !fits(MARK.as_bytes()));
        assert!(!fits(&[&whole[..], b" "].concat()));
        assert_eq!(marked(|_| b"no place".to_vec()), None);
    }
}

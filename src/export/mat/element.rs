//! Data elements: a tag (type and number of bytes) and data, padded to eight bytes.

/// Types of data elements (table 1-1 of the format's description).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    /// miINT8.
    Int8 = 1,
    /// miUINT8.
    Uint8 = 2,
    /// miUINT16.
    Uint16 = 4,
    /// miINT32.
    Int32 = 5,
    /// miUINT32.
    Uint32 = 6,
    /// miDOUBLE.
    Double = 9,
    /// miMATRIX.
    Matrix = 14,
}

/// Something is too large for the format.
#[derive(Debug, thiserror::Error)]
#[error("{what} has {found}, a MATLAB file of level 5 holds at most {most}; export it as JSON")]
pub struct MatError {
    /// What is too large.
    pub what: &'static str,
    /// Its size.
    pub found: usize,
    /// The largest that the format holds.
    pub most: u32,
}

/// A size as the format stores it. Errors: it is 2 GiB or more, more than readers take.
pub fn size(what: &'static str, found: usize) -> Result<u32, MatError> {
    let most = i32::MAX.unsigned_abs();
    u32::try_from(found).ok().filter(|size| *size <= most).ok_or(MatError { what, found, most })
}

/// Appends an element; one to four bytes go into the tag itself (the small format, which MATLAB wants for names of
/// fields).
pub fn element(out: &mut Vec<u8>, kind: Kind, data: &[u8]) -> Result<(), MatError> {
    let length = size("an element", data.len())?;
    let kind = kind as u32;
    if (1..=4).contains(&length) {
        out.extend(((length << 16) | kind).to_le_bytes());
        out.extend(data);
        out.resize(out.len() + 4 - data.len(), 0);
        return Ok(());
    }
    out.extend(kind.to_le_bytes());
    out.extend(length.to_le_bytes());
    out.extend(data);
    out.resize(out.len().next_multiple_of(8), 0);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_padded_and_small_ones_lie_in_the_tag() {
        let mut out = Vec::new();
        element(&mut out, Kind::Int8, b"abc").unwrap();
        assert_eq!(out, [1, 0, 3, 0, b'a', b'b', b'c', 0]);
        out.clear();
        element(&mut out, Kind::Int8, b"abcde").unwrap();
        assert_eq!(out, [1, 0, 0, 0, 5, 0, 0, 0, b'a', b'b', b'c', b'd', b'e', 0, 0, 0]);
        out.clear();
        element(&mut out, Kind::Double, b"").unwrap();
        assert_eq!(out, [9, 0, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn what_is_too_large_is_said() {
        assert_eq!(size("A", 7).unwrap(), 7);
        let error = size("A", 1 << 31).unwrap_err().to_string();
        assert!(error.starts_with("A has 2147483648, ") && error.ends_with("export it as JSON"), "{error}");
    }
}

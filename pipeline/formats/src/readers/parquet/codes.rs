//! Numbers as pages have them.
//!
//! Source: Apache Parquet, "Parquet encoding definitions"
//! (<https://parquet.apache.org/docs/file-format/data-pages/encodings>).

use super::compact::zigzag;
use crate::columnar::{bits, varint};

/// `count` numbers of `width` bits, as runs of one number and as packed bits in turn. None: damaged.
pub(super) fn runs(mut bytes: &[u8], width: u32, count: usize) -> Option<Vec<u32>> {
    let mut numbers = Vec::new();
    if width > 32 {
        return None;
    }
    while numbers.len() < count {
        let missing = count - numbers.len();
        let (head, length) = varint(bytes)?;
        bytes = bytes.get(length..)?;
        if head & 1 == 1 {
            let packed = usize::try_from(head >> 1).ok()?.checked_mul(width as usize)?;
            let here = usize::try_from(head >> 1).ok()?.checked_mul(8)?.min(missing);
            // the last group may be cut off behind its last number
            let (group, rest) = bytes.split_at(packed.min(bytes.len()));
            for number in 0..here {
                numbers.push(bits(group, number * width as usize, width)? as u32);
            }
            bytes = rest;
        } else {
            let (value, rest) = bytes.split_at_checked(width.div_ceil(8) as usize)?;
            let value = value.iter().rev().fold(0_u32, |number, &byte| number << 8 | u32::from(byte));
            let here = usize::try_from(head >> 1).ok()?.min(missing);
            if here == 0 {
                return None;
            }
            numbers.resize(numbers.len() + here, value);
            bytes = rest;
        }
    }
    Some(numbers)
}

/// Numbers of `width` bytes whose first bytes lie together, then their second ones, and so on.
pub(super) fn joined_streams(bytes: &[u8], width: usize, count: usize) -> Option<Vec<u8>> {
    let bytes = bytes.get(..width.checked_mul(count)?)?;
    let byte = |at: usize| bytes.get((at % width) * count + at / width).copied();
    (0..bytes.len()).map(byte).collect()
}

/// `count` numbers of `width` bytes of which the differences are packed. None: damaged.
pub(super) fn differences(mut bytes: &[u8], width: usize, count: usize) -> Option<Vec<u8>> {
    let whole = |bytes: &mut &[u8]| -> Option<u64> {
        let (number, length) = varint(bytes)?;
        *bytes = bytes.get(length..)?;
        Some(number)
    };
    let (block, parts) = (whole(&mut bytes)?, whole(&mut bytes)?);
    let (total, first) = (whole(&mut bytes)?, zigzag(whole(&mut bytes)?));
    let in_part = usize::try_from(block.checked_div(parts)?).ok()?;
    if total != count as u64 || in_part == 0 || !in_part.is_multiple_of(8) || parts > bytes.len() as u64 {
        return (count == 0 && total == 0).then(Vec::new);
    }
    let mut number = first;
    let mut out = Vec::new();
    let mut put = |number: i64| out.extend_from_slice(number.to_le_bytes().get(..width).unwrap_or_default());
    put(number);
    let mut missing = count.checked_sub(1)?;
    while missing > 0 {
        let least = zigzag(whole(&mut bytes)?);
        let (widths, rest) = bytes.split_at_checked(parts as usize)?;
        bytes = rest;
        for &part in widths {
            if missing == 0 {
                break;
            }
            if part > 64 {
                return None;
            }
            let here = in_part.min(missing);
            // the last part may be cut off behind its last number
            let (packed, rest) = bytes.split_at((in_part / 8).checked_mul(usize::from(part))?.min(bytes.len()));
            for at in 0..here {
                let more = bits(packed, at * usize::from(part), u32::from(part))?.cast_signed();
                number = number.wrapping_add(least).wrapping_add(more);
                put(number);
            }
            bytes = rest;
            missing -= here;
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columnar::truths;

    #[test]
    fn runs_packed_bits_and_differences() {
        // the example of the definition: 0 to 7 in three bits each
        assert_eq!(runs(&[3, 0x88, 0xc6, 0xfa], 3, 8).unwrap(), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(runs(&[8, 5, 3, 0x88, 0xc6, 0xfa], 3, 6).unwrap(), [5, 5, 5, 5, 0, 1]);
        assert_eq!(runs(&[4], 0, 2).unwrap(), [0, 0]);
        assert_eq!((runs(&[0, 1], 3, 8), runs(&[3, 0x88], 3, 8), runs(&[], 3, 1)), (None, None, None));
        assert_eq!(runs(&[0xff; 20], 32, 1000), None);
        assert_eq!(truths(&[0b101], 0, 3).unwrap(), [1, 0, 1]);
        assert_eq!(joined_streams(&[1, 2, 3, 4, 5, 6], 2, 3).unwrap(), [1, 4, 2, 5, 3, 6]);
        assert_eq!(joined_streams(&[1, 2], 2, 3), None);
        // the example of the definition: 7, 5, 3, 1, 2, 3, 4, 5
        let packed = [0x80, 1, 4, 8, 14, 3, 2, 0, 0, 0, 0xc0, 0x3f, 0, 0, 0, 0, 0, 0];
        let found = differences(&packed, 4, 8).unwrap();
        let numbers: Vec<i32> = found.as_chunks().0.iter().map(|bytes| i32::from_le_bytes(*bytes)).collect();
        assert_eq!(numbers, [7, 5, 3, 1, 2, 3, 4, 5]);
        for cut in 0..12 {
            assert_eq!(differences(&packed[..cut], 4, 8), None, "{cut}");
        }
        assert_eq!(differences(&[0x80, 1, 0, 8, 14], 4, 8), None);
        assert_eq!(differences(&[0x80, 1, 4, 0xff, 0xff, 0xff, 0xff, 0x0f, 14], 4, 8), None);
    }
}

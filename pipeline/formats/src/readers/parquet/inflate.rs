//! Pages as they were before they were packed.
//!
//! Source: Google, "Snappy compressed format description"; LZ4, "LZ4 Block Format Description"; RFC 1952 (gzip).

use super::compact::varint;
use flate2::read::MultiGzDecoder;
use std::io::Read;

/// How a column is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Codec {
    Plain,
    Snappy,
    Gzip,
    Lz4,
}

impl Codec {
    /// By its number in a file. Error: the name of one that is not unpacked.
    pub(super) fn of(number: i64) -> Result<Self, &'static str> {
        Err(match number {
            0 => return Ok(Self::Plain),
            1 => return Ok(Self::Snappy),
            2 => return Ok(Self::Gzip),
            7 => return Ok(Self::Lz4),
            3 => "LZO",
            4 => "Brotli",
            5 => "LZ4 in Hadoop's frames",
            6 => "Zstandard",
            _ => "an unknown codec",
        })
    }

    /// Exactly `length` bytes. None: damaged, or of another length.
    pub(super) fn unpack(self, packed: &[u8], length: usize) -> Option<Vec<u8>> {
        let bytes = match self {
            Self::Plain => packed.to_vec(),
            Self::Snappy => snappy(packed, length)?,
            Self::Lz4 => lz4(packed, length)?,
            Self::Gzip => {
                let mut bytes = Vec::new();
                MultiGzDecoder::new(packed).take(length as u64 + 1).read_to_end(&mut bytes).ok()?;
                bytes
            }
        };
        (bytes.len() == length).then_some(bytes)
    }
}

/// Bytes that are read from the front, and what has come of them so far.
#[derive(Debug)]
struct Unpacking<'a> {
    packed: &'a [u8],
    out: Vec<u8>,
    most: usize,
}

impl Unpacking<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (&byte, rest) = self.packed.split_first()?;
        self.packed = rest;
        Some(byte)
    }

    /// A whole number of `count` bytes, the lowest first.
    fn number(&mut self, count: usize) -> Option<usize> {
        (0..count).try_fold(0_usize, |number, at| Some(number | usize::from(self.byte()?) << (8 * at)))
    }

    /// Bytes as they are.
    fn literal(&mut self, count: usize) -> Option<()> {
        let (taken, rest) = self.packed.split_at_checked(count)?;
        self.packed = rest;
        self.out.extend_from_slice(taken);
        (self.out.len() <= self.most).then_some(())
    }

    /// Bytes from `back` before the end, which may be among those that are just put.
    fn again(&mut self, back: usize, count: usize) -> Option<()> {
        let from = self.out.len().checked_sub(back).filter(|_| back > 0)?;
        if count > self.most.saturating_sub(self.out.len()) {
            return None;
        }
        if back >= count {
            self.out.extend_from_within(from..from + count);
        } else {
            for at in from..from + count {
                self.out.push(*self.out.get(at)?);
            }
        }
        Some(())
    }
}

fn snappy(packed: &[u8], most: usize) -> Option<Vec<u8>> {
    let (_, head) = varint(packed)?;
    let mut unpacking = Unpacking { packed: packed.get(head..)?, out: Vec::new(), most };
    while let Some(tag) = unpacking.byte() {
        let upper = usize::from(tag >> 2);
        match tag & 3 {
            0 => {
                let length = if upper < 60 { upper } else { unpacking.number(upper - 59)? };
                unpacking.literal(length.checked_add(1)?)?;
            }
            1 => {
                let back = usize::from(tag >> 5) << 8 | usize::from(unpacking.byte()?);
                unpacking.again(back, (upper & 7) + 4)?;
            }
            kind => {
                let back = unpacking.number(if kind == 2 { 2 } else { 4 })?;
                unpacking.again(back, upper + 1)?;
            }
        }
    }
    Some(unpacking.out)
}

fn lz4(packed: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut unpacking = Unpacking { packed, out: Vec::new(), most };
    while let Some(token) = unpacking.byte() {
        let literal = lz4_length(&mut unpacking, usize::from(token >> 4))?;
        unpacking.literal(literal)?;
        if unpacking.packed.is_empty() {
            break;
        }
        let back = unpacking.number(2)?;
        let count = lz4_length(&mut unpacking, usize::from(token & 15))?;
        unpacking.again(back, count.checked_add(4)?)?;
    }
    Some(unpacking.out)
}

/// A length of four bits, longer ones with bytes behind them.
fn lz4_length(unpacking: &mut Unpacking, short: usize) -> Option<usize> {
    let mut length = short;
    while length >= 15 && short == 15 {
        let more = unpacking.byte()?;
        length = length.checked_add(usize::from(more))?;
        if more < 255 {
            break;
        }
    }
    Some(length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_unpacked_and_damaged_ones_refused() {
        // "abcd", then six bytes from four before
        let snappy = [10, 3 << 2, b'a', b'b', b'c', b'd', (2 << 2) | 1, 4];
        assert_eq!(Codec::Snappy.unpack(&snappy, 10).unwrap(), b"abcdabcdab");
        let lz4 = [0x42, b'a', b'b', b'c', b'd', 4, 0, 0x10, b'x'];
        assert_eq!(Codec::Lz4.unpack(&lz4, 11).unwrap(), b"abcdabcdabx");
        for codec in [Codec::Snappy, Codec::Lz4, Codec::Gzip, Codec::Plain] {
            for bytes in [&snappy[..], &lz4[..], &[0xff; 40], &[0; 3]] {
                for cut in 0..bytes.len() {
                    assert_eq!(codec.unpack(&bytes[..cut], 10_000), None);
                }
            }
        }
        // a copy from before the beginning, one from nowhere, a literal of 2^32 bytes
        for bytes in [&[10, (2 << 2) | 1, 4][..], &[10, 0, b'a', (2 << 2) | 1, 0], &[1, 63 << 2, 255, 255, 255, 255]] {
            assert_eq!(Codec::Snappy.unpack(bytes, 10), None, "{bytes:?}");
        }
        // more than was promised
        assert_eq!(Codec::Snappy.unpack(&snappy, 9), None);
        assert_eq!(Codec::of(6), Err("Zstandard"));
    }
}

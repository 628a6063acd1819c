//! Bytes as they were before they were packed.
//!
//! Source: RFC 1952 (gzip), RFC 7932 (Brotli), RFC 8878 (Zstandard); [`super::blocks`] has those of Snappy and LZ4.

use super::blocks::{lz4, lz4_frame, snappy};
use brotli_decompressor::Decompressor;
use flate2::read::MultiGzDecoder;
use ruzstd::decoding::StreamingDecoder;
use std::io::Read;

/// Zstandard looks back by at most this in data of a lesser length: what RFC 8878 lets every decoder have.
const LEAST_WINDOW_BYTES: u64 = 8 << 20;

/// Packed bytes that the decoder of Brotli takes at once.
const BROTLI_PIECE_BYTES: usize = 1 << 12;

/// How bytes are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Codec {
    Plain,
    Snappy,
    Gzip,
    Brotli,
    Lz4,
    Lz4Frame,
    Zstandard,
}

impl Codec {
    /// Exactly `length` bytes. None: damaged, or of another length.
    pub(crate) fn unpack(self, packed: &[u8], length: usize) -> Option<Vec<u8>> {
        let bytes = match self {
            Self::Plain => packed.to_vec(),
            Self::Snappy => snappy(packed, length)?,
            Self::Lz4 => lz4(packed, length)?,
            Self::Lz4Frame => lz4_frame(packed, length)?,
            Self::Gzip => at_most(MultiGzDecoder::new(packed), length)?,
            Self::Brotli => at_most(Decompressor::new(packed, BROTLI_PIECE_BYTES), length)?,
            Self::Zstandard => zstandard(packed, length)?,
        };
        (bytes.len() == length).then_some(bytes)
    }
}

/// What a decoder gives, but no more than one byte beyond `length`.
fn at_most(decoder: impl Read, length: usize) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    decoder.take(length as u64 + 1).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

/// One frame of Zstandard; its checksum is verified if there is one.
fn zstandard(packed: &[u8], length: usize) -> Option<Vec<u8>> {
    let window = LEAST_WINDOW_BYTES.max(length.checked_next_power_of_two()? as u64);
    let mut decoder = StreamingDecoder::new_with_max_window_size(packed, window).ok()?;
    let bytes = at_most(&mut decoder, length)?;
    let decoder = decoder.into_frame_decoder();
    let stated = decoder.get_checksum_from_data();
    (stated.is_none() || stated == decoder.get_calculated_checksum()).then_some(bytes)
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
        use Codec::{Brotli, Gzip, Lz4, Lz4Frame, Plain, Snappy, Zstandard};
        for codec in [Plain, Snappy, Gzip, Brotli, Lz4, Lz4Frame, Zstandard] {
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
        // 4000 times "a", as the programs of those who made the codecs pack it
        let a = [27, 159, 15, 0, 36, 194, 226, 177, 64, 178, 14, 0, 0];
        assert_eq!(Codec::Brotli.unpack(&a, 4000).unwrap(), [b'a'; 4000]);
        assert_eq!((Codec::Brotli.unpack(&a, 3999), Codec::Brotli.unpack(&a[..10], 4000)), (None, None));
        let a = [40, 181, 47, 253, 96, 160, 14, 77, 0, 0, 16, 97, 97, 1, 0, 155, 247, 1, 22];
        assert_eq!(Codec::Zstandard.unpack(&a, 4000).unwrap(), [b'a'; 4000]);
        assert_eq!((Codec::Zstandard.unpack(&a, 3999), Codec::Zstandard.unpack(&a[..15], 4000)), (None, None));
        // a window of 2^41 bytes
        assert_eq!(Codec::Zstandard.unpack(&[40, 181, 47, 253, 0, 0xf8, 1, 0, 0], 0), None);
    }
}

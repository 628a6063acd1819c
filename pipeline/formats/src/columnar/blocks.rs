//! Packed blocks of bytes: literal ones, and copies of those before.
//!
//! Source: Google, "Snappy compressed format description"; LZ4, "LZ4 Block Format Description" and "LZ4 Frame Format
//! Description".

use super::varint;
use twox_hash::XxHash32;

/// Bytes that are read from the front, and what has come of them so far.
#[derive(Debug)]
struct Unpacking<'a> {
    packed: &'a [u8],
    out: Vec<u8>,
    most: usize,
}

impl<'a> Unpacking<'a> {
    fn byte(&mut self) -> Option<u8> {
        let (&byte, rest) = self.packed.split_first()?;
        self.packed = rest;
        Some(byte)
    }

    /// The next `count` bytes.
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.packed.split_at_checked(count)?;
        self.packed = rest;
        Some(taken)
    }

    /// A whole number of `count` bytes, the lowest first.
    fn number(&mut self, count: usize) -> Option<usize> {
        (0..count).try_fold(0_usize, |number, at| Some(number | usize::from(self.byte()?) << (8 * at)))
    }

    /// Bytes as they are.
    fn literal(&mut self, count: usize) -> Option<()> {
        let taken = self.take(count)?;
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

    /// One block of LZ4, to the end of the packed bytes.
    fn lz4_block(&mut self) -> Option<()> {
        while let Some(token) = self.byte() {
            let literal = self.lz4_length(usize::from(token >> 4))?;
            self.literal(literal)?;
            if self.packed.is_empty() {
                break;
            }
            let back = self.number(2)?;
            let count = self.lz4_length(usize::from(token & 15))?;
            self.again(back, count.checked_add(4)?)?;
        }
        Some(())
    }

    /// A length of four bits, longer ones with bytes behind them.
    fn lz4_length(&mut self, short: usize) -> Option<usize> {
        let mut length = short;
        while length >= 15 && short == 15 {
            let more = self.byte()?;
            length = length.checked_add(usize::from(more))?;
            if more < 255 {
                break;
            }
        }
        Some(length)
    }
}

/// At most `most` bytes of a block of Snappy. None: damaged, or more.
pub(super) fn snappy(packed: &[u8], most: usize) -> Option<Vec<u8>> {
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

/// At most `most` bytes of one block of LZ4. None: damaged, or more.
pub(super) fn lz4(packed: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut unpacking = Unpacking { packed, out: Vec::new(), most };
    unpacking.lz4_block()?;
    Some(unpacking.out)
}

/// First bytes of a frame.
const LZ4_FRAME_MAGIC: usize = 0x184d_2204;

/// The bit of a block's length that says that its bytes are as they were.
const LZ4_PLAIN_BLOCK: usize = 1 << 31;

/// At most `most` bytes of a frame of LZ4: its description, blocks up to one of no bytes, checksums where the
/// description says so. None: damaged, or more.
pub(super) fn lz4_frame(packed: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut frame = Unpacking { packed, out: Vec::new(), most };
    if frame.number(4)? != LZ4_FRAME_MAGIC {
        return None;
    }
    let described = frame.packed;
    let flags = frame.byte()?;
    let says = |bit: u8| flags >> bit & 1 == 1;
    let [of_blocks, of_content, with_size, with_dictionary] = [says(4), says(2), says(3), says(0)];
    // behind flags and sizes of blocks; a dictionary would lie elsewhere
    frame.take(if with_size { 9 } else { 1 })?;
    let described = described.get(..described.len() - frame.packed.len())?;
    let stated = frame.byte()?;
    if flags >> 6 != 1 || with_dictionary || checksum(described).to_le_bytes().get(1) != Some(&stated) {
        return None;
    }
    loop {
        let length = frame.number(4)?;
        if length == 0 {
            break;
        }
        let packed = frame.take(length & !LZ4_PLAIN_BLOCK)?;
        if of_blocks && frame.number(4)? != checksum(packed) as usize {
            return None;
        }
        let mut block = Unpacking { packed, out: std::mem::take(&mut frame.out), most };
        if length & LZ4_PLAIN_BLOCK == 0 {
            block.lz4_block()?
        } else {
            block.literal(packed.len())?
        }
        frame.out = block.out;
    }
    let intact = !of_content || frame.number(4)? == checksum(&frame.out) as usize;
    intact.then_some(frame.out)
}

fn checksum(bytes: &[u8]) -> u32 {
    XxHash32::oneshot(0, bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of one block, with a checksum of its content.
    fn frame(block: &[u8], content: &[u8]) -> Vec<u8> {
        let described = [0x64, 0x40];
        let mut bytes = (LZ4_FRAME_MAGIC as u32).to_le_bytes().to_vec();
        bytes.extend(described);
        bytes.push(checksum(&described).to_le_bytes()[1]);
        bytes.extend((block.len() as u32).to_le_bytes());
        bytes.extend(block);
        bytes.extend([0; 4]);
        bytes.extend(checksum(content).to_le_bytes());
        bytes
    }

    #[test]
    fn frames_are_unpacked_and_damaged_ones_refused() {
        // "abcd", then six bytes from four before, then "x"
        let block = [0x42, b'a', b'b', b'c', b'd', 4, 0, 0x10, b'x'];
        let sound = frame(&block, b"abcdabcdabx");
        assert_eq!(lz4_frame(&sound, 11).unwrap(), b"abcdabcdabx");
        assert_eq!(lz4_frame(&sound, 10), None);
        for cut in 0..sound.len() {
            assert_eq!(lz4_frame(&sound[..cut], 100), None, "{cut}");
        }
        for at in 0..sound.len() {
            let mut damaged = sound.clone();
            damaged[at] ^= 4;
            // the last token says of no copy
            let found = lz4_frame(&damaged, 100);
            assert!(found.is_none() || at == 18, "{at}: {found:?}");
        }
    }
}

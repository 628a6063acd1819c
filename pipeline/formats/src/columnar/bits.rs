//! Numbers of few bits.

/// Bits of a number that are taken from a stream of bits, the lowest first.
pub(crate) fn bits(bytes: &[u8], first: usize, width: u32) -> Option<u64> {
    let mut number = 0_u64;
    let mut have = 0;
    while have < width {
        let at = first + have as usize;
        let (byte, from) = (*bytes.get(at / 8)?, (at % 8) as u32);
        let some = (8 - from).min(width - have);
        let part = u64::from(byte >> from) & ((1_u64 << some) - 1);
        number |= part << have;
        have += some;
    }
    Some(number)
}

/// `count` truths of a bit each from bit `first`, in bytes.
pub(crate) fn truths(bytes: &[u8], first: usize, count: usize) -> Option<Vec<u8>> {
    (first..first.checked_add(count)?).map(|at| bits(bytes, at, 1).map(|bit| bit as u8)).collect()
}

/// A number in groups of seven bits, the lowest first, and how many bytes it has. None: cut off, or beyond 64 bits.
pub(crate) fn varint(bytes: &[u8]) -> Option<(u64, usize)> {
    let mut number = 0_u64;
    for (at, &byte) in bytes.iter().enumerate().take(10) {
        number |= u64::from(byte & 127).checked_shl(7 * at as u32)?;
        if byte < 128 {
            return Some((number, at + 1));
        }
    }
    None
}

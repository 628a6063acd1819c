//! Storage chunks of HDF5 datasets: undo the filters outside HDF5's global lock.

use flate2::{Decompress, FlushDecompress, Status};

/// A filter that can be undone here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ChunkFilter {
    Deflate,
    Shuffle,
}

/// Undoes a chunk's filters, the last one first; bit i of `skipped` says that filter i was not applied to this chunk.
///
/// Errors: the bytes do not inflate to exactly `wanted` bytes.
pub(super) fn undo_filters(
    stored: Vec<u8>,
    filters: &[ChunkFilter],
    skipped: u32,
    sample_bytes: usize,
    wanted: usize,
) -> Result<Vec<u8>, String> {
    let mut bytes = stored;
    for (index, filter) in filters.iter().enumerate().rev() {
        if index < 32 && skipped & (1 << index) != 0 {
            continue;
        }
        bytes = match filter {
            ChunkFilter::Deflate => inflate(&bytes, wanted)?,
            ChunkFilter::Shuffle => unshuffle(&bytes, sample_bytes),
        };
    }
    if bytes.len() == wanted { Ok(bytes) } else { Err(format!("a chunk holds {} bytes, wanted {wanted}", bytes.len())) }
}

fn inflate(bytes: &[u8], wanted: usize) -> Result<Vec<u8>, String> {
    // never grows beyond what is wanted: a longer stream is an error, not a memory hog
    let mut inflated = Vec::with_capacity(wanted);
    let status = Decompress::new(true).decompress_vec(bytes, &mut inflated, FlushDecompress::Finish);
    match status {
        Ok(Status::StreamEnd) if inflated.len() == wanted => Ok(inflated),
        Ok(_) => Err(format!("a chunk does not inflate to the {wanted} bytes that it should hold")),
        Err(error) => Err(format!("a chunk does not inflate: {error}")),
    }
}

/// HDF5's shuffle stores all first bytes, then all second bytes...; a rest shorter than a sample stays at the end.
fn unshuffle(bytes: &[u8], sample_bytes: usize) -> Vec<u8> {
    let samples = bytes.len() / sample_bytes.max(1);
    if sample_bytes < 2 || samples == 0 {
        return bytes.to_vec();
    }
    let whole = samples * sample_bytes;
    if sample_bytes == 2 {
        return unshuffle_pairs(&bytes[..whole], &bytes[whole..]);
    }
    let mut plain = vec![0; bytes.len()];
    plain[whole..].copy_from_slice(&bytes[whole..]);
    for (place, plane) in bytes[..whole].chunks_exact(samples).enumerate() {
        for (sample, &byte) in plain[..whole].chunks_exact_mut(sample_bytes).zip(plane) {
            sample[place] = byte;
        }
    }
    plain
}

/// The same for samples of two bytes, which most recorders have: a pass that the processor's vector units take.
fn unshuffle_pairs(planes: &[u8], rest: &[u8]) -> Vec<u8> {
    let (low, high) = planes.split_at(planes.len() / 2);
    let mut plain = Vec::with_capacity(planes.len() + rest.len());
    plain.extend(low.iter().zip(high).flat_map(|(&low, &high)| [low, high]));
    plain.extend_from_slice(rest);
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_any_size_come_back_from_their_planes() {
        for sample_bytes in 1..=9 {
            for length in [0, 1, 2, 3, 17, 64, 129] {
                let plain: Vec<u8> = (0..length).map(|k| (k * 37 % 251) as u8).collect();
                let samples = length / sample_bytes;
                let whole = samples * sample_bytes;
                let place = |k: usize| plain[k % samples * sample_bytes + k / samples];
                let planes: Vec<u8> = (0..whole).map(place).chain(plain[whole..].iter().copied()).collect();
                assert_eq!(unshuffle(&planes, sample_bytes), plain, "{sample_bytes} bytes, {length}");
            }
        }
    }
}

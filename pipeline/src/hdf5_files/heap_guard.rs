//! A guard against one kind of damage that keeps the HDF5 library busy for ever.
//!
//! Texts of variable length lie in global heap collections. The library walks a collection object by object, and object 0 (the free
//! space) takes as many bytes as it states: with 0 bytes stated the walk never ends (HDF5 2.0, H5HGcache.c). Collections have no
//! checksum, so foreign files are looked through before they are opened.

use std::sync::LazyLock;

use memchr::arch::all::packedpair::HeuristicFrequencyRank;
use memchr::memmem::{Finder, FinderBuilder};

/// Signature, version and reserved bytes of a collection.
const SIGNATURE: [u8; 8] = *b"GCOL\x01\0\0\0";
/// Bytes of a collection's header, and of an object's: with lengths of 8 bytes, which every library of the last decades writes.
const HEADER: usize = 16;
/// No collection of the texts of a record's attributes is larger; larger ones are walked this far.
const LARGEST: usize = 1 << 18;

/// Finds the signature. It is looked for by its first two bytes: of two neighbours one is the high byte of a sample of two bytes, and most converters
/// never make it. The general guess, by how frequent bytes are in texts and programs, takes two low bytes and stops all the time.
static FINDER: LazyLock<Finder> =
    LazyLock::new(|| FinderBuilder::new().build_forward_with_ranker(Neighbours, &SIGNATURE));

struct Neighbours;

impl HeuristicFrequencyRank for Neighbours {
    fn rank(&self, byte: u8) -> u8 {
        // the finder takes the two of the lowest rank
        SIGNATURE[..2].iter().position(|&first| first == byte).map_or(u8::MAX, |place| place as u8)
    }
}

/// Looks for collections while a file streams by.
#[derive(Debug, Default)]
pub(crate) struct HeapGuard {
    /// The end of what has streamed by, as long as a collection might begin or continue in it.
    kept: Vec<u8>,
    /// Whether one has begun in it.
    begun: bool,
    endless: bool,
}

impl HeapGuard {
    /// Takes the next stretch of the file; copies next to nothing of it as long as no collection begins.
    pub(crate) fn update(&mut self, bytes: &[u8]) {
        let head = if self.begun { bytes.len() } else { bytes.len().min(BORDER) };
        self.kept.extend_from_slice(&bytes[..head]);
        if !self.begun {
            self.begun = begins(&self.kept) || begins(bytes);
            if !self.begun {
                self.keep_border(&bytes[head..]);
                return;
            }
            self.kept.extend_from_slice(&bytes[head..]);
        }
        let complete = self.kept.len().saturating_sub(LARGEST);
        self.scan(complete);
        self.kept.drain(..complete);
        self.begun = begins(&self.kept);
        if !self.begun {
            self.keep_border(&[]);
        }
    }

    /// Whether the library would walk for ever.
    pub(crate) fn finish(mut self) -> bool {
        self.scan(self.kept.len());
        self.endless
    }

    /// Keeps the last bytes of what is kept and what follows: a signature may begin in them.
    fn keep_border(&mut self, rest: &[u8]) {
        self.kept.extend_from_slice(&rest[rest.len().saturating_sub(BORDER)..]);
        self.kept.drain(..self.kept.len().saturating_sub(BORDER));
    }

    fn scan(&mut self, until: usize) {
        let end = self.kept.len().min(until + BORDER);
        for place in FINDER.find_iter(&self.kept[..end]) {
            self.endless |= walk_is_endless(&self.kept[place..]);
        }
    }
}

/// Bytes of a signature before its last.
const BORDER: usize = SIGNATURE.len() - 1;

fn begins(bytes: &[u8]) -> bool {
    FINDER.find(bytes).is_some()
}

/// Walks one collection as the library does.
fn walk_is_endless(collection: &[u8]) -> bool {
    let Some(size) = length_at(collection, 8) else { return false };
    let size = size.min(collection.len());
    let mut place = HEADER;
    while place.checked_add(HEADER).is_some_and(|end| end <= size) {
        let Some(object) = length_at(collection, place + 8) else { return false };
        let is_free_space = collection[place] == 0 && collection[place + 1] == 0;
        let taken = if is_free_space {
            object
        } else {
            // rounded up to multiples of 8, with the library's own overflow
            (object.wrapping_add(7) / 8 * 8).wrapping_add(HEADER)
        };
        if taken == 0 {
            return true;
        }
        let Some(next) = place.checked_add(taken) else { return false };
        place = next;
    }
    false
}

fn length_at(bytes: &[u8], place: usize) -> Option<usize> {
    let bytes = bytes.get(place..place + 8)?;
    usize::try_from(u64::from_le_bytes(bytes.try_into().ok()?)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn collection(objects: &[(u16, u64)]) -> Vec<u8> {
        let mut bytes = SIGNATURE.to_vec();
        bytes.extend(4096_u64.to_le_bytes());
        for &(index, size) in objects {
            bytes.extend(index.to_le_bytes());
            bytes.extend([0; 6]);
            bytes.extend(size.to_le_bytes());
            if index > 0 {
                bytes.resize(bytes.len() + size.div_ceil(8) as usize * 8, b'x');
            }
        }
        bytes.resize(4096, 0);
        bytes
    }

    fn endless(bytes: &[u8], step: usize) -> bool {
        let mut guard = HeapGuard::default();
        bytes.chunks(step).for_each(|bytes| guard.update(bytes));
        guard.finish()
    }

    #[test]
    fn free_space_of_no_size_is_found_wherever_it_lies() {
        let rest = 4096 - 16 - (16 + 8) - (16 + 16);
        let whole = collection(&[(1, 3), (2, 12), (0, rest)]);
        let broken = collection(&[(1, 3), (2, 12), (0, 0)]);
        for offset in [0, 1, 77, LARGEST - 5, 2 * LARGEST] {
            let around = |bytes: &[u8]| [vec![0; offset], bytes.to_vec(), vec![7; 3000]].concat();
            for step in [3, 5000, 1 << 18] {
                assert!(!endless(&around(&whole), step), "{offset} {step}");
                assert!(endless(&around(&broken), step), "{offset} {step}");
            }
        }
    }

    #[test]
    fn the_signature_alone_is_no_damage() {
        assert!(!endless(b"GCOL\x01\0\0\0", 3));
        assert!(!endless(&[SIGNATURE.as_slice(), &[0xff; 100]].concat(), 50));
    }
}

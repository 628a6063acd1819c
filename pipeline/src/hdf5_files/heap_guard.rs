//! A guard for the HDF5 library: files are looked through before they are opened.
//!
//! Texts of variable length lie in global heap collections (HDF5 File Format Specification, version 3, III.E), which
//! have no checksum. On some damaged ones the library (HDF5 2.0) did not come back, or took far longer than a file of
//! that size should. The guard refuses what the format does not allow, whether the library would survive it or
//! not: objects that are smaller than their own header, collections that take more room than the file has, lengths of an
//! unknown size.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::path::Path;
use std::sync::LazyLock;

use memchr::arch::all::packedpair::HeuristicFrequencyRank;
use memchr::memmem::{Finder, FinderBuilder};

use crate::error::{Result, StoreError};

/// Signature, version and reserved bytes of a collection.
const SIGNATURE: [u8; 8] = *b"GCOL\x01\0\0\0";
/// Bytes of a collection's header, and of an object's, whatever the length of lengths.
const HEADER: u64 = 16;
/// The library refuses smaller collections.
const SMALLEST: u64 = 4096;
/// What a file begins with, at byte 0, 512, 1024, 2048, ...
const FILE_SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// The first place behind the beginning where a file's signature may lie.
const USER_BLOCK: u64 = 512;
/// Collections lie side by side: together they cannot take more than the file, and a little for bytes that only look
/// like one.
const MOST_OVERLAP: u64 = 2;
const SPARE: u64 = 1 << 20;

/// Finds the signature. It is looked for by its first two bytes: of two neighbours one is the high byte of a sample of
/// two bytes, and most converters never make it. The general guess, by how frequent bytes are in texts and programs,
/// takes two low bytes and stops all the time.
static FINDER: LazyLock<Finder> =
    LazyLock::new(|| FinderBuilder::new().build_forward_with_ranker(Neighbours, &SIGNATURE));

struct Neighbours;

impl HeuristicFrequencyRank for Neighbours {
    fn rank(&self, byte: u8) -> u8 {
        // the finder takes the two of the lowest rank
        SIGNATURE[..2].iter().position(|&first| first == byte).map_or(u8::MAX, |place| place as u8)
    }
}

/// What was found in a file that the library can be let at: nobody else can make one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Vetted {
    pub(super) file_bytes: u64,
    /// Bytes of the largest object of a heap: no single text is larger.
    pub(super) largest_text: u64,
}

/// Why the library must not be let at a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// An object of a heap collection takes less than its own header.
    SmallObject,
    /// Heap collections take more room than the file has.
    Overlapping,
    /// Lengths of neither 2, 4 nor 8 bytes.
    OddLengths,
}

impl Refusal {
    const ALL: [Self; 3] = [Self::SmallObject, Self::Overlapping, Self::OddLengths];

    /// For people.
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::SmallObject => "damaged: an object of a heap collection of the HDF5 file is smaller than its header",
            Self::Overlapping => "damaged: the heap collections of the HDF5 file lie over one another",
            Self::OddLengths => "damaged: the HDF5 file states lengths of neither 2, 4 nor 8 bytes",
        }
    }
}

/// What a pass through a file found, in a word or two that can be kept.
pub(crate) fn finding_text(finding: &std::result::Result<Vetted, Refusal>) -> String {
    match finding {
        Ok(vetted) => format!("{} {}", vetted.file_bytes, vetted.largest_text),
        Err(refusal) => format!("{refusal:?}"),
    }
}

/// What [`finding_text`] wrote; none if it is something else.
pub(crate) fn parse_finding(text: &str) -> Option<std::result::Result<Vetted, Refusal>> {
    if let Some(refusal) = Refusal::ALL.into_iter().find(|refusal| format!("{refusal:?}") == text) {
        return Some(Err(refusal));
    }
    let (file_bytes, largest_text) = text.split_once(' ')?;
    Some(Ok(Vetted { file_bytes: file_bytes.parse().ok()?, largest_text: largest_text.parse().ok()? }))
}

/// Looks through a whole file. Errors: it cannot be read; the library must not be let at it.
pub(crate) fn vet(path: &Path) -> Result<Vetted> {
    use std::io::Read;
    let io = |error: std::io::Error| StoreError::io("cannot be read", path, &error);
    let mut file = crate::files::open_regular(path).map_err(io)?;
    let mut guard = HeapGuard::new(file.metadata().map_err(io)?.len());
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer).map_err(io)? {
            0 => return guard.finish().map_err(|refusal| StoreError::new(refusal.text()).file(path)),
            count => guard.update(&buffer[..count]),
        }
    }
}

/// Walks a file's heap collections while the file streams by.
#[derive(Debug)]
pub(crate) struct HeapGuard {
    file_bytes: u64,
    /// Bytes that have streamed by, and the last of them.
    streamed: u64,
    tail: Vec<u8>,
    /// Where the file's signature is looked for next; none once it was found.
    signature_at: Option<u64>,
    /// Bytes of a length.
    length_bytes: usize,
    /// The next place of a walk first.
    walks: BinaryHeap<Reverse<Walk>>,
    /// Bytes of all collections.
    claimed: u64,
    largest_text: u64,
    refusal: Option<Refusal>,
}

/// A walk through a collection: where its next header lies, and where it ends (none before its own header was read).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Walk {
    next: u64,
    end: Option<u64>,
}

impl HeapGuard {
    /// For a file of this many bytes.
    pub(crate) fn new(file_bytes: u64) -> Self {
        Self {
            file_bytes,
            streamed: 0,
            tail: Vec::new(),
            signature_at: Some(0),
            length_bytes: 8,
            walks: BinaryHeap::new(),
            claimed: 0,
            largest_text: 0,
            refusal: None,
        }
    }

    /// Takes the next stretch of the file; copies next to nothing of it.
    pub(crate) fn update(&mut self, bytes: &[u8]) {
        let window = Window { begin: self.streamed, tail: &std::mem::take(&mut self.tail), bytes };
        self.look_for_file(&window);
        let last = window.tail.len().saturating_sub(BORDER);
        let border = [&window.tail[last..], &bytes[..bytes.len().min(BORDER)]].concat();
        let before = window.begin - (window.tail.len() - last) as u64;
        self.begin_walks(&border, before);
        self.begin_walks(bytes, window.begin);
        self.walk(&window);
        self.tail = window.last();
        self.streamed = window.end();
    }

    /// Whether the library can be let at the file.
    pub(crate) fn finish(self) -> std::result::Result<Vetted, Refusal> {
        match self.refusal {
            Some(refusal) => Err(refusal),
            None => Ok(Vetted { file_bytes: self.file_bytes, largest_text: self.largest_text }),
        }
    }

    fn refuse(&mut self, refusal: Refusal) {
        self.refusal.get_or_insert(refusal);
        self.walks.clear();
    }

    /// The length of lengths, from the first signature of a file.
    fn look_for_file(&mut self, window: &Window) {
        while let Some(at) = self.signature_at.filter(|at| at + HEADER <= window.end()) {
            let head = window.header(at);
            if !head.starts_with(FILE_SIGNATURE) {
                self.signature_at = Some((2 * at).max(USER_BLOCK));
                continue;
            }
            self.signature_at = None;
            // versions 0 and 1 state four other versions first
            let length = usize::from(if head[8] < 2 { head[14] } else { head[10] });
            if matches!(length, 2 | 4 | 8) {
                self.length_bytes = length;
            } else {
                self.refuse(Refusal::OddLengths);
            }
        }
    }

    fn begin_walks(&mut self, bytes: &[u8], at: u64) {
        if self.refusal.is_none() {
            self.walks
                .extend(FINDER.find_iter(bytes).map(|place| Reverse(Walk { next: at + place as u64, end: None })));
        }
    }

    /// Goes on with every walk as far as the window reaches.
    fn walk(&mut self, window: &Window) {
        while let Some(&Reverse(walk)) = self.walks.peek()
            && walk.next + HEADER <= window.end()
        {
            self.walks.pop();
            if let Some(walk) = self.step(walk, &window.header(walk.next)) {
                self.walks.push(Reverse(walk));
            }
        }
    }

    /// One step, as the library does it; none where it stops.
    fn step(&mut self, walk: Walk, header: &[u8; HEADER as usize]) -> Option<Walk> {
        let length = header[8..8 + self.length_bytes].iter().rev().fold(0, |sum, &byte| sum << 8 | u64::from(byte));
        let Some(end) = walk.end else {
            let end = walk.next.checked_add(length).filter(|&end| length >= SMALLEST && end <= self.file_bytes)?;
            self.claimed = self.claimed.saturating_add(length);
            if self.claimed > self.file_bytes.saturating_mul(MOST_OVERLAP).saturating_add(SPARE) {
                self.refuse(Refusal::Overlapping);
                return None;
            }
            return Some(Walk { next: walk.next + HEADER, end: Some(end) });
        };
        let is_free_space = header[0] == 0 && header[1] == 0;
        // rounded up to multiples of 8, modulo 2^64
        let taken = if is_free_space { length } else { (length.wrapping_add(7) & !7).wrapping_add(HEADER) };
        if taken < HEADER {
            self.refuse(Refusal::SmallObject);
            return None;
        }
        let next = walk.next.checked_add(taken).filter(|&next| next <= end)?;
        if !is_free_space {
            self.largest_text = self.largest_text.max(length);
        }
        // the library takes what is left for free space where no header fits in
        Some(Walk { next, end: walk.end }).filter(|walk| walk.next + HEADER <= end)
    }
}

/// Bytes of a signature before its last.
const BORDER: usize = SIGNATURE.len() - 1;

/// The stretch that streams by, and the end of what came before it.
struct Window<'a> {
    begin: u64,
    tail: &'a [u8],
    bytes: &'a [u8],
}

impl Window<'_> {
    fn end(&self) -> u64 {
        self.begin + self.bytes.len() as u64
    }

    /// The header at a place that lies in the window, with the bytes before it; zeros where it does not.
    fn header(&self, at: u64) -> [u8; HEADER as usize] {
        let start = self.begin - self.tail.len() as u64;
        let mut header = [0; HEADER as usize];
        if let Some(place) = at.checked_sub(self.begin) {
            let found = self.bytes.get(place as usize..).and_then(|bytes| bytes.first_chunk());
            header = found.copied().unwrap_or(header);
        } else if let Some(place) = at.checked_sub(start) {
            let bytes = self.tail.iter().chain(self.bytes).skip(place as usize);
            header.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        }
        header
    }

    /// What the next window needs of this one.
    fn last(&self) -> Vec<u8> {
        let most = HEADER as usize;
        let from_tail = self.tail.len().saturating_sub(most.saturating_sub(self.bytes.len()));
        [&self.tail[from_tail..], &self.bytes[self.bytes.len().saturating_sub(most)..]].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn collection(objects: &[(u16, u64)], size: usize) -> Vec<u8> {
        let mut bytes = SIGNATURE.to_vec();
        bytes.extend((size as u64).to_le_bytes());
        for &(index, size) in objects {
            bytes.extend(index.to_le_bytes());
            bytes.extend([0; 6]);
            bytes.extend(size.to_le_bytes());
            if (1..1 << 32).contains(&size) && index > 0 {
                bytes.resize(bytes.len() + size.div_ceil(8) as usize * 8, b'x');
            }
        }
        bytes.resize(size, 0);
        bytes
    }

    fn looked_at(bytes: &[u8], step: usize) -> std::result::Result<Vetted, Refusal> {
        let mut guard = HeapGuard::new(bytes.len() as u64);
        bytes.chunks(step).for_each(|bytes| guard.update(bytes));
        guard.finish()
    }

    #[test]
    fn what_is_smaller_than_its_header_is_found_wherever_it_lies() {
        let (large, rest) = (600_000_u64, 4096 - 16 - (16 + 8) - (16 + 16));
        let cases = [
            (collection(&[(1, 3), (2, 12), (0, rest)], 4096), Ok(12)),
            (collection(&[(1, 3), (2, 12), (0, 8)], 4096), Err(Refusal::SmallObject)),
            // 2^64 - 8 bytes and their header: the sum overflows
            (collection(&[(1, 3), (2, 8_u64.wrapping_neg())], 4096), Err(Refusal::SmallObject)),
            (collection(&[(1, large), (0, 8)], 700_000), Err(Refusal::SmallObject)),
            (collection(&[(1, large), (0, 700_000 - 16 - 16 - large)], 700_000), Ok(large)),
            (SIGNATURE.to_vec(), Ok(0)),
            ([SIGNATURE.as_slice(), &[0xff; 100]].concat(), Ok(0)),
        ];
        for offset in [0, 1, 77, 70_000] {
            for (bytes, expected) in &cases {
                let around = [vec![0; offset], bytes.clone(), vec![7; 3000]].concat();
                for step in [3, 5000, 1 << 18] {
                    let found = looked_at(&around, step).map(|vetted| vetted.largest_text);
                    assert_eq!(found, *expected, "{offset} {step}");
                }
            }
        }
    }

    #[test]
    fn collections_over_one_another_are_found() {
        let inner = collection(&[(0, 4096 - 16)], 4096);
        let apart = inner.repeat(600);
        assert!(looked_at(&apart, 5000).is_ok());
        // every 16 bytes one begins that ends with the file
        let bytes = 16 * 6000;
        let over: Vec<u8> = (0..6000_u64)
            .flat_map(|index| [SIGNATURE.to_vec(), (bytes - 16 * index).to_le_bytes().to_vec()].concat())
            .collect();
        assert_eq!(looked_at(&over, 5000), Err(Refusal::Overlapping));
    }

    #[test]
    fn lengths_are_as_long_as_the_file_says() {
        let free = collection(&[(0, 0xff_0000_0008)], 4096);
        for (length, at, expected) in
            [(4_u8, 0, Err(Refusal::SmallObject)), (8, 512, Ok(())), (16, 0, Err(Refusal::OddLengths))]
        {
            let mut file = vec![0; at];
            file.extend(FILE_SIGNATURE);
            file.extend([2, 8, length, 0, 0, 0, 0, 0]);
            file.extend(&free);
            assert_eq!(looked_at(&file, 100).map(drop), expected, "{length}");
        }
    }

    #[test]
    fn findings_are_kept_as_text() {
        let vetted = Vetted { file_bytes: 17, largest_text: 4 };
        for finding in [Ok(vetted), Err(Refusal::SmallObject), Err(Refusal::Overlapping), Err(Refusal::OddLengths)] {
            assert_eq!(parse_finding(&finding_text(&finding)), Some(finding));
        }
        assert!(parse_finding("whole").is_none() && parse_finding("1").is_none());
    }
}

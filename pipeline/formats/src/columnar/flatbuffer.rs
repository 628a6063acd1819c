//! Descriptions in FlatBuffers, as Arrow has them.
//!
//! Source: Google, "FlatBuffers internals".

use std::cell::Cell;

/// More tables in a list are no recording.
const MOST_ITEMS: usize = 1 << 16;

/// How often each byte may be read. Distances may lead to one table from many places; a description that is read more
/// often than it has bytes for is made to keep the reader busy.
const MOST_READS: usize = 16;

/// Tables that refer to one another by their distances.
#[derive(Debug)]
pub(crate) struct Buffer<'a> {
    bytes: &'a [u8],
    reads_left: Cell<usize>,
}

impl<'a> Buffer<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, reads_left: Cell::new(1024 + MOST_READS * bytes.len()) }
    }

    fn count_reads(&self, reads: usize) -> Option<()> {
        let left = self.reads_left.get().checked_sub(reads);
        self.reads_left.set(left.unwrap_or(0));
        left.map(|_| ())
    }

    /// Whether it was read more often than may be: what was read last is incomplete.
    pub(crate) fn is_spent(&self) -> bool {
        self.reads_left.get() == 0
    }

    /// A whole number of `N` bytes.
    pub(crate) fn number<const N: usize>(&self, at: usize) -> Option<usize> {
        self.count_reads(1)?;
        let bytes = self.bytes.get(at..at.checked_add(N)?)?;
        Some(bytes.iter().rev().fold(0, |number, &byte| number << 8 | usize::from(byte)))
    }

    /// What the distance at `at` leads to.
    pub(crate) fn follow(&self, at: usize) -> Option<usize> {
        at.checked_add(self.number::<4>(at)?)
    }

    /// Where a table has its field of this number.
    fn field(&self, table: usize, number: usize) -> Option<usize> {
        let back = self.number::<4>(table)? as u32 as i32;
        let list = i64::try_from(table).ok()?.checked_sub(i64::from(back))?;
        let list = usize::try_from(list).ok()?;
        let at = 4 + 2 * number;
        let offset = if at < self.number::<2>(list)? { self.number::<2>(list.checked_add(at)?)? } else { 0 };
        (offset > 0).then_some(table.checked_add(offset)?)
    }

    /// A field that is a whole number of `N` bytes; `unsaid` if it is not written.
    pub(crate) fn whole<const N: usize>(&self, table: usize, number: usize, unsaid: usize) -> usize {
        self.field(table, number).and_then(|at| self.number::<N>(at)).unwrap_or(unsaid)
    }

    /// A field that is a table, a text or a list.
    pub(crate) fn inner(&self, table: usize, number: usize) -> Option<usize> {
        self.follow(self.field(table, number)?)
    }

    pub(crate) fn text(&self, table: usize, number: usize) -> Option<String> {
        let at = self.inner(table, number)?;
        let (from, length) = (at.checked_add(4)?, self.number::<4>(at)?);
        self.count_reads(length)?;
        let bytes = self.bytes.get(from..from.checked_add(length)?)?;
        Some(String::from_utf8_lossy(bytes).into_owned())
    }

    /// The tables of a list of tables; none if it is not written. None: damaged, or too many.
    pub(crate) fn items(&self, table: usize, number: usize) -> Option<Vec<usize>> {
        let Some((first, count)) = self.structs(table, number, 4) else {
            return self.field(table, number).is_none().then(Vec::new);
        };
        (0..count.min(MOST_ITEMS + 1))
            .map(|item| self.follow(first + 4 * item))
            .collect::<Option<Vec<_>>>()
            .filter(|items| items.len() <= MOST_ITEMS)
    }

    /// Where a list of structs of `bytes` each begins, and how many there are. None: not written, or cut off.
    pub(crate) fn structs(&self, table: usize, number: usize, bytes: usize) -> Option<(usize, usize)> {
        let at = self.inner(table, number)?;
        let (first, count) = (at.checked_add(4)?, self.number::<4>(at)?);
        let end = first.checked_add(count.checked_mul(bytes)?)?;
        (end <= self.bytes.len()).then_some((first, count))
    }

    /// Pairs of a name and a text.
    pub(crate) fn pairs(&self, table: usize, number: usize) -> Vec<(String, String)> {
        let pairs = self.items(table, number).unwrap_or_default();
        pairs.into_iter().filter_map(|pair| Some((self.text(pair, 0)?, self.text(pair, 1)?))).collect()
    }
}

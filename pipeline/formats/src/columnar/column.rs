//! The samples of a column.

use super::What;
use crate::number::Number;
use crate::pinned::stretch_end;
use crate::{FormatError, Raw, Source};
use std::sync::{Arc, Mutex, PoisonError};

/// Least number of samples that are read at once, however short the groups are.
const LEAST_PREFERRED: usize = 1 << 16;

/// Values of some rows.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Values {
    /// Those that are there, in little-endian order.
    pub(crate) bytes: Vec<u8>,
    /// Which rows have one.
    pub(crate) there: Vec<bool>,
}

/// Where the values of a column are, group of rows by group of rows.
pub(crate) trait Groups: std::fmt::Debug + Send + Sync {
    /// All values of a group. Errors: damaged; the file was changed.
    fn values(&self, group: usize) -> Result<Values, FormatError>;

    /// Those of the rows from `from` to before `to`, of groups of which any stretch costs what its bytes cost. None:
    /// the group has to be read whole.
    fn stretch(&self, _group: usize, _from: usize, _to: usize) -> Option<Result<Values, FormatError>> {
        None
    }

    /// Whether all groups are of that kind.
    fn is_direct(&self) -> bool {
        false
    }
}

/// A column of numbers. Of its groups the one that was read whole last is kept.
#[derive(Debug)]
pub(crate) struct Column<G> {
    groups: G,
    number: Number,
    what: What,
    /// Whether any value may be missing.
    may_miss: bool,
    /// The row behind the last of each group.
    ends: Vec<usize>,
    /// The moment that is time 0.
    origin: i64,
    kept: Mutex<Option<(usize, Arc<Raw>)>>,
}

impl<G: Groups> Column<G> {
    /// The groups have so many rows, which are no more in all than can be counted.
    pub(crate) fn new(groups: G, number: Number, what: What, may_miss: bool, rows: &[u64]) -> Self {
        let ends = rows.iter().scan(0, |end, rows| {
            *end += *rows as usize;
            Some(*end)
        });
        Self { groups, number, what, may_miss, ends: ends.collect(), origin: 0, kept: Mutex::new(None) }
    }

    /// Counts moments from the first, and gives it; none if it is missing. Errors: damaged.
    pub(crate) fn begin(&mut self) -> Result<Option<i64>, FormatError> {
        let Some(group) = self.ends.iter().position(|end| *end > 0) else { return Ok(None) };
        let values = self.groups.stretch(group, 0, 1).unwrap_or_else(|| self.groups.values(group))?;
        let there = values.there.first().copied().unwrap_or(false);
        let first = values.bytes.first_chunk().filter(|_| there).map(|bytes| i64::from_le_bytes(*bytes));
        self.origin = first.unwrap_or(0);
        Ok(first)
    }

    /// Samples of a group, from one of its rows to before another.
    fn part(&self, group: usize, from: usize, to: usize) -> Result<Raw, FormatError> {
        if let Some(values) = self.groups.stretch(group, from, to) {
            return values.map(|values| self.samples_of(&values));
        }
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, raw)) = kept().as_ref()
            && *known == group
        {
            return Ok(cut_out(raw, from, to));
        }
        let raw = Arc::new(self.samples_of(&self.groups.values(group)?));
        *kept() = Some((group, Arc::clone(&raw)));
        Ok(cut_out(&raw, from, to))
    }

    /// Missing values are NaN. A column that may have some is of floating point numbers throughout.
    fn samples_of(&self, values: &Values) -> Raw {
        let stored = match self.what {
            What::Moments { .. } => {
                let since = |bytes: &[u8; 8]| i64::from_le_bytes(*bytes).wrapping_sub(self.origin) as f64;
                Raw::Float64(values.bytes.as_chunks().0.iter().map(since).collect())
            }
            _ => self.number.decode(&values.bytes, false),
        };
        match stored {
            _ if !self.may_miss => stored,
            Raw::Float32(stored) => Raw::Float32(spread(stored, &values.there, f32::NAN)),
            stored => Raw::Float64(spread(stored.widened(), &values.there, f64::NAN)),
        }
    }

    fn largest_group(&self) -> usize {
        let firsts = [0].iter().chain(&self.ends);
        firsts.zip(&self.ends).map(|(first, end)| end - first).max().unwrap_or(0)
    }
}

/// Values at the rows that have one.
fn spread<T: Copy>(values: Vec<T>, there: &[bool], missing: T) -> Vec<T> {
    let mut values = values.into_iter();
    there.iter().map(|there| if *there { values.next().unwrap_or(missing) } else { missing }).collect()
}

/// A stretch of samples.
fn cut_out(raw: &Raw, from: usize, to: usize) -> Raw {
    fn cut<T: Copy>(values: &[T], from: usize, to: usize) -> Vec<T> {
        values.get(from..to.min(values.len())).unwrap_or_default().to_vec()
    }
    match raw {
        Raw::Int16(values) => Raw::Int16(cut(values, from, to)),
        Raw::Int32(values) => Raw::Int32(cut(values, from, to)),
        Raw::Float32(values) => Raw::Float32(cut(values, from, to)),
        Raw::Float64(values) => Raw::Float64(cut(values, from, to)),
    }
}

impl<G: Groups> Source for Column<G> {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        let end = stretch_end(start, count, self.ends.last().copied().unwrap_or(0))?;
        let mut found: Option<Raw> = None;
        let first_group = self.ends.partition_point(|group_end| *group_end <= start);
        let mut first = first_group.checked_sub(1).and_then(|before| self.ends.get(before)).copied().unwrap_or(0);
        for (group, group_end) in self.ends.iter().copied().enumerate().skip(first_group) {
            let (from, to) = (start.max(first), end.min(group_end));
            if first >= end {
                break;
            }
            if from < to {
                let here = self.part(group, from - first, to - first)?;
                found = Some(match found {
                    Some(before) => before.followed_by(here),
                    None => here,
                });
            }
            first = group_end;
        }
        Ok(found.unwrap_or_else(|| self.samples_of(&Values::default())))
    }

    fn preferred_samples(&self) -> usize {
        if self.groups.is_direct() { LEAST_PREFERRED } else { self.largest_group().max(LEAST_PREFERRED) }
    }

    fn kept_bytes(&self) -> u64 {
        if self.groups.is_direct() { 0 } else { 8 * self.largest_group() as u64 }
    }

    fn is_direct(&self) -> bool {
        self.groups.is_direct()
    }
}

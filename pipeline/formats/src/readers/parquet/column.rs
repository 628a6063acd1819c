//! The samples of a column.

use super::footer::{Chunk, What};
use super::pages::{Reading, Values};
use crate::budget::most_inflated;
use crate::number::Number;
use crate::pinned::{Pinned, read_at, stretch_end};
use crate::{FormatError, Raw, Source, fail};
use std::sync::{Arc, Mutex, PoisonError};

/// A column of numbers. Of its row groups the one that was read last is kept.
#[derive(Debug)]
pub(super) struct Column {
    pub(super) file: Pinned,
    pub(super) name: String,
    pub(super) number: Number,
    pub(super) what: What,
    /// In how many ways a value may be missing.
    pub(super) optional: u32,
    pub(super) chunks: Vec<Chunk>,
    pub(super) samples: usize,
    /// The moment that is time 0.
    pub(super) origin: i64,
    pub(super) kept: Mutex<Option<(usize, Arc<Raw>)>>,
}

impl Column {
    /// The first moment of the column; none if it is missing. Errors: damaged.
    pub(super) fn first_moment(&self) -> Result<Option<i64>, FormatError> {
        let first = self.chunks.iter().position(|chunk| chunk.rows > 0);
        let Some(values) = first.map(|number| self.values(number)).transpose()? else { return Ok(None) };
        let there = values.there.first().copied().unwrap_or(false);
        Ok(values.bytes.first_chunk().filter(|_| there).map(|bytes| i64::from_le_bytes(*bytes)))
    }

    /// Errors: damaged; the file was changed.
    fn values(&self, number: usize) -> Result<Values, FormatError> {
        let wrong = |at, problem: String| fail::at(at, format!("{}: {problem}", self.name), fail::COPY_AGAIN);
        let chunk = self.chunks.get(number).ok_or_else(|| wrong(0, "a row group is missing".to_owned()))?;
        let codec = chunk.codec.map_err(|name| wrong(chunk.at, format!("it is packed with {name}")))?;
        let mut bytes = vec![0; chunk.bytes as usize];
        read_at(&self.file.reopen()?, chunk.at, &mut bytes)?;
        let most_bytes = most_inflated(self.file.bytes());
        let reading = Reading { number: self.number, optional: self.optional, codec, most_bytes };
        reading.values(&bytes, chunk).map_err(|problem| wrong(chunk.at, problem))
    }

    /// The samples of a row group.
    fn group(&self, number: usize) -> Result<Arc<Raw>, FormatError> {
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, raw)) = kept().as_ref()
            && *known == number
        {
            return Ok(Arc::clone(raw));
        }
        let raw = Arc::new(self.samples_of(&self.values(number)?));
        *kept() = Some((number, Arc::clone(&raw)));
        Ok(raw)
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
            _ if self.optional == 0 => stored,
            Raw::Float32(stored) => Raw::Float32(spread(stored, &values.there, f32::NAN)),
            stored => Raw::Float64(spread(stored.widened(), &values.there, f64::NAN)),
        }
    }
}

/// Values at the rows that have one.
fn spread<T: Copy>(values: Vec<T>, there: &[bool], missing: T) -> Vec<T> {
    let mut values = values.into_iter();
    there.iter().map(|there| if *there { values.next().unwrap_or(missing) } else { missing }).collect()
}

/// A stretch of samples.
fn part(raw: &Raw, from: usize, to: usize) -> Raw {
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

impl Source for Column {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        let end = stretch_end(start, count, self.samples)?;
        let mut found: Option<Raw> = None;
        let mut first = 0;
        for (number, chunk) in self.chunks.iter().enumerate() {
            let rows = chunk.rows as usize;
            let (from, to) = (start.max(first), end.min(first + rows));
            if from < to {
                let here = part(&*self.group(number)?, from - first, to - first);
                found = Some(match found {
                    Some(before) => before.followed_by(here),
                    None => here,
                });
            }
            first += rows;
        }
        Ok(found.unwrap_or_else(|| self.samples_of(&Values::default())))
    }

    fn preferred_samples(&self) -> usize {
        self.chunks.iter().map(|chunk| chunk.rows as usize).max().unwrap_or(1).max(1)
    }

    fn kept_bytes(&self) -> u64 {
        8 * self.preferred_samples() as u64
    }
}

//! Tall columns, side by side: regressors and sensitivities.
//!
//! The second column of a section is its first one row later. Where one record fills all rows, both are the same
//! numbers, seen from two places: half to write, half to read.

use std::sync::{Arc, Mutex};

use faer::{Mat, MatRef};

use crate::model::Coefficients;

/// What lies side by side.
#[derive(Debug, Clone, Copy)]
pub(super) enum Part {
    /// So many columns of sections, two for each, one for a last one of first order.
    Sections(usize),
    /// So many columns that have nothing in common.
    Single(usize),
}

/// Columns of equal length.
pub(crate) struct Columns {
    storage: Vec<f64>,
    /// Where each begins.
    starts: Vec<usize>,
    rows: usize,
    buffers: BufferPool,
}

impl Columns {
    /// With any contents, to be overwritten: but for those of several records, which are zeros.
    ///
    /// `records`: how many lie one after the other in the rows.
    pub fn new(rows: usize, parts: &[Part], records: usize, buffers: &BufferPool) -> Self {
        let (mut starts, mut end, overlapping) = (Vec::new(), 0, records == 1);
        for part in parts {
            match *part {
                Part::Sections(count) if overlapping => {
                    for column in 0..count {
                        // a row more, before the first
                        let line = end + column / 2 * (rows + 1);
                        starts.push(if column % 2 == 0 { line + 1 } else { line });
                    }
                    end += count.div_ceil(2) * (rows + 1);
                }
                Part::Sections(count) | Part::Single(count) => {
                    starts.extend((0..count).map(|column| end + column * rows));
                    end += count * rows;
                }
            }
        }
        let mut storage = buffers.take(end);
        if !overlapping {
            storage.fill(0.0);
        }
        Self { storage, starts, rows, buffers: buffers.clone() }
    }

    /// How many columns.
    pub fn count(&self) -> usize {
        self.starts.len()
    }

    /// One column.
    pub fn column(&self, index: usize) -> &[f64] {
        &self.storage[self.starts[index]..][..self.rows]
    }

    /// All columns.
    pub fn slices(&self) -> Vec<&[f64]> {
        (0..self.count()).map(|index| self.column(index)).collect()
    }

    /// One column, to be written. Not of those that overlap: these are a section's response.
    pub fn single_mut(&mut self, index: usize) -> &mut [f64] {
        &mut self.storage[self.starts[index]..][..self.rows]
    }

    /// A column and the next, to be written. As [`Self::single_mut`].
    pub fn two_mut(&mut self, index: usize) -> (&mut [f64], &mut [f64]) {
        let (first, second) = (self.starts[index], self.starts[index + 1]);
        let (before, after) = self.storage.split_at_mut(second);
        (&mut before[first..][..self.rows], &mut after[..self.rows])
    }

    /// As a matrix of its own.
    pub fn to_mat(&self) -> Mat<f64> {
        let mut matrix = Mat::zeros(self.rows, self.count());
        for (index, column) in self.slices().into_iter().enumerate() {
            matrix.col_mut(index).copy_from(MatRef::from_column_major_slice(column, self.rows, 1).col(0));
        }
        matrix
    }

    /// The same with some rows cleared, nothing overlapping.
    pub fn without_rows(&self, rows: &[usize]) -> Self {
        let mut all = Self::new(self.rows, &[Part::Single(self.count())], 1, &self.buffers);
        for (index, column) in self.slices().into_iter().enumerate() {
            all.single_mut(index).copy_from_slice(column);
        }
        all.clear_rows(rows);
        all
    }

    /// Clears some rows. Not where columns overlap.
    pub fn clear_rows(&mut self, rows: &[usize]) {
        for index in 0..self.count() {
            let column = self.single_mut(index);
            rows.iter().for_each(|&row| column[row] = 0.0);
        }
    }

    /// A signal for each of up to [`SIDE_BY_SIDE`] sections, through `1 / a`, into the rows of one record: `signals`
    /// writes those from a row on.
    pub fn respond(
        &mut self,
        place: Place,
        sections: &[Coefficients],
        mut signals: impl FnMut(usize, &mut [[f64; SIDE_BY_SIDE]]),
    ) {
        let Place { top, length, column, width, delay } = place;
        let mut bank = Bank::new(sections);
        let mut chunk = [[0.0; SIDE_BY_SIDE]; CHUNK];
        let firsts: Vec<usize> = (0..sections.len()).map(|i| self.starts[column + 2 * i] + top).collect();
        firsts.iter().for_each(|&first| self.storage[first..first + delay.min(length)].fill(0.0));
        for start in (0..length).step_by(CHUNK) {
            let chunk = &mut chunk[..CHUNK.min(length - start)];
            signals(start, chunk);
            bank.run(chunk);
            let kept = chunk.len().min((length - start).saturating_sub(delay));
            for (i, first) in firsts.iter().enumerate() {
                let target = &mut self.storage[first + delay + start..][..kept];
                target.iter_mut().zip(&*chunk).for_each(|(t, y)| *t = y[i]);
            }
        }
        for (i, &first) in firsts.iter().enumerate().take(width / 2) {
            let second = self.starts[column + 2 * i + 1] + top;
            self.storage[second] = 0.0;
            // unless it is the same numbers
            if second + 1 != first {
                self.storage.copy_within(first..first + length - 1, second + 1);
            }
        }
    }
}

/// Where the responses of sections to their signals go: two columns for each, one for a last one of first order.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// First row.
    pub top: usize,
    /// Rows.
    pub length: usize,
    /// First column.
    pub column: usize,
    /// How many columns.
    pub width: usize,
    /// Rows by which the first column of each section is late; the second is one row later.
    pub delay: usize,
}

impl Place {
    /// For the sections of group `index`.
    pub fn group(self, index: usize) -> Self {
        let first = 2 * SIDE_BY_SIDE * index;
        Self { column: self.column + first, width: (self.width - first).min(2 * SIDE_BY_SIDE), ..self }
    }
}

/// Sections filtered side by side, for the processor's vector units.
pub(super) const SIDE_BY_SIDE: usize = 8;
/// Samples at a time: they stay in the first-level cache.
const CHUNK: usize = 128;

/// `1 / a` of several sections.
struct Bank {
    a: [[f64; SIDE_BY_SIDE]; 2],
    past: [[f64; SIDE_BY_SIDE]; 2],
}

impl Bank {
    fn new(sections: &[Coefficients]) -> Self {
        let mut a = [[0.0; SIDE_BY_SIDE]; 2];
        sections.iter().enumerate().for_each(|(i, own)| (a[0][i], a[1][i]) = (own[0], own[1]));
        Self { a, past: [[0.0; SIDE_BY_SIDE]; 2] }
    }

    /// Filters the next samples of each section's own signal in place.
    fn run(&mut self, signals: &mut [[f64; SIDE_BY_SIDE]]) {
        let [mut y1, mut y2] = self.past;
        for signal in signals {
            let mut y = [0.0; SIDE_BY_SIDE];
            for i in 0..SIDE_BY_SIDE {
                y[i] = (signal[i] - self.a[1][i] * y2[i]) - self.a[0][i] * y1[i];
            }
            (y2, y1) = (y1, y);
            *signal = y;
        }
        self.past = [y1, y2];
    }
}

/// Most storages in a pool, and the largest of them in numbers.
const SPARE: usize = 4;
const LARGEST: usize = 1 << 19;

/// Storage of columns that are no longer used, kept for the next ones: an iteration makes and drops as many as it has
/// steps, and the system clears the pages that it hands out. Clones share it.
#[derive(Debug, Clone, Default)]
pub(crate) struct BufferPool(Arc<Mutex<Vec<Vec<f64>>>>);

impl BufferPool {
    /// So many numbers, any.
    fn take(&self, count: usize) -> Vec<f64> {
        let found = self.0.lock().ok().and_then(|mut buffers| {
            let index = buffers.iter().position(|storage| storage.capacity() >= count)?;
            Some(buffers.swap_remove(index))
        });
        let mut storage = found.unwrap_or_default();
        storage.resize(count, 0.0);
        storage
    }

    fn put(&self, storage: Vec<f64>) {
        if storage.capacity() > LARGEST {
            return;
        }
        // nothing is lost in a pool that cannot be used
        if let Ok(mut buffers) = self.0.lock() {
            buffers.push(storage);
            if buffers.len() > SPARE {
                buffers.swap_remove(0);
            }
        }
    }
}

impl Drop for Columns {
    fn drop(&mut self) {
        self.buffers.put(std::mem::take(&mut self.storage));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_a_section_are_a_row_apart_whether_they_overlap_or_not() {
        let (rows, sections) = (300, [[-1.2, 0.5], [-0.9, 0.0]]);
        let signal = |k: usize| (k * 7919 % 13) as f64 - 6.0;
        let buffers = BufferPool::default();
        for delay in [0, 1] {
            let columns = |records: usize| {
                let mut columns = Columns::new(rows, &[Part::Sections(3), Part::Single(1)], records, &buffers);
                let place = Place { top: 0, length: rows, column: 0, width: 3, delay };
                columns.respond(place, &sections, |start, chunk| {
                    chunk.iter_mut().enumerate().for_each(|(k, x)| *x = [signal(start + k); SIDE_BY_SIDE]);
                });
                columns.single_mut(3).fill(7.0);
                columns
            };
            // storage that has been used before
            drop(columns(1));
            let (one, many) = (columns(1), columns(2));
            assert_eq!(one.to_mat(), many.to_mat());
            let (mut y1, mut y2) = (0.0, 0.0);
            for k in 0..rows - delay {
                let y = (signal(k) - 0.5 * y2) + 1.2 * y1;
                (y2, y1) = (y1, y);
                assert_eq!(one.column(0)[k + delay], y);
            }
            assert_eq!(&one.column(1)[1..], &one.column(0)[..rows - 1]);
            assert_eq!((one.column(1)[0], one.column(0)[0] == 0.0), (0.0, delay == 1));
            let cleared = one.without_rows(&[5, 299]);
            for index in 0..4 {
                let (left, all) = (cleared.column(index), one.column(index));
                assert!((0..rows).all(|k| left[k] == if [5, 299].contains(&k) { 0.0 } else { all[k] }));
            }
        }
    }
}

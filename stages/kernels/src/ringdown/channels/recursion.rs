//! White records without gaps: their triangle by doubling, one product of each record with short exponentials.

use faer::{Mat, MatRef, c64};

use super::basis::{Poles, columns, own_count};
use crate::linear_algebra::{TallQr, dot_in_lanes, product};

/// Samples of a block: its exponentials serve all blocks.
const BLOCK: usize = 128;
/// Blocks from which on this takes less time than the triangle of all rows.
const WORTHWHILE: usize = 4;

/// The basis of one length of record at some poles.
pub(super) struct Recursion<'a> {
    poles: &'a Poles,
    interval_s: f64,
    unit_s: f64,
    samples: usize,
    drift: bool,
    /// Samples before the first whole block.
    head: usize,
    /// Columns of a block from sample 0 on: own amplitudes of modes, 1, the changes' columns, the sample's number.
    block: Mat<f64>,
    /// The first of these rows with the record's own ramp, as many as stand before the first whole block.
    begin: Mat<f64>,
    /// Upper triangle of all columns.
    triangle: Mat<f64>,
}

impl<'a> Recursion<'a> {
    /// Whether records of this length are worth it.
    pub fn pays(samples: usize) -> bool {
        samples >= WORTHWHILE * BLOCK
    }

    /// # Method
    /// Columns some samples later are the same columns times a small matrix ([`Self::shifted`]), so the triangle of 2n
    /// rows is that of the triangle of n rows over its shifted self: `log2(N)` triangles instead of N rows.
    pub fn of(poles: &'a Poles, interval_s: f64, unit_s: f64, samples: usize, drift: bool) -> Self {
        let modes = poles.0.len();
        let mut all = columns(poles, interval_s, unit_s, BLOCK, false);
        all.push((0..BLOCK).map(|k| k as f64).collect());
        let block = Mat::from_fn(BLOCK, all.len(), |i, j| all[j][i]);
        let head = samples % BLOCK;
        let width = own_count(modes, drift) + 2 * modes;
        let mut it =
            Self { poles, interval_s, unit_s, samples, drift, head, block, begin: Mat::new(), triangle: Mat::new() };
        let rows = it.rows(width);
        it.begin = rows.get(..head, ..).to_owned();
        it.triangle = it.doubled(&rows);
        it
    }

    fn doubled(&self, rows: &Mat<f64>) -> Mat<f64> {
        let mut total = match self.head {
            0 => Mat::zeros(rows.ncols(), rows.ncols()),
            _ => TallQr::triangle(self.begin.as_ref()),
        };
        let mut counted = self.head;
        let (mut part, mut size) = (TallQr::triangle(rows.as_ref()), BLOCK);
        while counted < self.samples {
            if (self.samples - self.head) & size != 0 {
                total = stacked(total, self.shifted(&part, counted));
                counted += size;
            }
            if counted < self.samples {
                let later = self.shifted(&part, size);
                part = stacked(part, later);
                size *= 2;
            }
        }
        total
    }

    fn centre(&self) -> f64 {
        0.5 * (self.samples.max(2) - 1) as f64
    }

    /// Rows of the first block with the record's own ramp.
    fn rows(&self, width: usize) -> Mat<f64> {
        let own = 2 * self.poles.0.len() + 1;
        let centre = self.centre();
        Mat::from_fn(BLOCK, width, |i, j| match j {
            _ if j < own => self.block[(i, j)],
            _ if self.drift && j == own => (i as f64 - centre) / centre,
            _ => self.block[(i, j - usize::from(self.drift))],
        })
    }

    /// Factor of a mode over so many samples.
    fn factor(&self, mode: usize, samples: usize) -> c64 {
        (self.poles.0[mode] * (self.interval_s * samples as f64)).exp()
    }

    /// Columns `by` samples later: those of a mode turn and shrink, the ramp rises.
    fn shifted(&self, triangle: &Mat<f64>, by: usize) -> Mat<f64> {
        let modes = self.poles.0.len();
        let own = own_count(modes, self.drift);
        let later_s = by as f64 * self.interval_s / self.unit_s;
        let mut out = triangle.clone();
        for j in 0..modes {
            let w = self.factor(j, by);
            for i in 0..triangle.nrows() {
                let (a, b) = (triangle[(i, 2 * j)], triangle[(i, 2 * j + 1)]);
                let (c, d) = (triangle[(i, own + 2 * j)] + later_s * a, triangle[(i, own + 2 * j + 1)] + later_s * b);
                (out[(i, 2 * j)], out[(i, 2 * j + 1)]) = (a * w.re + b * w.im, b * w.re - a * w.im);
                (out[(i, own + 2 * j)], out[(i, own + 2 * j + 1)]) = (c * w.re + d * w.im, d * w.re - c * w.im);
            }
        }
        if self.drift {
            let rise = by as f64 / self.centre();
            (0..triangle.nrows()).for_each(|i| out[(i, 2 * modes + 1)] += rise * triangle[(i, 2 * modes)]);
        }
        out
    }

    /// Upper triangle of the columns.
    pub fn triangle(&self) -> &Mat<f64> {
        &self.triangle
    }

    /// A record's share along the orthonormal columns, and the root of the energy outside of them; none where it would be
    /// a difference of large numbers.
    ///
    /// # Method
    /// Semi-normal equations, corrected once: amplitudes first, then what they leave. Where columns are nearly alike (a
    /// pole next to zero beside offset and slope) the amplitudes are rounding, and what they leave is larger than the
    /// record.
    /// # Source
    /// A. Bjorck, Linear Algebra Appl. 88/89 (1987) 31.
    pub fn along(&self, signal: &[f64]) -> Option<(Vec<f64>, f64)> {
        let own = own_count(self.poles.0.len(), self.drift);
        if (0..self.triangle.ncols()).any(|j| self.is_rounding(j)) {
            return None;
        }
        let first = self.forward(&self.products(signal));
        let mut amplitudes = first[..own].to_vec();
        self.backward(&mut amplitudes);
        let left = self.left(signal, &amplitudes);
        let rest = self.forward(&self.products(&left));
        let square = |values: &[f64]| dot_in_lanes(values, values);
        let (all, own_left) = (square(signal), square(&left));
        let energy = own_left - square(&rest);
        // least squares leave no more than there is
        if energy.is_nan() || own_left > 2.0 * all || energy < CANCELLED * own_left {
            return None;
        }
        let r = &self.triangle;
        let fitted = |i: usize| if i < own { (i..own).map(|k| r[(i, k)] * amplitudes[k]).sum() } else { 0.0 };
        Some(((0..rest.len()).map(|i| fitted(i) + rest[i]).collect(), energy.sqrt()))
    }

    fn tail<'b>(&self, signal: &'b [f64]) -> MatRef<'b, f64> {
        let tail = &signal[self.head..];
        MatRef::from_column_major_slice(tail, BLOCK, tail.len() / BLOCK)
    }

    /// Products of all columns with a record.
    fn products(&self, signal: &[f64]) -> Vec<f64> {
        let modes = self.poles.0.len();
        let (own, plain) = (own_count(modes, self.drift), 2 * modes + 1);
        let begin = &self.begin;
        let mut out: Vec<f64> =
            (0..begin.ncols()).map(|j| (0..self.head).map(|k| begin[(k, j)] * signal[k]).sum()).collect();
        let inner = product(self.block.transpose(), self.tail(signal));
        let first_s = |b: usize| (self.head + b * BLOCK) as f64 * self.interval_s / self.unit_s;
        for j in 0..modes {
            let (mut w, step) = (self.factor(j, self.head), self.factor(j, BLOCK));
            for b in 0..inner.ncols() {
                let later_s = first_s(b);
                let (u, v) = (inner[(2 * j, b)], inner[(2 * j + 1, b)]);
                let (c, d) = (inner[(plain + 2 * j, b)] + later_s * u, inner[(plain + 2 * j + 1, b)] + later_s * v);
                out[2 * j] += u * w.re + v * w.im;
                out[2 * j + 1] += v * w.re - u * w.im;
                out[own + 2 * j] += c * w.re + d * w.im;
                out[own + 2 * j + 1] += d * w.re - c * w.im;
                w *= step;
                if w.norm_sqr() < 1e-200 {
                    break;
                }
            }
        }
        let (one, number, centre) = (2 * modes, inner.nrows() - 1, self.centre());
        for b in 0..inner.ncols() {
            out[one] += inner[(one, b)];
            if self.drift {
                let first = (self.head + b * BLOCK) as f64;
                out[one + 1] += (inner[(number, b)] + (first - centre) * inner[(one, b)]) / centre;
            }
        }
        out
    }

    /// What own amplitudes leave of a record.
    fn left(&self, signal: &[f64], amplitudes: &[f64]) -> Vec<f64> {
        let modes = self.poles.0.len();
        let (one, centre) = (2 * modes, self.centre());
        let slope = if self.drift { amplitudes[one + 1] / centre } else { 0.0 };
        let tail = self.tail(signal);
        // amplitudes of each block's own columns: modes, 1, number
        let mut shares = Mat::<f64>::zeros(one + 2, tail.ncols());
        for j in 0..modes {
            let (mut w, step) = (self.factor(j, self.head), self.factor(j, BLOCK));
            let (p, q) = (amplitudes[2 * j], amplitudes[2 * j + 1]);
            for b in 0..tail.ncols() {
                (shares[(2 * j, b)], shares[(2 * j + 1, b)]) = (p * w.re - q * w.im, p * w.im + q * w.re);
                w *= step;
                if w.norm_sqr() < 1e-200 {
                    break;
                }
            }
        }
        for b in 0..tail.ncols() {
            shares[(one, b)] = amplitudes[one] + slope * ((self.head + b * BLOCK) as f64 - centre);
            shares[(one + 1, b)] = slope;
        }
        let number = self.block.ncols() - 1;
        let plain = Mat::from_fn(BLOCK, one + 2, |i, j| self.block[(i, if j <= one { j } else { number })]);
        let fitted = product(plain.as_ref(), shares.as_ref());
        let begin = &self.begin;
        let mut left = signal.to_vec();
        for (j, a) in amplitudes.iter().enumerate() {
            left.iter_mut().take(self.head).enumerate().for_each(|(k, y)| *y -= a * begin[(k, j)]);
        }
        for (own, fitted) in left[self.head..].chunks_exact_mut(BLOCK).zip(fitted.col_iter()) {
            own.iter_mut().zip(fitted.iter()).for_each(|(y, f)| *y -= f);
        }
        left
    }

    /// Whether a column is the others' but for rounding.
    fn is_rounding(&self, column: usize) -> bool {
        let r = &self.triangle;
        let length = (0..=column).map(|i| r[(i, column)] * r[(i, column)]).sum::<f64>().sqrt();
        r[(column, column)].abs() <= ROUNDING * length
    }

    /// Solves with the transposed triangle; a column of rounding alone gets nothing.
    fn forward(&self, products: &[f64]) -> Vec<f64> {
        let r = &self.triangle;
        let mut out = vec![0.0; products.len()];
        for j in 0..out.len() {
            let (mut left, mut length) = (products[j], r[(j, j)] * r[(j, j)]);
            for i in 0..j {
                left -= r[(i, j)] * out[i];
                length += r[(i, j)] * r[(i, j)];
            }
            out[j] = if r[(j, j)].abs() > ROUNDING * length.sqrt() { left / r[(j, j)] } else { 0.0 };
        }
        out
    }

    /// Solves with the leading triangle in place.
    fn backward(&self, x: &mut [f64]) {
        let r = &self.triangle;
        for i in (0..x.len()).rev() {
            let known: f64 = (i + 1..x.len()).map(|k| r[(i, k)] * x[k]).sum();
            let length: f64 = (0..=i).map(|k| r[(k, i)] * r[(k, i)]).sum::<f64>().sqrt();
            x[i] = if r[(i, i)].abs() > ROUNDING * length { (x[i] - known) / r[(i, i)] } else { 0.0 };
        }
    }
}

/// Share of a column that is rounding alone: the triangle's is some hundred times the last bit.
const ROUNDING: f64 = 1e-13;
/// Share of an energy below which a difference from it is known to less than a millionth.
const CANCELLED: f64 = 1e-9;

/// Triangle of a triangle above another one that was [`Recursion::shifted`], by reflections that know where both are zero:
/// turned columns have one entry below the diagonal.
fn stacked(mut upper: Mat<f64>, mut lower: Mat<f64>) -> Mat<f64> {
    let n = upper.nrows();
    for j in 0..n {
        let rows = (j + 2).min(n);
        let below = dot_in_lanes(&lower.col_as_slice(j)[..rows], &lower.col_as_slice(j)[..rows]);
        if below == 0.0 {
            continue;
        }
        let head = upper[(j, j)];
        let length = head.hypot(below.sqrt());
        // away from the head, so that nothing cancels
        let first = head + if head < 0.0 { -length } else { length };
        let factor = 2.0 / (first * first + below);
        upper[(j, j)] = if head < 0.0 { length } else { -length };
        let (done, rest) = lower.as_mut().split_at_col_mut(j + 1);
        let reflector = done.as_ref().col(j).try_as_col_major().map_or(&[][..], |column| &column.as_slice()[..rows]);
        for (k, column) in rest.col_iter_mut().enumerate() {
            let Some(column) = column.try_as_col_major_mut() else { continue };
            let column = &mut column.as_slice_mut()[..rows];
            let along = factor * (first * upper[(j, j + 1 + k)] + dot_in_lanes(reflector, column));
            upper[(j, j + 1 + k)] -= along * first;
            column.iter_mut().zip(reflector).for_each(|(value, own)| *value -= along * own);
        }
    }
    upper
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_triangle_by_doubling_is_that_of_all_rows() {
        let poles = Poles(vec![c64::new(-3.0, 400.0), c64::new(-3.2, 401.0), c64::new(-200.0, 900.0)]);
        for (samples, drift) in [(512, true), (1000, false), (5001, true)] {
            let fast = Recursion::of(&poles, 2e-4, 0.3, samples, drift);
            let all = columns(&poles, 2e-4, 0.3, samples, drift);
            let y = white_noise(samples, 1.0, 4);
            let width = all.len();
            let rows = Mat::from_fn(samples, width + 1, |i, j| {
                if j < width { all[j][i] } else { y[i] + 1e4 * all[0][i] - 3e3 * all[3][i] + 10.0 }
            });
            let signal: Vec<f64> = (0..samples).map(|i| rows[(i, width)]).collect();
            let slow = TallQr::triangle(rows.as_ref());
            let (along, outside) = fast.along(&signal).unwrap();
            for i in 0..width {
                let sign = (slow[(i, i)] * fast.triangle()[(i, i)]).signum();
                for j in i..width {
                    let scale = (0..=j).map(|k| slow[(k, j)].powi(2)).sum::<f64>().sqrt();
                    let error = (slow[(i, j)] - sign * fast.triangle()[(i, j)]).abs();
                    // rounding of orthogonal triangles, 1e-15 of a column, and of N turns of the exponentials, 1e-12;
                    // two poles a tenth of their distance in common raise it a hundred times
                    assert!(error < 1e-9 * scale, "{samples} {i} {j}: {error} of {scale}");
                }
                // the same of a unit of noise, signal of 1e4
                assert!((slow[(i, width)] - sign * along[i]).abs() < 1e-5, "{samples} {i}");
            }
            assert!((slow[(width, width)].abs() / outside - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_pole_next_to_zero_is_left_to_the_rows() {
        // as a step from afar leaves it: beside offset and slope its columns are rounding
        let mut given = Vec::new();
        for size in [1e-9, 1e-7, 1e-5, 1e-3, 1e-1] {
            let poles = Poles(vec![c64::new(-size, 0.5 * size)]);
            let fast = Recursion::of(&poles, 2e-4, 0.4, 1939, true);
            let y: Vec<f64> = (0..1939).map(|k| (-0.004 * k as f64).exp() * (0.17 * k as f64).sin()).collect();
            let all = columns(&poles, 2e-4, 0.4, 1939, true);
            let rows = Mat::from_fn(1939, all.len() + 1, |i, j| if j < all.len() { all[j][i] } else { y[i] });
            let slow = TallQr::triangle(rows.as_ref());
            let outside = slow[(all.len(), all.len())].abs();
            if let Some((_, found)) = fast.along(&y) {
                given.push(size);
                // of a direction that is half rounding a part of the energy may be lost, not all of it
                assert!((found / outside - 1.0).abs() < 0.05, "{size}: {found} for {outside}");
            }
        }
        assert_eq!(given, [1e-3, 1e-1]);
    }
}

//! Variable projection on a triangle: a decay's fit and its Jacobian without a pass over the samples.

use crate::linear_algebra::{Qr, cholesky, dot_in_lanes};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par, c64};

use super::sums::{power_of, power_sums, powers};

/// Samples of a block: a product with a block's exponentials serves all blocks.
const BLOCK: usize = 128;

/// A record, ready to be compared with any exponentials.
pub(super) struct Record<'a> {
    head: &'a [f64],
    /// Samples after the head, a block a column, zeros at the end.
    blocks: Mat<f64>,
    tail: usize,
    sum: f64,
    square: f64,
}

/// What [`Record::project`] finds.
pub(super) struct Projected {
    /// `R` of `[basis | derivatives | y]`.
    triangle: Mat<f64>,
    basis: usize,
}

impl<'a> Record<'a> {
    /// `head`: samples in which real poles may show.
    pub fn new(values: &'a [f64], head: usize) -> Self {
        let (head, tail) = values.split_at(head);
        let mut blocks = Mat::zeros(BLOCK, tail.len().div_ceil(BLOCK));
        for (column, block) in blocks.col_iter_mut().zip(tail.chunks(BLOCK)) {
            column.iter_mut().zip(block).for_each(|(target, value)| *target = *value);
        }
        Self {
            head,
            blocks,
            tail: tail.len(),
            sum: dot_in_lanes(tail, &vec![1.0; tail.len()]),
            square: dot_in_lanes(tail, tail),
        }
    }

    /// QR of modes (real and imaginary part of `exp(s k)`), real poles (`exp(-d k)`), 1, then `k` times modes and
    /// poles, then the record.
    ///
    /// # Method
    /// Rows of the head as they are, on top of the Cholesky factor of all later ones, where only modes are left: its
    /// entries are power sums, but for products with the record, which go block by block. Source: G. H. Golub and V.
    /// Pereyra, SIAM J. Numer. Anal. 10 (1973) 413.
    /// # Shapes
    /// Triangle: `2 (2 modes + poles) + 2` square.
    pub fn project(&self, modes: &[c64], decays: &[f64]) -> Projected {
        let (pairs, poles) = (2 * modes.len(), decays.len());
        let basis = pairs + poles + 1;
        let width = basis + pairs + poles + 1;
        // where the columns of the tail go: modes, 1, k modes, y
        let place: Vec<usize> = (0..pairs).chain([basis - 1]).chain(basis..basis + pairs).chain([width - 1]).collect();
        let mut rows = Mat::<f64>::zeros(self.head.len() + place.len(), width);
        for (m, s) in modes.iter().enumerate() {
            for (k, z) in powers(s.exp(), self.head.len()).enumerate() {
                (rows[(k, 2 * m)], rows[(k, 2 * m + 1)]) = (z.re, z.im);
                (rows[(k, basis + 2 * m)], rows[(k, basis + 2 * m + 1)]) = (k as f64 * z.re, k as f64 * z.im);
            }
        }
        for (p, d) in decays.iter().enumerate() {
            for k in 0..self.head.len() {
                let value = (-d * k as f64).exp();
                (rows[(k, pairs + p)], rows[(k, basis + pairs + p)]) = (value, k as f64 * value);
            }
        }
        for (k, y) in self.head.iter().enumerate() {
            (rows[(k, basis - 1)], rows[(k, width - 1)]) = (1.0, *y);
        }
        let factor = cholesky(&self.tail_gram(modes));
        for (i, &column) in place.iter().enumerate() {
            (0..=i).for_each(|row| rows[(self.head.len() + row, column)] = factor[(i, row)]);
        }
        Projected { triangle: Qr::new(rows).r(), basis }
    }

    /// Gram matrix of modes, 1, k modes and y over the samples after the head.
    fn tail_gram(&self, modes: &[c64]) -> Mat<f64> {
        let pairs = 2 * modes.len();
        let (one, slopes, y) = (pairs, pairs + 1, 2 * pairs + 1);
        let mut gram = Mat::<f64>::zeros(y + 1, y + 1);
        let first = self.head.len();
        let mut put = |i: usize, j: usize, value: f64| (gram[(i, j)], gram[(j, i)]) = (value, value);
        for (a, s) in modes.iter().enumerate() {
            for (b, t) in modes.iter().enumerate().take(a + 1) {
                let plus = power_sums((s + t).exp(), first, self.tail);
                let minus = power_sums((s + t.conj()).exp(), first, self.tail);
                for (at, m) in [((0, 0), 0), ((slopes, 0), 1), ((0, slopes), 1), ((slopes, slopes), 2)] {
                    let (i, j) = (at.0 + 2 * a, at.1 + 2 * b);
                    put(i, j, 0.5 * (plus[m].re + minus[m].re));
                    put(i + 1, j + 1, 0.5 * (minus[m].re - plus[m].re));
                    put(i, j + 1, 0.5 * (plus[m].im - minus[m].im));
                    put(i + 1, j, 0.5 * (plus[m].im + minus[m].im));
                }
            }
            let alone = power_sums(s.exp(), first, self.tail);
            for (at, m) in [(0, 0), (slopes, 1)] {
                put(at + 2 * a, one, alone[m].re);
                put(at + 2 * a + 1, one, alone[m].im);
            }
        }
        for (m, [value, slope]) in self.products(modes).into_iter().enumerate() {
            put(2 * m, y, value.re);
            put(2 * m + 1, y, value.im);
            put(slopes + 2 * m, y, slope.re);
            put(slopes + 2 * m + 1, y, slope.im);
        }
        put(one, one, self.tail as f64);
        put(one, y, self.sum);
        put(y, y, self.square);
        gram
    }

    /// Per mode `sum y(k) z^k` and `sum k y(k) z^k` over the samples after the head.
    fn products(&self, modes: &[c64]) -> Vec<[c64; 2]> {
        let mut fine = Mat::zeros(BLOCK, 4 * modes.len());
        for (m, s) in modes.iter().enumerate() {
            for (k, z) in powers(s.exp(), BLOCK).enumerate() {
                let slope = z * k as f64;
                for (c, value) in [z.re, z.im, slope.re, slope.im].into_iter().enumerate() {
                    fine[(k, 4 * m + c)] = value;
                }
            }
        }
        let mut inner = Mat::<f64>::zeros(4 * modes.len(), self.blocks.ncols());
        matmul(inner.as_mut(), Accum::Replace, fine.transpose(), self.blocks.as_ref(), 1.0, Par::Seq);
        let each = |(m, s): (usize, &c64)| {
            let start = power_of(s.exp(), self.head.len());
            let mut out = [c64::new(0.0, 0.0); 2];
            for (b, z) in powers(power_of(s.exp(), BLOCK), self.blocks.ncols()).enumerate() {
                let value = c64::new(inner[(4 * m, b)], inner[(4 * m + 1, b)]);
                let slope = c64::new(inner[(4 * m + 2, b)], inner[(4 * m + 3, b)]);
                let far = start * z;
                out[0] += far * value;
                out[1] += far * (slope + value * (self.head.len() + BLOCK * b) as f64);
            }
            out
        };
        modes.iter().enumerate().map(each).collect()
    }
}

impl Projected {
    /// Weights of the basis that fit best: per mode of real and imaginary part, of each real pole, of 1.
    pub fn weights(&self) -> Vec<f64> {
        let last = self.triangle.ncols() - 1;
        let mut weights: Vec<f64> = (0..self.basis).map(|i| self.triangle[(i, last)]).collect();
        back_substitute(self.triangle.as_ref(), &mut weights);
        weights
    }

    /// Squared residual.
    pub fn rest(&self) -> f64 {
        let last = self.triangle.ncols() - 1;
        (self.basis..=last).map(|i| self.triangle[(i, last)].powi(2)).sum()
    }

    /// What is left of the record below the basis.
    pub fn residual(&self) -> Vec<f64> {
        let last = self.triangle.ncols() - 1;
        (self.basis..=last).map(|i| self.triangle[(i, last)]).collect()
    }

    /// Change of the fit with each pole (per mode Re and Im of s, then each decay), all rows: those of the basis, then
    /// those below it, which are Kaufman's Jacobian (BIT 15 (1975) 49).
    pub fn changes(&self, weights: &[f64], modes: usize) -> Mat<f64> {
        let (basis, rows) = (self.basis, self.triangle.nrows());
        let at = |i: usize, column: usize| self.triangle[(i, basis + column)];
        let mut out = Mat::zeros(rows, basis - 1);
        for i in 0..rows {
            for m in 0..modes {
                let (re, im) = (weights[2 * m], weights[2 * m + 1]);
                out[(i, 2 * m)] = re * at(i, 2 * m) + im * at(i, 2 * m + 1);
                out[(i, 2 * m + 1)] = im * at(i, 2 * m) - re * at(i, 2 * m + 1);
            }
            for p in 2 * modes..basis - 1 {
                out[(i, p)] = -weights[p] * at(i, p);
            }
        }
        out
    }

    /// Upper triangle of the basis.
    pub fn basis_triangle(&self) -> MatRef<'_, f64> {
        self.triangle.as_ref().get(..self.basis, ..self.basis)
    }
}

/// Solves with the upper triangle in the leading columns of `r`; a direction that is not there gets nothing.
pub(super) fn back_substitute(r: MatRef<'_, f64>, x: &mut [f64]) {
    for i in (0..x.len()).rev() {
        let known: f64 = (i + 1..x.len()).map(|k| r[(i, k)] * x[k]).sum();
        x[i] = if r[(i, i)] != 0.0 { (x[i] - known) / r[(i, i)] } else { 0.0 };
    }
}

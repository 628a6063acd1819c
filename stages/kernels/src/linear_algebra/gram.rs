//! Inner products of the columns of tall matrices.
//!
//! A third of the operations of a QR, at the full rate of the vector units, for half the digits: for columns whose
//! condition is checked.

use crate::linear_algebra::product;
use faer::{Mat, MatRef};
use pulp::Simd;

/// Rows at a time: with some thirty columns they stay in the first-level cache.
const BLOCK: usize = 96;
/// Columns by columns whose products are summed at once: nine sums and six operands fill the vector registers.
const TILE: usize = 3;
/// `matrix^T matrix`, columns x columns; about `rows columns^2` operations, always on the calling thread.
pub(crate) fn gram(matrix: MatRef<'_, f64>) -> Mat<f64> {
    match slices(matrix) {
        Some(columns) => gram_of(&columns),
        None => product(matrix.transpose(), matrix),
    }
}

/// The products of all columns with one another. They may overlap in memory.
pub(crate) fn gram_of(columns: &[&[f64]]) -> Mat<f64> {
    pulp::Arch::new().dispatch(Products { left: columns, right: columns, symmetric: true })
}

/// The products of the columns on the left with those on the right, all of one length.
pub(crate) fn cross_of(left: &[&[f64]], right: &[&[f64]]) -> Mat<f64> {
    pulp::Arch::new().dispatch(Products { left, right, symmetric: false })
}

/// The sum of the columns, each with its weight.
pub(crate) fn combined(columns: &[&[f64]], weights: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sum = vec![0.0; columns.first().map_or(0, |column| column.len())];
    let columns: Vec<(&[f64], f64)> = columns.iter().copied().zip(weights).collect();
    pulp::Arch::new().dispatch(Combined { columns: &columns, sum: &mut sum });
    sum
}

/// The columns, where each is contiguous.
fn slices(matrix: MatRef<'_, f64>) -> Option<Vec<&[f64]>> {
    matrix.col_iter().map(|column| column.try_as_col_major().map(|column| column.as_slice())).collect()
}

/// Carries the products to the vector units.
struct Products<'a> {
    left: &'a [&'a [f64]],
    right: &'a [&'a [f64]],
    /// Both sides are the same: only one triangle is summed.
    symmetric: bool,
}

impl pulp::WithSimd for Products<'_> {
    type Output = Mat<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Mat<f64> {
        let Self { left, right, symmetric } = self;
        let rows = left.first().or(right.first()).map_or(0, |column| column.len());
        let across = right.len().div_ceil(TILE);
        let none = simd.splat_f64s(0.0);
        let mut sums = vec![[[none; TILE]; TILE]; left.len().div_ceil(TILE) * across];
        for top in (0..rows).step_by(BLOCK) {
            let block = top..rows.min(top + BLOCK);
            for (i, sums) in sums.chunks_exact_mut(across.max(1)).enumerate() {
                let own = tile(left, i, &block);
                let first = if symmetric { i } else { 0 };
                for (j, sums) in sums.iter_mut().enumerate().skip(first) {
                    *sums = added(simd, own, tile(right, j, &block), *sums);
                }
            }
        }
        Mat::from_fn(left.len(), right.len(), |i, j| {
            let (i, j) = if symmetric { (i.min(j), i.max(j)) } else { (i, j) };
            simd.reduce_sum_f64s(sums[i / TILE * across + j / TILE][i % TILE][j % TILE])
        })
    }
}

/// Carries the sum to the vector units.
struct Combined<'a> {
    columns: &'a [(&'a [f64], f64)],
    sum: &'a mut [f64],
}

impl pulp::WithSimd for Combined<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (index, sum) in self.sum.chunks_mut(BLOCK).enumerate() {
            let rows = index * BLOCK..index * BLOCK + sum.len();
            let (sum, rest) = S::as_mut_simd_f64s(sum);
            for (column, weight) in self.columns {
                let (own, last) = S::as_simd_f64s(&column[rows.clone()]);
                let weights = simd.splat_f64s(*weight);
                for (sum, own) in sum.iter_mut().zip(own) {
                    *sum = simd.mul_add_e_f64s(*own, weights, *sum);
                }
                for (sum, own) in rest.iter_mut().zip(last) {
                    *sum += weight * own;
                }
            }
        }
    }
}

/// Columns of a tile; the last one again where they end.
#[inline(always)]
fn tile<'a>(columns: &[&'a [f64]], index: usize, rows: &std::ops::Range<usize>) -> [&'a [f64]; TILE] {
    std::array::from_fn(|l| &columns[(index * TILE + l).min(columns.len() - 1)][rows.start..rows.end])
}

/// The sums with the products of a block's rows.
#[inline(always)]
fn added<S: Simd>(
    simd: S,
    left: [&[f64]; TILE],
    right: [&[f64]; TILE],
    mut sums: [[S::f64s; TILE]; TILE],
) -> [[S::f64s; TILE]; TILE] {
    let ([a0, a1, a2], [b0, b1, b2]) = (left.map(S::as_simd_f64s), right.map(S::as_simd_f64s));
    let full = a0.0.iter().zip(a1.0).zip(a2.0).zip(b0.0.iter().zip(b1.0).zip(b2.0));
    for (((a0, a1), a2), ((b0, b1), b2)) in full {
        sums = outer(simd, [*a0, *a1, *a2], [*b0, *b1, *b2], sums);
    }
    if !a0.1.is_empty() {
        let rest = |(_, rest): (&[S::f64s], &[f64])| simd.partial_load_f64s(rest);
        sums = outer(simd, [a0, a1, a2].map(rest), [b0, b1, b2].map(rest), sums);
    }
    sums
}

/// The sums with every product of one row's numbers.
#[inline(always)]
fn outer<S: Simd>(
    simd: S,
    a: [S::f64s; TILE],
    b: [S::f64s; TILE],
    sums: [[S::f64s; TILE]; TILE],
) -> [[S::f64s; TILE]; TILE] {
    let [s0, s1, s2] = sums;
    let row = |a: S::f64s, [s0, s1, s2]: [S::f64s; TILE]| {
        [simd.mul_add_e_f64s(a, b[0], s0), simd.mul_add_e_f64s(a, b[1], s1), simd.mul_add_e_f64s(a, b[2], s2)]
    };
    [row(a[0], s0), row(a[1], s1), row(a[2], s2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    fn noise(rows: usize, columns: usize, seed: u64) -> Mat<f64> {
        let values = white_noise(rows * columns, 1.0, seed);
        Mat::from_fn(rows, columns, |i, j| values[i + j * rows])
    }

    #[test]
    fn products_are_those_of_plain_sums() {
        for (seed, (rows, m, n)) in
            [(1, 1, 1), (5, 2, 3), (96, 3, 4), (97, 5, 11), (500, 27, 11)].into_iter().enumerate()
        {
            let (a, b) = (noise(rows, m, seed as u64), noise(rows, n, 100 + seed as u64));
            let plain = |x: &Mat<f64>, y: &Mat<f64>, i: usize, j: usize| -> f64 {
                (0..rows).map(|k| x[(k, i)] * y[(k, j)]).sum()
            };
            let (left, right) = (slices(a.as_ref()).unwrap(), slices(b.as_ref()).unwrap());
            let (own, both) = (gram(a.as_ref()), cross_of(&left, &right));
            let sum = combined(&left, (0..m).map(|j| 0.5 + j as f64));
            let slow = |k: usize| (0..m).map(|j| (0.5 + j as f64) * a[(k, j)]).sum::<f64>();
            (0..rows).for_each(|k| assert!((sum[k] - slow(k)).abs() < 1e-12)); // rounding of sums near a hundred
            assert_eq!((own.shape(), both.shape()), ((m, m), (m, n)));
            for i in 0..m {
                // some roundings of `rows` numbers near one
                (0..m).for_each(|j| assert!((own[(i, j)] - plain(&a, &a, i, j)).abs() < 1e-14 * rows as f64));
                (0..n).for_each(|j| assert!((both[(i, j)] - plain(&a, &b, i, j)).abs() < 1e-14 * rows as f64));
            }
        }
        assert_eq!(gram(Mat::<f64>::zeros(0, 3).as_ref()), Mat::<f64>::zeros(3, 3));
        assert_eq!(cross_of(&[], &[&[1.0], &[2.0]]).shape(), (0, 2));
    }

    #[test]
    fn rows_need_not_lie_in_columns() {
        let a = noise(40, 6, 7);
        let rows = gram(a.transpose());
        assert!((0..40).all(|i| (rows[(i, i)] - a.row(i).norm_l2().powi(2)).abs() < 1e-12)); // rounding
    }
}

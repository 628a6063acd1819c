//! Inner products of the columns of tall matrices.
//!
//! A third of the operations of a QR, at the full rate of the vector units, for half the digits: for columns whose condition is checked.

use faer::{Mat, MatRef};

use super::orthogonal::product;

/// Rows at a time: with some thirty columns they stay in the first-level cache.
const BLOCK: usize = 96;
/// Columns by columns whose products are summed at once: nine sums and six operands fill the vector registers.
const TILE: usize = 3;
/// Numbers added side by side, for the processor's vector units.
const LANES: usize = 4;

/// Sums of one tile.
type Sums = [[[f64; LANES]; TILE]; TILE];

/// `matrix^T matrix`, columns x columns; about `rows columns^2` operations, always on the calling thread.
pub(crate) fn gram(matrix: MatRef<'_, f64>) -> Mat<f64> {
    match slices(matrix) {
        Some(columns) => pulp::Arch::new().dispatch(Products { left: &columns, right: &columns, symmetric: true }),
        None => product(matrix.transpose(), matrix),
    }
}

/// `left^T right`, for as many rows on either side.
pub(crate) fn cross(left: MatRef<'_, f64>, right: MatRef<'_, f64>) -> Mat<f64> {
    match (slices(left), slices(right)) {
        (Some(left), Some(right)) => {
            pulp::Arch::new().dispatch(Products { left: &left, right: &right, symmetric: false })
        }
        _ => product(left.transpose(), right),
    }
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

impl pulp::NullaryFnOnce for Products<'_> {
    type Output = Mat<f64>;

    #[inline(always)]
    fn call(self) -> Mat<f64> {
        let Self { left, right, symmetric } = self;
        let rows = left.first().or(right.first()).map_or(0, |column| column.len());
        let across = right.len().div_ceil(TILE);
        let mut sums: Vec<Sums> = vec![[[[0.0; LANES]; TILE]; TILE]; left.len().div_ceil(TILE) * across];
        for top in (0..rows).step_by(BLOCK) {
            let block = top..rows.min(top + BLOCK);
            for (i, sums) in sums.chunks_exact_mut(across.max(1)).enumerate() {
                let own = tile(left, i, &block);
                let first = if symmetric { i } else { 0 };
                for (j, sums) in sums.iter_mut().enumerate().skip(first) {
                    add(own, tile(right, j, &block), sums);
                }
            }
        }
        Mat::from_fn(left.len(), right.len(), |i, j| {
            let (i, j) = if symmetric { (i.min(j), i.max(j)) } else { (i, j) };
            let [a, b, c, d] = sums[i / TILE * across + j / TILE][i % TILE][j % TILE];
            (a + b) + (c + d)
        })
    }
}

/// Columns of a tile; the last one again where they end.
#[inline(always)]
fn tile<'a>(columns: &[&'a [f64]], index: usize, rows: &std::ops::Range<usize>) -> [&'a [f64]; TILE] {
    std::array::from_fn(|l| &columns[(index * TILE + l).min(columns.len() - 1)][rows.start..rows.end])
}

/// Adds the products of a block's rows.
#[inline(always)]
fn add(left: [&[f64]; TILE], right: [&[f64]; TILE], sums: &mut Sums) {
    let (a, b) = (left.map(|column| column.as_chunks::<LANES>()), right.map(|column| column.as_chunks::<LANES>()));
    let rounds = a[0].0.len();
    let (full_a, full_b) = (a.map(|(full, _)| &full[..rounds]), b.map(|(full, _)| &full[..rounds]));
    let mut own = *sums;
    for r in 0..rounds {
        for i in 0..TILE {
            for j in 0..TILE {
                for l in 0..LANES {
                    own[i][j][l] = full_a[i][r][l].mul_add(full_b[j][r][l], own[i][j][l]);
                }
            }
        }
    }
    for i in 0..TILE {
        for j in 0..TILE {
            a[i].1.iter().zip(b[j].1).for_each(|(x, y)| own[i][j][0] = x.mul_add(*y, own[i][j][0]));
        }
    }
    *sums = own;
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
            let (own, both) = (gram(a.as_ref()), cross(a.as_ref(), b.as_ref()));
            assert_eq!((own.shape(), both.shape()), ((m, m), (m, n)));
            for i in 0..m {
                // some roundings of `rows` numbers near one
                (0..m).for_each(|j| assert!((own[(i, j)] - plain(&a, &a, i, j)).abs() < 1e-14 * rows as f64));
                (0..n).for_each(|j| assert!((both[(i, j)] - plain(&a, &b, i, j)).abs() < 1e-14 * rows as f64));
            }
        }
        assert_eq!(gram(Mat::<f64>::zeros(0, 3).as_ref()), Mat::<f64>::zeros(3, 3));
        assert_eq!(cross(Mat::<f64>::zeros(4, 0).as_ref(), noise(4, 2, 1).as_ref()).shape(), (0, 2));
    }

    #[test]
    fn rows_need_not_lie_in_columns() {
        let a = noise(40, 6, 7);
        let rows = gram(a.transpose());
        assert!((0..40).all(|i| (rows[(i, i)] - a.row(i).norm_l2().powi(2)).abs() < 1e-12)); // rounding
    }
}

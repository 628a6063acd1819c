//! QR of tall matrices: blocks of rows that fit the cache, folded one after the other into one triangle.
//!
//! Source: J. Demmel, L. Grigori, M. Hoemmen, J. Langou, SIAM J. Sci. Comput. 34 (2012) A206; products of reflectors:
//! R. Schreiber and C. Van Loan, SIAM J. Sci. Stat. Comput. 10 (1989) 53.

use faer::{Mat, MatMut, MatRef};

/// Rows of a block: with some thirty columns it fits the first-level cache.
const BLOCK: usize = 96;
/// Reflectors applied at once.
const PANEL: usize = 4;
/// Numbers added side by side, for the processor's vector units.
const LANES: usize = 4;

/// Upper triangle of the product of a panel's reflectors, `I - V T V^T`.
type Product = [[f64; PANEL]; PANEL];

/// Householder QR of a tall matrix, its reflectors kept; always on the calling thread.
///
/// Entries are to lie between 1e-150 and 1e150: sums of squares are formed as they are.
#[derive(Debug, Clone)]
pub struct TallQr {
    rows: usize,
    columns: usize,
    /// Columns rounded up to whole panels.
    padded: usize,
    /// The blocks' reflectors below the triangle, BLOCK x padded each.
    reflectors: Vec<f64>,
    /// For each block its panels' products.
    products: Vec<Product>,
    /// padded x padded, by columns.
    triangle: Vec<f64>,
}

impl TallQr {
    /// Factors `matrix`; about `2 rows columns^2` operations.
    pub fn new(matrix: MatRef<'_, f64>) -> Self {
        pulp::Arch::new().dispatch(Factor(matrix))
    }

    /// The triangle alone, columns x columns, of a matrix of any shape: no reflector is kept.
    pub fn triangle(matrix: MatRef<'_, f64>) -> Mat<f64> {
        pulp::Arch::new().dispatch(Triangle(matrix))
    }

    /// Columns x columns.
    pub fn r(&self) -> Mat<f64> {
        upper(&self.triangle, self.columns, self.padded)
    }

    /// `Q^T other`: returns the rows beside the triangle (columns of the factored matrix x columns of `other`) and
    /// leaves the others in `other`.
    pub fn apply_transpose(&self, other: MatMut<'_, f64>) -> Mat<f64> {
        pulp::Arch::new().dispatch(Apply(self, other))
    }
}

/// Carries a factorisation to the vector units.
struct Factor<'a>(MatRef<'a, f64>);

impl pulp::NullaryFnOnce for Factor<'_> {
    type Output = TallQr;

    #[inline(always)]
    fn call(self) -> TallQr {
        let (rows, columns) = self.0.shape();
        let padded = columns.next_multiple_of(PANEL);
        let (blocks, panels) = (rows.div_ceil(BLOCK), padded / PANEL);
        let mut reflectors = Vec::with_capacity(blocks * BLOCK * padded);
        let mut products = vec![[[0.0; PANEL]; PANEL]; blocks * panels];
        let mut triangle = vec![0.0; padded * padded];
        for (b, products) in products.chunks_exact_mut(panels.max(1)).enumerate() {
            let start = reflectors.len();
            copy_block(self.0, b * BLOCK, padded, &mut reflectors);
            fold(&mut reflectors[start..], &mut triangle, products, columns, padded);
        }
        TallQr { rows, columns, padded, reflectors, products, triangle }
    }
}

/// Carries a triangle to the vector units.
struct Triangle<'a>(MatRef<'a, f64>);

impl pulp::NullaryFnOnce for Triangle<'_> {
    type Output = Mat<f64>;

    #[inline(always)]
    fn call(self) -> Mat<f64> {
        let (rows, columns) = self.0.shape();
        let padded = columns.next_multiple_of(PANEL);
        let mut block = Vec::with_capacity(BLOCK * padded);
        let mut products = vec![[[0.0; PANEL]; PANEL]; padded / PANEL];
        let mut triangle = vec![0.0; padded * padded];
        for top in (0..rows).step_by(BLOCK) {
            block.clear();
            copy_block(self.0, top, padded, &mut block);
            products.fill([[0.0; PANEL]; PANEL]);
            fold(&mut block, &mut triangle, &mut products, columns, padded);
        }
        upper(&triangle, columns, padded)
    }
}

/// Carries `Q^T other` to the vector units.
struct Apply<'a, 'b>(&'a TallQr, MatMut<'b, f64>);

impl pulp::NullaryFnOnce for Apply<'_, '_> {
    type Output = Mat<f64>;

    #[inline(always)]
    fn call(self) -> Mat<f64> {
        let Self(qr, mut other) = self;
        let (padded, count) = (qr.padded, other.ncols());
        let panels = padded / PANEL;
        // beside the triangle, a column after the other
        let mut head = vec![0.0; padded * count];
        let mut pair: [Column; 2] = [[[0.0; LANES]; ROUNDS]; 2];
        for b in 0..qr.rows.div_ceil(BLOCK) {
            let rows = b * BLOCK..qr.rows.min((b + 1) * BLOCK);
            let reflectors = &qr.reflectors[b * BLOCK * padded..(b + 1) * BLOCK * padded];
            let products = &qr.products[b * panels..(b + 1) * panels];
            for first in (0..count).step_by(2) {
                let width = 2.min(count - first);
                for (i, own) in pair.iter_mut().enumerate().take(width) {
                    let own = own.as_flattened_mut();
                    own[rows.len()..].fill(0.0);
                    let column = other.as_ref().col(first + i);
                    own.iter_mut().zip(column.subrows(rows.start, rows.len()).iter()).for_each(|(own, x)| *own = *x);
                }
                let head = &mut head[first * padded..(first + width) * padded];
                let (each, _) = columns_of(reflectors).as_chunks::<PANEL>();
                for (p, (v, t)) in each.iter().zip(products).enumerate() {
                    let [one, two] = &mut pair;
                    if width == 2 {
                        let (head_one, head_two) = head.split_at_mut(padded);
                        let heads = [panel_of(head_one, p), panel_of(head_two, p)];
                        reflect(v, t, [one, two], heads);
                    } else {
                        reflect(v, t, [one], [panel_of(head, p)]);
                    }
                }
                for (i, own) in pair.iter().enumerate().take(width) {
                    let column = other.as_mut().col_mut(first + i).subrows_mut(rows.start, rows.len());
                    column.iter_mut().zip(own.as_flattened()).for_each(|(x, own)| *x = *own);
                }
            }
        }
        Mat::from_fn(qr.columns, count, |i, j| head[i + j * padded])
    }
}

/// The entries of a column that belong to a panel.
#[inline(always)]
fn panel_of(column: &mut [f64], panel: usize) -> &mut [f64] {
    &mut column[panel * PANEL..(panel + 1) * PANEL]
}

/// Appends the rows from `top` on, a column after the other; zeros where rows or columns end.
#[inline(always)]
fn copy_block(matrix: MatRef<'_, f64>, top: usize, padded: usize, block: &mut Vec<f64>) {
    let (start, length) = (block.len(), BLOCK.min(matrix.nrows() - top));
    for column in matrix.col_iter() {
        match column.try_as_col_major() {
            Some(column) => block.extend_from_slice(&column.as_slice()[top..top + length]),
            None => block.extend(column.iter().skip(top).take(length)),
        }
        block.resize(block.len() + BLOCK - length, 0.0);
    }
    block.resize(start + BLOCK * padded, 0.0);
}

fn upper(triangle: &[f64], columns: usize, padded: usize) -> Mat<f64> {
    Mat::from_fn(columns, columns, |i, j| if i <= j { triangle[i + j * padded] } else { 0.0 })
}

/// Folds a block of rows into the triangle: its columns become the reflectors.
#[inline(always)]
fn fold(block: &mut [f64], triangle: &mut [f64], products: &mut [Product], columns: usize, padded: usize) {
    for (p, product) in products.iter_mut().enumerate() {
        let first = p * PANEL;
        let width = PANEL.min(columns - first);
        let (panel, rest) = block[first * BLOCK..].split_at_mut(PANEL * BLOCK);
        for k in 0..width {
            let (before, after) = panel.split_at_mut((k + 1) * BLOCK);
            let own = &mut before[k * BLOCK..];
            let below = dot(own, own);
            if below == 0.0 {
                continue;
            }
            let corner = &mut triangle[(first + k) * (padded + 1)];
            let (alpha, beta) = (*corner, -(*corner * *corner + below).sqrt().copysign(*corner));
            *corner = beta;
            let (tau, scale) = ((beta - alpha) / beta, (alpha - beta).recip());
            own.iter_mut().for_each(|x| *x *= scale);
            product[k][k] = tau;
            for (j, column) in after.chunks_exact_mut(BLOCK).take(width - k - 1).enumerate() {
                let beside = &mut triangle[first + k + (first + k + 1 + j) * padded];
                let weight = tau * (dot(own, column) + *beside);
                *beside -= weight;
                for (c, x) in column.iter_mut().zip(own.iter()) {
                    *c = (-weight).mul_add(*x, *c);
                }
            }
        }
        for k in 1..width {
            let (before, own) = panel[..(k + 1) * BLOCK].split_at(k * BLOCK);
            let mut inner = [0.0; PANEL];
            // loops, no closures: a closure is compiled apart, without the vector units
            for (z, v) in inner.iter_mut().zip(before.chunks_exact(BLOCK)) {
                *z = -product[k][k] * dot(v, own);
            }
            for (i, row) in product.iter_mut().enumerate().take(k) {
                row[k] = (i..k).map(|m| row[m] * inner[m]).sum();
            }
        }
        let Ok(panel) = <&[Column; PANEL]>::try_from(columns_of(panel)) else { continue };
        let behind = columns_of_mut(&mut rest[..(columns - first - width) * BLOCK]);
        let mut beside = triangle[(first + width) * padded..].chunks_exact_mut(padded);
        let mut pairs = behind.chunks_exact_mut(2);
        for pair in pairs.by_ref() {
            if let ([one, two], Some(head_one), Some(head_two)) = (pair, beside.next(), beside.next()) {
                reflect(panel, product, [one, two], [panel_of(head_one, p), panel_of(head_two, p)]);
            }
        }
        if let ([one], Some(head)) = (pairs.into_remainder(), beside.next()) {
            reflect(panel, product, [one], [panel_of(head, p)]);
        }
    }
}

/// Rounds of the vector units over a column of a block.
const ROUNDS: usize = BLOCK / LANES;
/// A column of a block.
type Column = [[f64; LANES]; ROUNDS];

/// As columns of a block.
#[inline(always)]
fn columns_of(values: &[f64]) -> &[Column] {
    values.as_chunks().0.as_chunks().0
}

/// As columns of a block.
#[inline(always)]
fn columns_of_mut(values: &mut [f64]) -> &mut [Column] {
    values.as_chunks_mut().0.as_chunks_mut().0
}

/// Applies a panel's reflectors to columns of the block and to what stands beside them in the triangle.
#[inline(always)]
fn reflect<const K: usize>(v: &[Column; PANEL], t: &Product, columns: [&mut Column; K], beside: [&mut [f64]; K]) {
    let mut sums = [[[0.0; LANES]; PANEL]; K];
    for i in 0..ROUNDS {
        for k in 0..K {
            let x = columns[k][i];
            for j in 0..PANEL {
                for l in 0..LANES {
                    sums[k][j][l] = v[j][i][l].mul_add(x[l], sums[k][j][l]);
                }
            }
        }
    }
    let mut weights = [[0.0; PANEL]; K];
    for (k, beside) in beside.into_iter().enumerate() {
        for m in 0..PANEL {
            for n in 0..=m {
                let [a, b, c, d] = sums[k][n];
                weights[k][m] += t[n][m] * ((a + b) + (c + d) + beside[n]);
            }
        }
        (0..PANEL).for_each(|m| beside[m] -= weights[k][m]);
    }
    for i in 0..ROUNDS {
        for k in 0..K {
            let mut x = columns[k][i];
            for j in 0..PANEL {
                for l in 0..LANES {
                    x[l] = (-weights[k][j]).mul_add(v[j][i][l], x[l]);
                }
            }
            columns[k][i] = x;
        }
    }
}

/// Inner product of two columns of a block.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [[0.0; LANES]; 2];
    for (x, y) in a.as_chunks::<{ 2 * LANES }>().0.iter().zip(b.as_chunks::<{ 2 * LANES }>().0) {
        for l in 0..LANES {
            sums[0][l] = x[l].mul_add(y[l], sums[0][l]);
            sums[1][l] = x[l + LANES].mul_add(y[l + LANES], sums[1][l]);
        }
    }
    let [a, b, c, d]: [f64; LANES] = std::array::from_fn(|l| sums[0][l] + sums[1][l]);
    (a + b) + (c + d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;
    use crate::linear_algebra::{Qr, product};

    fn noise(rows: usize, columns: usize, seed: u64) -> Mat<f64> {
        let values = white_noise(rows * columns, 1.0, seed);
        Mat::from_fn(rows, columns, |i, j| values[i + j * rows])
    }

    /// Largest entry of a difference.
    fn apart(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
        (a - b).col_iter().flat_map(|column| column.iter().map(|x| x.abs()).collect::<Vec<_>>()).fold(0.0, f64::max)
    }

    #[test]
    fn any_shape_has_the_triangle_of_a_plain_factorisation() {
        for (seed, (rows, columns)) in
            [(1, 1), (7, 3), (96, 4), (97, 5), (200, 26), (500, 11), (1000, 33)].into_iter().enumerate()
        {
            let a = noise(rows, columns, seed as u64);
            let (ours, plain) = (TallQr::new(a.as_ref()), Qr::new(a.clone()).r());
            // signs of rows are free: compare R^T R
            let gram = |r: &Mat<f64>| product(r.transpose(), r.as_ref());
            let size = rows as f64;
            // some ten roundings of sums of `rows` squares
            assert!(apart(&gram(&ours.r()), &gram(&plain)) < 1e-14 * size.max(10.0), "{rows} x {columns}");
            assert!(apart(&ours.r(), &TallQr::triangle(a.as_ref())) == 0.0, "{rows} x {columns}");
        }
    }

    #[test]
    fn what_is_rotated_keeps_its_products() {
        let (a, b) = (noise(300, 9, 1), noise(300, 5, 2));
        let qr = TallQr::new(a.as_ref());
        let mut rest = b.clone();
        let head = qr.apply_transpose(rest.as_mut());
        // A^T B = R^T (Q^T B), and lengths stay; 300 products of numbers near one
        let along = product(qr.r().transpose(), head.as_ref());
        assert!(apart(&along, &product(a.transpose(), b.as_ref())) < 1e-12);
        for j in 0..5 {
            let length = head.col(j).norm_l2().hypot(rest.col(j).norm_l2());
            assert!((length - b.col(j).norm_l2()).abs() < 1e-12);
        }
        // the factored matrix itself has nothing left below its triangle
        let mut own = a.clone();
        assert!(apart(&qr.apply_transpose(own.as_mut()), &qr.r()) < 1e-12);
        assert!(own.norm_l2() < 1e-12);
    }

    #[test]
    fn columns_of_zeros_and_copies_are_no_trouble() {
        let own = noise(250, 1, 3);
        let a = Mat::from_fn(250, 6, |i, j| if j % 3 == 1 { 0.0 } else { own[(i, 0)] });
        let r = TallQr::new(a.as_ref()).r();
        let length = own.col(0).norm_l2();
        assert!((r[(0, 0)].abs() - length).abs() < 1e-12 && (r[(0, 5)].abs() - length).abs() < 1e-12);
        assert!((1..6).all(|i| r[(i, i)].abs() < 1e-12));
    }

    #[test]
    fn fewer_rows_than_columns_leave_rows_of_zeros() {
        let a = noise(3, 6, 4);
        let r = TallQr::triangle(a.as_ref());
        let gram = product(r.transpose(), r.as_ref());
        assert!(apart(&gram, &product(a.transpose(), a.as_ref())) < 1e-13);
    }
}

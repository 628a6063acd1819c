//! Events as a few dozen numbers: their whitened projections on the space that the ringing can reach.

use crate::linear_algebra::{Qr, product};
use faer::Mat;
use rayon::prelude::*;

use super::modal_form::{Exponential, columns};
use super::whitener::{LANES, Whitener};

/// Whitened basis and events, rotated: `|W (y - B w)|^2 = |z - R w|^2 + rest`.
pub(super) struct Compressed {
    /// Upper triangle of the whitened basis: width x width.
    pub r: Mat<f64>,
    /// Per event, width numbers.
    pub projections: Vec<Vec<f64>>,
    /// Per event, the whitened energy outside the basis.
    pub rest: Vec<f64>,
}

/// Whitens signals in place, [`LANES`] at a time on all cores; the result does not depend on their number.
pub(crate) fn whiten(whitener: &Whitener, signals: &mut [Vec<f64>]) {
    signals.par_chunks_mut(LANES).for_each(|chunk| {
        let mut lanes: Vec<&mut [f64]> = chunk.iter_mut().map(Vec::as_mut_slice).collect();
        whitener.apply(&mut lanes);
    });
}

/// Projects whitened events on the basis round `reference`.
///
/// # Method
/// Householder QR of the whitened basis; each event as its products with the orthonormal columns.
pub(super) fn compress(
    whitener: &Whitener,
    reference: &[Exponential],
    whitened: &[Vec<f64>],
    interval_s: f64,
) -> Compressed {
    let samples = whitened.first().map_or(0, Vec::len);
    if let Some(scale) = whitener.constant().filter(|_| samples > 4 * HEAD) {
        return compress_white(scale, reference, whitened, interval_s);
    }
    let mut basis = columns(reference, interval_s, samples);
    whiten(whitener, &mut basis);
    let width = basis.len();
    let matrix = Mat::from_fn(samples, width, |i, j| basis[j][i]);
    let qr = Qr::new(matrix);
    let r = qr.r();
    let results: Vec<(Vec<f64>, f64)> = whitened
        .par_chunks(LANES)
        .flat_map_iter(|chunk| {
            let mut rotated = Mat::from_fn(samples, chunk.len(), |i, j| chunk[j][i]);
            qr.apply_transpose(rotated.as_mut());
            (0..chunk.len())
                .map(|j| {
                    let head = (0..width).map(|i| rotated[(i, j)]).collect::<Vec<f64>>();
                    let rest = (width..samples).map(|i| rotated[(i, j)] * rotated[(i, j)]).sum();
                    (head, rest)
                })
                .collect::<Vec<_>>()
        })
        .collect();
    let (projections, rest) = results.into_iter().unzip();
    Compressed { r, projections, rest }
}

/// First samples, in which real poles can still be seen: beyond, `0.2^64` is below every rounding.
const HEAD: usize = 64;

/// [`compress`] for white noise, where only the first samples see the real poles.
///
/// # Method
/// The rest of the record by the Cholesky factor of the Gram matrix of the modes' columns (well conditioned), stacked
/// under the first samples as they are: the orthogonal factorisation is of a hundred rows. A real pole slower than that
/// gets the long way.
fn compress_white(scale: f64, reference: &[Exponential], whitened: &[Vec<f64>], interval_s: f64) -> Compressed {
    let samples = whitened.first().map_or(0, Vec::len);
    let basis = columns(reference, interval_s, samples);
    let width = basis.len();
    let fast = |column: &Vec<f64>| column[HEAD..].iter().all(|v| v.abs() < 1e-25);
    let long: Vec<usize> = (0..width).filter(|&j| !fast(&basis[j])).collect();
    let mut tail = Mat::zeros(samples - HEAD, long.len());
    for (c, &j) in long.iter().enumerate() {
        tail.col_mut(c).iter_mut().zip(&basis[j][HEAD..]).for_each(|(t, v)| *t = scale * v);
    }
    let factor = crate::linear_algebra::cholesky(&product(tail.transpose(), tail.as_ref()));
    let stacked = Mat::from_fn(HEAD + long.len(), width, |i, j| {
        if i < HEAD {
            return scale * basis[j][i];
        }
        long.iter().position(|&l| l == j).map_or(0.0, |c| factor[(c, i - HEAD)])
    });
    let qr = Qr::new(stacked);
    let ends = Mat::from_fn(samples - HEAD, whitened.len(), |i, e| whitened[e][HEAD + i]);
    let seen = product(tail.transpose(), ends.as_ref());
    let mut rotated = Mat::zeros(HEAD + long.len(), whitened.len());
    for e in 0..whitened.len() {
        (0..HEAD).for_each(|i| rotated[(i, e)] = whitened[e][i]);
        // forward substitution with the factor
        for i in 0..long.len() {
            let known: f64 = (0..i).map(|k| factor[(i, k)] * rotated[(HEAD + k, e)]).sum();
            rotated[(HEAD + i, e)] = (seen[(i, e)] - known) / factor[(i, i)];
        }
    }
    let outside: Vec<f64> = (0..whitened.len())
        .map(|e| {
            let total: f64 = whitened[e][HEAD..].iter().map(|v| v * v).sum();
            let within: f64 = (0..long.len()).map(|i| rotated[(HEAD + i, e)].powi(2)).sum();
            (total - within).max(0.0)
        })
        .collect();
    qr.apply_transpose(rotated.as_mut());
    let rows = rotated.nrows();
    let projections = (0..whitened.len()).map(|e| (0..width).map(|i| rotated[(i, e)]).collect()).collect();
    let rest =
        (0..whitened.len()).map(|e| outside[e] + (width..rows).map(|i| rotated[(i, e)].powi(2)).sum::<f64>()).collect();
    Compressed { r: qr.r(), projections, rest }
}

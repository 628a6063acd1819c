//! Subspace identification with past inputs and outputs as instruments: N4SID, MOESP and CVA weights.

use std::ops::Range;

use crate::linear_algebra::{Qr, Svd, clear_factor, hankel_products, hankel_row_sums, product};
use faer::Mat;

use super::past_future::{Subspace, input_basis, scaled};
use super::weight::Weight;
use crate::model::{ModelError, finite};

/// Directions below this share of the strongest are not excited: a thousand roundings of QR.
const TOLERANCE: f64 = 1e-12;

impl Subspace {
    /// The observability matrix's column space, estimated from what the past says about the future.
    ///
    /// # Model
    /// Innovations form, one output: `x(t+1) = A x + B u + K e`, `y = C x + D u + e`; an offset of y is allowed. The noise
    /// may be coloured.
    /// # Method
    /// Triangle of `[1; U_f]`, past `[U_p; Y_p]`, `Y_f`, by their products where these keep enough digits, by QR
    /// elsewhere; singular value decomposition of the part of `Y_f` that the past explains, weighted; A by shift
    /// invariance, in the least-squares sense.
    /// # Shapes
    /// u, y: N samples, several inputs one after the other; singular values: `block_rows`.
    /// # Units
    /// Poles in the z plane; each signal is scaled to its peak first.
    /// # Accuracy
    /// Consistent as N and the block rows grow, if the input excites 2 `block_rows` rows: start values, some per cent from
    /// the likelihood's maximum. The weights differ in the metric alone in which the order is cut off: with noise below the
    /// weakest state, or a white input, N4SID and MOESP agree to a per cent, and CVA gains 4 to 10 % where the noise is
    /// coloured; a coloured input sets N4SID behind MOESP (60 seeds, test). Singular values always differ.
    /// # Errors
    /// Lengths, values that are not finite, fewer than `(4 + 2 inputs) block_rows` samples, no convergence of a
    /// decomposition.
    /// # Source
    /// P. Van Overschee and B. De Moor, Subspace Identification for Linear Systems (1996), chapter 4; L. Ljung (1999),
    /// section 10.6.
    ///
    /// `block_rows` rows of past and as many of future, at least 2.
    pub fn with_instruments(u: &[f64], y: &[f64], block_rows: usize, weight: Weight) -> Result<Self, ModelError> {
        match weight {
            Weight::Release => checked(u, y, block_rows).and_then(|_| Self::new(u, y, block_rows)),
            _ => Instruments::new(u, y, block_rows)?.subspace(weight),
        }
    }
}

/// What [`Subspace::with_instruments`] knows before it weights: the same for all weights but [`Weight::Release`], which
/// has no instruments.
pub(crate) struct Instruments {
    /// Triangle of `[1; U_f]`, past and `Y_f`.
    r: Mat<f64>,
    /// Columns of the past in it.
    past: Range<usize>,
    explained: Explained,
}

impl Instruments {
    /// Errors: those of [`Subspace::with_instruments`].
    pub fn new(u: &[f64], y: &[f64], block_rows: usize) -> Result<Self, ModelError> {
        let (inputs, s) = (checked(u, y, block_rows)?, block_rows);
        let r = match triangle(u, y, s) {
            Some(triangle) => triangle,
            None => Qr::new(stacked(u, y, s)?).r(),
        };
        let past = r.ncols() - (inputs + 2) * s..r.ncols() - s;
        let explained =
            Explained::new(&block(&r, past.clone(), past.clone()), &block(&r, past.clone(), past.end..r.ncols()))?;
        Ok(Self { r, past, explained })
    }

    /// The estimate of one weight. Errors: no convergence of a decomposition; a weight without instruments.
    pub fn subspace(&self, weight: Weight) -> Result<Subspace, ModelError> {
        let Self { r, past, explained } = self;
        let (left, singular_values) = match weight {
            Weight::Release => return Err(ModelError::Degenerate("a release has no instruments")),
            Weight::Moesp => decomposed(&explained.projected)?,
            Weight::N4sid => {
                let known = block(r, 0..past.end, past.clone());
                decomposed(&product(known.as_ref(), explained.coefficients.as_ref()))?
            }
            Weight::Cva => canonical(&explained.projected, &block(r, past.start..r.ncols(), past.end..r.ncols()))?,
        };
        Ok(Subspace { left, singular_values })
    }
}

/// Number of inputs. Errors: lengths, values that are not finite, too few samples.
fn checked(u: &[f64], y: &[f64], block_rows: usize) -> Result<usize, ModelError> {
    let (samples, s) = (y.len(), block_rows);
    let inputs = u.len() / samples.max(1);
    if inputs == 0 || u.len() != inputs * samples {
        return Err(ModelError::Length { what: "input", found: u.len(), wanted: samples });
    }
    if s < 2 {
        return Err(ModelError::Parameter { name: "block_rows", found: s as f64, wanted: "at least 2" });
    }
    // as many windows as columns, at least
    let wanted = (2 * inputs + 4) * s;
    if samples < wanted {
        return Err(ModelError::TooShort { found: samples, wanted });
    }
    finite("input", u)?;
    finite("output", y)?;
    Ok(inputs)
}

fn block(r: &Mat<f64>, rows: Range<usize>, columns: Range<usize>) -> Mat<f64> {
    Mat::from_fn(rows.len(), columns.len(), |i, j| r[(rows.start + i, columns.start + j)])
}

/// Least share of its energy that a column keeps beside those before it, where products serve: the triangle then has
/// eight digits.
const LEAST_KEPT: f64 = 1e-8;

/// The triangle of future inputs, past and future output, from their products. None: too ill-conditioned for these.
fn triangle(u: &[f64], y: &[f64], s: usize) -> Option<Mat<f64>> {
    let samples = y.len();
    let signals: Vec<Vec<f64>> = u.chunks_exact(samples).chain([y]).map(scaled).collect();
    let windows = (samples - 2 * s + 1) as f64;
    let sums: Vec<Vec<f64>> = signals.iter().map(|signal| hankel_row_sums(signal, 2 * s)).collect();
    let products: Vec<Vec<Mat<f64>>> = (0..signals.len())
        .map(|k| (0..=k).map(|l| hankel_products(&signals[k], &signals[l], 2 * s)).collect())
        .collect();
    // signal and row of each column but the first, which is one
    let (inputs, output) = (signals.len() - 1, signals.len() - 1);
    let future = (0..inputs).flat_map(|k| (s..2 * s).map(move |row| (k, row)));
    let past = (0..=inputs).flat_map(|k| (0..s).map(move |row| (k, row)));
    let columns: Vec<(usize, usize)> = future.chain(past).chain((s..2 * s).map(|row| (output, row))).collect();
    let entry = |i: usize, j: usize| match (i.checked_sub(1), j.checked_sub(1)) {
        (None, None) => windows,
        (Some(k), None) | (None, Some(k)) => sums[columns[k].0][columns[k].1],
        (Some(i), Some(j)) => match (columns[i], columns[j]) {
            ((k, row), (l, other)) if k >= l => products[k][l][(row, other)],
            ((k, row), (l, other)) => products[l][k][(other, row)],
        },
    };
    let lower = clear_factor(&Mat::from_fn(columns.len() + 1, columns.len() + 1, entry), LEAST_KEPT)?;
    Some(lower.transpose().to_owned())
}

/// Future input directions, past, future output: windows x columns.
fn stacked(u: &[f64], y: &[f64], s: usize) -> Result<Mat<f64>, ModelError> {
    let samples = y.len();
    let windows = samples - 2 * s + 1;
    let later: Vec<f64> = u.chunks_exact(samples).flat_map(|u| u[s..].to_vec()).collect();
    let basis = input_basis(&later, samples - s, s)?;
    let signals: Vec<&[f64]> = u.chunks_exact(samples).chain([y]).collect();
    let first = basis.ncols();
    let mut stacked = Mat::zeros(windows, first + (signals.len() + 1) * s);
    stacked.as_mut().get_mut(.., ..first).copy_from(&basis);
    for (i, (signal, offset)) in signals.iter().map(|signal| (signal, 0)).chain([(&y, s)]).enumerate() {
        let signal = scaled(signal);
        for j in 0..s {
            let column = stacked.col_mut(first + i * s + j);
            column.iter_mut().zip(&signal[offset + j..]).for_each(|(h, x)| *h = *x);
        }
    }
    Ok(stacked)
}

/// What the past explains of the future.
struct Explained {
    /// In orthonormal coordinates of the past: rank x rows of the future.
    projected: Mat<f64>,
    /// Coefficients on the past: past x rows of the future.
    coefficients: Mat<f64>,
}

impl Explained {
    /// From the triangle of the past and its part of the future.
    fn new(past: &Mat<f64>, future: &Mat<f64>) -> Result<Self, ModelError> {
        let svd = Svd::new(past)?;
        let rank = svd.rank(TOLERANCE);
        let projected = product(svd.u.as_ref().get(.., ..rank).transpose(), future.as_ref());
        let scaled = Mat::from_fn(rank, future.ncols(), |i, j| projected[(i, j)] / svd.s[i]);
        Ok(Self { projected, coefficients: product(svd.v.as_ref().get(.., ..rank), scaled.as_ref()) })
    }
}

/// Right singular vectors, as columns, and singular values.
fn decomposed(matrix: &Mat<f64>) -> Result<(Mat<f64>, Vec<f64>), ModelError> {
    let svd = Svd::new(matrix)?;
    Ok((svd.v, svd.s))
}

/// Scaled by the inverse root of the future's covariance `T^T T`, and back: canonical correlations.
fn canonical(projected: &Mat<f64>, future: &Mat<f64>) -> Result<(Mat<f64>, Vec<f64>), ModelError> {
    let root = Svd::new(&Qr::new(future.clone()).r())?;
    // without noise some directions vanish: they must not be blown up
    let least = root.s.first().copied().unwrap_or(0.0) * TOLERANCE.sqrt();
    let scaled_by = |power: i32| {
        let s = |k: usize| root.s[k].max(least).powi(power);
        let half = Mat::from_fn(root.v.nrows(), root.v.ncols(), |i, k| root.v[(i, k)] * s(k));
        product(half.as_ref(), root.v.transpose())
    };
    let svd = Svd::new(&product(projected.as_ref(), scaled_by(-1).as_ref()))?;
    Ok((product(scaled_by(1).as_ref(), svd.v.as_ref()), svd.s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    /// A resonance at 0.1 cycles per sample, decaying over 20 samples, with noise.
    fn record(noise: f64) -> (Vec<f64>, Vec<f64>) {
        let (u, e) = (white_noise(1200, 1.0, 1), white_noise(1200, noise, 2));
        let (a1, a2) = (-2.0 * (-0.05_f64).exp() * 0.2_f64.cos(), (-0.1_f64).exp());
        let mut y = vec![0.0; u.len()];
        for k in 2..u.len() {
            y[k] = -a1 * y[k - 1] - a2 * y[k - 2] + u[k - 1];
        }
        y.iter_mut().zip(e).for_each(|(y, e)| *y += e);
        (u, y)
    }

    #[test]
    fn products_give_the_triangle_of_a_factorisation() {
        let ((u, y), s) = (record(0.1), 10);
        let input = [&u[..], &white_noise(1200, 0.3, 3)].concat();
        for (u, inputs) in [(&u, 1), (&input, 2)] {
            let (fast, slow) = (triangle(u, &y, s).unwrap(), Qr::new(stacked(u, &y, s).unwrap()).r());
            // signs of rows, and the frame of the future inputs, are free: the products of what they leave are compared
            let rest = |r: &Mat<f64>| {
                let (first, last) = (r.ncols() - (inputs + 2) * s, r.ncols());
                let own = block(r, first..last, first..last);
                product(own.transpose(), own.as_ref())
            };
            let (fast, slow) = (rest(&fast), rest(&slow));
            let largest = (0..slow.ncols()).map(|i| slow[(i, i)]).fold(0.0, f64::max);
            // noise of a tenth leaves shares of some thousandths: twelve digits
            (0..slow.ncols()).for_each(|j| {
                (0..slow.nrows()).for_each(|i| assert!((fast[(i, j)] - slow[(i, j)]).abs() < 1e-12 * largest))
            });
        }
    }

    #[test]
    fn a_record_without_noise_is_left_to_the_factorisation() {
        let (u, y) = record(0.0);
        assert!(triangle(&u, &y, 10).is_none());
        let found = Instruments::new(&u, &y, 10).unwrap().subspace(Weight::Moesp).unwrap().poles(2).unwrap();
        assert!(
            found.iter().all(|z| (z.norm() - (-0.05_f64).exp()).abs() < 1e-9 && (z.arg().abs() - 0.2).abs() < 1e-9)
        );
    }
}

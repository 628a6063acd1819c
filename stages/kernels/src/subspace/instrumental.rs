//! Subspace identification with past inputs and outputs as instruments: N4SID, MOESP and CVA weights.

use std::ops::Range;

use crate::linear_algebra::{Qr, Svd, product};
use faer::Mat;

use super::past_future::{Subspace, input_basis};
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
    /// QR of `[1; U_f]`, past `[U_p; Y_p]`, `Y_f`; singular value decomposition of the part of `Y_f` that the past
    /// explains, weighted; A by shift invariance, in the least-squares sense.
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
        let r = Qr::new(stacked(u, y, s)?).r();
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
        let peak = signal.iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
        let level = if peak > 0.0 { peak } else { 1.0 };
        for j in 0..s {
            let column = stacked.col_mut(first + i * s + j);
            column.iter_mut().zip(&signal[offset + j..]).for_each(|(h, x)| *h = x / level);
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

//! Start values: exponentials of a free decay from its Hankel matrix.

use super::decay::centred_gram;
use crate::linear_algebra::{dot, eigenvalues, least_squares, product, solve};
use faer::{Mat, c64};

use super::modal_form::Exponential;
use crate::model::ModelError;

/// Poles of a decaying record, an offset allowed.
///
/// # Method
/// Shift invariance of the dominant column space of the Hankel matrix with `rows` rows, its rows' means removed. The
/// space comes from the eigenvectors of the Gram matrix, whose diagonals are running sums: `N rows` operations and one
/// eigenproblem of size `rows`.
/// # Accuracy
/// Signals below `1e-8` of the strongest are lost in the Gram matrix's rounding.
/// # Source
/// J.-N. Juang and R. S. Pappa, J. Guid. Control Dyn. 8 (1985) 620; S. Y. Kung, Proc. 12th Asilomar Conf. (1978) 705.
pub(super) fn decay_poles(values: &[f64], rows: usize, order: usize) -> Result<Vec<c64>, ModelError> {
    if values.len() < 3 * rows {
        return Err(ModelError::TooShort { found: values.len(), wanted: 3 * rows });
    }
    let space = dominant_space(&centred_gram(values, rows, dot), order)?;
    let upper = space.as_ref().get(..rows - 1, ..).to_owned();
    let lower = space.as_ref().get(1.., ..).to_owned();
    Ok(eigenvalues(&least_squares(&upper, &lower, f64::EPSILON)?)?)
}

/// Orthonormal columns that span the strongest `order` directions of a symmetric matrix.
fn dominant_space(gram: &Mat<f64>, order: usize) -> Result<Mat<f64>, ModelError> {
    let svd = crate::linear_algebra::Svd::new(gram)?;
    Ok(svd.u.as_ref().get(.., ..order).to_owned())
}

/// The `modes` strongest oscillating exponentials of a decay, and `real_poles` spread over the upper part of the
/// spectrum.
///
/// # Method
/// [`decay_poles`] at an order that leaves room, the amplitudes by least squares, the strongest kept by energy.
pub(super) fn start(
    values: &[f64],
    interval_s: f64,
    modes: usize,
    real_poles: usize,
    rows: usize,
) -> Result<Vec<Exponential>, ModelError> {
    let rows = rows.min(values.len() / 3);
    let order = (2 * modes + real_poles.max(1)).min(rows.saturating_sub(2));
    let poles = decay_poles(values, rows, order)?;
    let pairs: Vec<c64> = poles
        .iter()
        .filter(|z| z.im > 0.0 && z.norm() > 0.0)
        .map(|z| z.ln() / interval_s)
        .map(|s| c64::new(if s.re < 0.0 { s.re } else { -1e-3 * s.im }, s.im))
        .filter(|s| s.im > 2.0 * -s.re)
        .collect();
    if pairs.len() < modes {
        return Err(ModelError::Parameter {
            name: "modes",
            found: modes as f64,
            wanted: "at most the oscillations that the Hankel matrix shows",
        });
    }
    let mut all: Vec<Exponential> =
        pairs.iter().map(|&pole| Exponential { pole, residue: c64::new(0.0, 0.0) }).collect();
    all.extend(spread(real_poles, interval_s));
    amplitudes(&mut all, values, interval_s);
    let (mut oscillating, real): (Vec<_>, Vec<_>) = all.into_iter().partition(Exponential::oscillates);
    let energy = |e: &Exponential| e.residue.norm_sqr() / -e.pole.re;
    oscillating.sort_by(|a, b| energy(b).total_cmp(&energy(a)));
    oscillating.truncate(modes);
    oscillating.sort_by(|a, b| a.pole.im.total_cmp(&b.pole.im));
    oscillating.extend(real);
    amplitudes(&mut oscillating, values, interval_s);
    Ok(oscillating)
}

/// Real poles with `exp(pole interval)` from 0.2 downwards, each half of the one before.
fn spread(count: usize, interval_s: f64) -> impl Iterator<Item = Exponential> {
    (0..count).map(move |i| {
        let decay = -(0.2 * 0.5f64.powi(i as i32)).ln() / interval_s;
        Exponential { pole: c64::new(-decay, 0.0), residue: c64::new(0.0, 0.0) }
    })
}

/// Least-squares residues of given poles, an offset beside them.
///
/// Method: normal equations of columns scaled to unit length; three real poles beyond the sample rate are nearly
/// dependent, so a ridge of `1e-12` keeps them finite: start values need no more.
pub(super) fn amplitudes(exponentials: &mut [Exponential], values: &[f64], interval_s: f64) {
    let samples = values.len();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for e in exponentials.iter() {
        let step = (e.pole * interval_s).exp();
        let (mut re, mut im) = (vec![0.0; samples], vec![0.0; samples]);
        let mut z = c64::new(1.0, 0.0);
        for k in 0..samples {
            (re[k], im[k]) = (z.re, -z.im);
            z *= step;
            if z.norm_sqr() < 1e-280 {
                break;
            }
        }
        columns.push(re);
        if e.oscillates() {
            columns.push(im);
        }
    }
    columns.push(vec![1.0; samples]);
    let norms: Vec<f64> = columns.iter().map(|c| c.iter().map(|v| v * v).sum::<f64>().sqrt()).collect();
    let matrix = Mat::from_fn(samples, columns.len(), |i, j| columns[j][i] / norms[j]);
    let right = Mat::from_fn(samples, 1, |i, _| values[i]);
    let mut gram = product(matrix.transpose(), matrix.as_ref());
    (0..columns.len()).for_each(|i| gram[(i, i)] += 1e-12);
    let solved = solve(gram, &product(matrix.transpose(), right.as_ref()));
    let mut next = 0;
    for e in exponentials.iter_mut() {
        let re = solved[(next, 0)] / norms[next];
        let im = if e.oscillates() { solved[(next + 1, 0)] / norms[next + 1] } else { 0.0 };
        e.residue = c64::new(re, im);
        next += if e.oscillates() { 2 } else { 1 };
    }
}

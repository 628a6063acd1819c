//! Modes from measured frequency responses of many channels: frequencies, damping, complex mode shapes.
//!
//! # Model
//! Of response r, with `p = i w` plus the decay that an exponential window added, and the quantity's power q (0 for a
//! receptance, 1 for a mobility, 2 for an accelerance):
//!
//! `H_r = p^q ( sum_m A_rm / (p - s_m) + conj(A_rm) / (p - conj s_m) + L_r / p^2 + U_r )` (1)
//!
//! The poles `s_m` are common to all responses; residues A are complex, the residual terms L and U of modes below and
//! above the band real. Single real poles may be added.
//! # Method
//! Starts from polynomials in `z = exp(i pi (f - f_1) / (f_K - f_1))`, numerators N of each response and a common
//! denominator D: least `sum_r sum_k w_rk |N_r(z_k) - D(z_k) H_rk|^2` (2) with `D(0) = 1`. Then least
//! `sum_r sum_k w_rk |H_rk - model|^2` (3) over the poles alone, everything linear solved for. What a further pole may
//! gain: `t^T S^-1 t` (4), with its columns' products with the residual `t` and with each other `S`, those of the fit
//! eliminated.
//!
//! In reading order: options, data (lines and weights), noise (variance by bands), polynomial (Eq. 2), candidates,
//! model and projection (Eq. 1), fit (Eq. 3), lack (what a fit leaves), selection (how many modes), scatter (responses
//! that disagree), in_common (errors that responses share), result.
//!
//! ```
//! use afmid_kernels::c64;
//! use afmid_kernels::frf_modes::{FrfModel, FrfModesOptions, FrfQuantity, MeasuredResponses, frf_modes};
//!
//! // a beam of two modes, pushed at the first of three points; a little noise that repeats itself
//! let truth = FrfModel {
//!     poles: vec![c64::new(-8.0, 600.0), c64::new(-12.0, 1900.0)],
//!     residues: [[1.0, 1.0], [0.6, -0.4], [-0.3, 0.8]]
//!         .iter()
//!         .map(|row| row.iter().zip([600.0, 1900.0]).map(|(a, w)| c64::new(0.0, -a / (2.0 * w))).collect())
//!         .collect(),
//!     lower: vec![0.0; 3],
//!     upper: vec![1e-8; 3],
//!     quantity: FrfQuantity::Accelerance,
//!     added_decay_per_s: 0.0,
//! };
//! let frequency_hz: Vec<f64> = (40..800).map(|k| 0.5 * f64::from(k)).collect();
//! let noise = |k: usize, r: usize| 0.05 * c64::cis((k * k * (r + 3)) as f64);
//! let rows: Vec<Vec<c64>> = (0..3)
//!     .map(|r| truth.response(r, &frequency_hz).iter().enumerate().map(|(k, h)| h + noise(k, r)).collect())
//!     .collect();
//! let rows: Vec<&[c64]> = rows.iter().map(Vec::as_slice).collect();
//! let measured = MeasuredResponses { frequency_hz: &frequency_hz, transfer: &rows, variance: None, input_noise: None };
//! let options =
//!     FrfModesOptions { quantity: FrfQuantity::Accelerance, driving_point: Some(0), ..FrfModesOptions::default() };
//! let found = frf_modes(measured, &options).unwrap();
//! assert_eq!(found.modes.len(), 2);
//! let second = &found.modes[1];
//! let (f, damping) = (second.estimate.frequency_hz, second.estimate.damping_ratio());
//! let w = 1900.0_f64.hypot(12.0);
//! // five standard errors
//! assert!((f.value - w / std::f64::consts::TAU).abs() < 5.0 * f.std && f.std < 0.01);
//! assert!((damping.value - 12.0 / w).abs() < 5.0 * damping.std && damping.std < 1e-4);
//! // the third point at unit modal mass, with its error
//! let third = second.mass_normalised.as_ref().unwrap()[2];
//! assert!((third.value - 0.8).abs() < 5.0 * third.std);
//! ```

mod candidates;
mod data;
mod fit;
mod in_common;
mod lack;
mod model;
mod noise;
#[cfg(test)]
mod noise_tests;
mod options;
mod polynomial;
mod projection;
mod result;
mod scatter;
mod selection;
#[cfg(test)]
mod tests;

use faer::c64;

use self::candidates::{of_residual, stable};
use self::data::Lines;
use self::noise::{bands, from_residual};
use self::polynomial::diagram;
use self::projection::Projection;
use self::selection::Search;
use crate::model::ModelError;

pub use self::data::{FrfQuantity, Indicator, InputNoise, MeasuredResponses};
pub use self::model::FrfModel;
pub use self::options::FrfModesOptions;
pub use self::result::{FrfMode, FrfModes};

/// Lines from which on neighbours are merged where no pole is near. Why: a fit of more takes seconds.
const MANY: usize = 4000;
/// Times that all lines are searched for modes that means hide. Why: each finds up to six.
const PASSES: usize = 3;
/// Width of a merged stretch over its distance from the nearest pole while modes are sought: means are off by 4e-4.
const COARSE_SHARE: f64 = 0.1;
/// The same for the last fit: 4e-5 of what a pole gives there.
const FINE_SHARE: f64 = 0.03;

/// Fits modes to frequency responses: one set of poles for all responses.
///
/// # Model
/// Eq. 1 plus complex noise of the variance given; where none is given, of a variance that is constant over bands of at
/// least 40 lines, each response its own.
/// # Method
/// Starts: least squares of a common denominator (Eq. 2), orders 2 to `max_order`; poles with positive damping that are
/// stable in frequency and damping over four orders, and peaks of the residual. Of these the one with the largest gain
/// (Eq. 4) joins the fit, as long as an F test finds its gain above chance; in the end poles are dropped whose share of
/// the weighted squares is not above it, at the level of the residual around them and with its correlation counted;
/// whose damping is not above three standard errors; and, where the fit does not reach the noise, those within the
/// width of a mode with a hundred times their energy or within a line of a stronger one: responses that were measured
/// one after the other on a structure that had changed in between leave such pairs. Last fit: maximum likelihood by
/// variable projection (Eq. 3), the variance from its residual. Significant poles that are no modes of the band stay as
/// terms for what lies beyond it.
/// Of more than 4000 lines neighbours are merged where no pole is near. Cost per step: `R K (4 M + 2)^2` operations.
/// # Shapes
/// R responses, K lines, M poles.
/// # Units
/// Hertz, 1/s; residues in the responses' unit times 1/s for a receptance.
/// # Accuracy
/// docs/results/frf.md: rms errors at the Cramer-Rao bound, 95 % intervals that cover 94 to 96 %; with modes beyond the
/// band that are as strong as those in it, damping at 1.16 of the bound and 92 %. Standard errors count what the fit
/// leaves around each mode: a residual above the noise or one that neighbours share widens them, and so does a pole on
/// which the responses disagree.
/// # Errors
/// Lengths; fewer than 8 lines or values of a response; a response of zeros; a number out of range; no mode.
/// # Source
/// P. Guillaume et al., Proc. 21st IMAC (2003) (poly-reference least-squares complex frequency domain); H. Van der
/// Auweraer et al., J. Dyn. Syst. Meas. Control 123 (2001) 651 (common denominator); P. Verboven, PhD thesis, Vrije
/// Universiteit Brussel (2002); G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413.
pub fn frf_modes(measured: MeasuredResponses<'_>, options: &FrfModesOptions) -> Result<FrfModes, ModelError> {
    options.check(measured.transfer.len())?;
    let lines = Lines::new(measured, options)?;
    let diagram = diagram(&lines, options)?;
    let candidates = stable(&diagram, options);
    let seen = lines.seen();
    let many = lines.len() > MANY;
    let reals = real_starts(&lines, options);
    let start = if many { merged(&lines, &candidates, COARSE_SHARE) } else { lines.clone() };
    let (mut search, fit) = Search::new(start, &reals, options)?;
    let mut fit = search.run(fit, &candidates)?;
    for _ in 0..if many { PASSES } else { 0 } {
        // narrow modes hide in means: they are sought in all lines
        let further = missed(&lines, &fit.at.poles, options);
        let places: Vec<c64> = fit.at.poles.iter().chain(&further).copied().collect();
        (search, fit) = search.continued(merged(&lines, &places, FINE_SHARE), &fit)?;
        let before = fit.at.poles.len();
        fit = search.with_candidates(fit, &further)?;
        if fit.at.poles.len() == before {
            break;
        }
    }
    let fit = search.finished(fit)?;
    FrfModes::of(search, &fit, diagram, seen)
}

fn merged(lines: &Lines, poles: &[c64], share: f64) -> Lines {
    lines.thinned(poles, share, &bands(lines.len()))
}

/// Poles of what is left in all lines.
fn missed(lines: &Lines, poles: &[c64], options: &FrfModesOptions) -> Vec<c64> {
    let at = Projection::new(lines, poles, options);
    let left = at.left(lines, options);
    let lines = if lines.known { lines.clone() } else { lines.weighted(from_residual(lines, &at, &left)) };
    of_residual(&lines, &left, options)
}

/// Real poles spread over the band.
fn real_starts(lines: &Lines, options: &FrfModesOptions) -> Vec<c64> {
    let (first, last) = (lines.frequency_hz[0], lines.frequency_hz[lines.len() - 1]);
    let at = |i: usize| (i as f64 + 0.5) / options.real_poles as f64;
    let rate = |i: usize| std::f64::consts::TAU * first * (last / first).powf(at(i));
    (0..options.real_poles).map(|i| c64::new(-rate(i), 0.0)).collect()
}

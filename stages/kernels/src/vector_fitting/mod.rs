//! Vector fitting in the z plane: a rational transfer function through a measured frequency response.
//!
//! ```
//! use afmid_kernels::c64;
//! use afmid_kernels::modes::{ModeCriteria, poles};
//! use afmid_kernels::vector_fitting::{MeasuredResponse, VectorFitting, vector_fitting};
//! // the response of a resonance at 50 kHz with Q = 40, sampled at 1 MS/s, at 400 frequencies, with noise
//! let (w, a) = (std::f64::consts::TAU * 50e3 * 1e-6, std::f64::consts::PI * 50e3 / 40.0 * 1e-6);
//! let (a1, a2) = (-2.0 * (-a).exp() * w.cos(), (-2.0 * a).exp());
//! let frequency_hz: Vec<f64> = (1..=400).map(|k| 500.0 * f64::from(k)).collect();
//! let noise = |k: usize| 1e-3 * c64::new(((k * k) as f64).sin(), ((k * k + 7) as f64).sin());
//! let clean = |f: f64| {
//!     let z = c64::cis(std::f64::consts::TAU * f * 1e-6);
//!     z * 0.1 / ((z + a1) * z + a2)
//! };
//! let transfer: Vec<c64> = frequency_hz.iter().enumerate().map(|(k, f)| clean(*f) + noise(k)).collect();
//! let measured = MeasuredResponse { frequency_hz: &frequency_hz, transfer: &transfer, variance: None };
//! let fit = vector_fitting(measured, 1e-6, &VectorFitting { order: 2, ..VectorFitting::default() })?;
//! let mode = poles(&fit.model, &fit.covariance, &ModeCriteria::default())?[0].root;
//! assert!((mode.frequency_hz - 50e3 * (1.0 + 1.0 / 6400.0_f64).sqrt()).abs() < 5.0 * mode.frequency_std_hz);
//! # Ok::<(), afmid_kernels::model::ModelError>(())
//! ```

mod basis;
mod linear;
mod refine;
mod relocate;
mod start;
#[cfg(test)]
mod tests;

use faer::{Mat, c64};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::linear::{Points, residues};
use crate::model::{InnovationsModel, InputGains, ModelError};

/// A frequency response, point by point.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredResponse<'a> {
    /// Frequencies in hertz, 0 to half the sample rate.
    pub frequency_hz: &'a [f64],
    /// From the held input to the output, both as sequences; points that are not finite are left out.
    pub transfer: &'a [c64],
    /// Expected squared error of each value; none, or zero anywhere: all points count alike. Points without a finite
    /// variance are left out.
    pub variance: Option<&'a [f64]>,
}

/// What is fitted, and how far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct VectorFitting {
    /// Number of poles. Why: as in the paper: four modes and three detector poles.
    #[schemars(range(min = 1, max = 40))]
    pub order: usize,
    /// Oscillating pairs among the starting poles, at most half the order; the rest starts real. Absent: as many as
    /// fit. A fit that ends with another number warns: pairs and real poles may turn into each other.
    pub modes: Option<usize>,
    /// Relocations of the poles at most. Why: ten are usual.
    #[schemars(range(min = 1, max = 1000))]
    pub iterations: usize,
    /// End with Gauss-Newton on the weighted error. Why: without, errors are up to a seventh larger.
    pub refine: bool,
    /// Reflect poles from outside the unit circle into it. Why: an unstable pole says that the order is too high.
    pub stable: bool,
    /// Fits what the ends of the window add, for an input that is a pulse this many seconds after the first sample;
    /// default none.
    #[serde(skip)]
    pub transient_delay_s: Option<f64>,
    /// Bins over which neighbouring errors are correlated (a smoothed response); default 0.
    #[serde(skip)]
    pub correlated_bins: usize,
}

impl Default for VectorFitting {
    fn default() -> Self {
        Self {
            order: 11,
            modes: None,
            iterations: 30,
            refine: true,
            stable: false,
            transient_delay_s: None,
            correlated_bins: 0,
        }
    }
}

/// A rational transfer function with everything that its fit yields.
#[derive(Debug, Clone)]
pub struct VectorFit {
    /// The model; K = 0.
    pub model: InnovationsModel,
    /// Covariance of [`InnovationsModel::parameters`].
    pub covariance: Mat<f64>,
    /// The transient as a further input's gains, where it was fitted.
    pub transient: Option<InputGains>,
    /// Mean squared error over the variance given, per degree of freedom: one if variance and model are right; with
    /// equal weights the variance itself.
    pub misfit: f64,
    /// Share of the response's power (about its mean, weighted) that is explained, as FIT %.
    pub fit_percent: f64,
    /// Points that were used.
    pub points: usize,
    /// Relocations and Gauss-Newton steps of the start that won.
    pub iterations: usize,
    /// Whether the poles settled: gradient share below 1e-3, a last step that gained less than 1e-4 of a chi-square, or
    /// what is left is rounding.
    pub converged: bool,
    /// The residual's part along the parameters over its norm.
    pub gradient: f64,
    /// Poles outside the unit circle; zero with [`VectorFitting::stable`].
    pub unstable: usize,
    /// Factor of the covariance for correlated neighbours, at least 1.
    pub correlation_factor: f64,
}

/// Fits `G(z) = sum_m c_m / (z - p_m) + d` to a frequency response.
///
/// # Model
/// `G(exp(i w Ts))` plus complex noise of the variance given; with a transient `exp(i w delay) T(z)`, T of the same
/// poles. A sampled decay is rational in z, not in s, so the fit is made on the unit circle itself: no bilinear map, no
/// warping.
/// # Method
/// Relaxed vector fitting: `sigma(z) G = N(z)` with `sigma = sum c~_m / (z - p_m) + d~`, linear in everything; the
/// zeros of sigma are the next poles; instead of `d~ = 1` the sum of sigma over the points is fixed. From three sets of
/// starting poles (linear, logarithmic, at the peaks); then, as sigma weights the noise too, Gauss-Newton with a trust
/// region on the weighted error in section coefficients, all else eliminated (variable projection), from each; the
/// least error wins. One response has nothing to gain from block-wise QR. Cost per iteration: `4 K (3 n)^2` operations
/// for K points.
/// # Shapes
/// K points each; covariance (2 n + 1) x (2 n + 1).
/// # Units
/// Those of the response.
/// # Accuracy
/// Rounding without noise. With noise: the maximum of the likelihood for the variance given. Over 40 seeds of the
/// paper's lever (the mean of 84 events, 4096 samples) rms errors of f and Q are 0.2 to 0.4 of those of
/// [`Subspace::new`](crate::subspace::Subspace::new) with 60 rows and 0.6 to 0.8 of those of
/// [`Subspace::of_decay`](crate::subspace::Subspace::of_decay) with 300; any bias is below what 40 seeds show, 0.63 of a
/// standard error, and the squares of the errors are 0.7 to 1.3 of the stated ones (tests). The covariance is that of
/// the last linearised least squares, scaled by the misfit; for a smoothed response also by the residual's correlation.
/// # Errors
/// Lengths, settings out of range, too few points, no finite fit. No convergence is no error: see the fit.
/// # Source
/// B. Gustavsen, IEEE Trans. Power Delivery 21 (2006) 1587; B. Gustavsen and A. Semlyen, ibid. 14 (1999) 1052.
pub fn vector_fitting(
    response: MeasuredResponse<'_>,
    sample_time_s: f64,
    settings: &VectorFitting,
) -> Result<VectorFit, ModelError> {
    let points = checked(response, sample_time_s, settings)?;
    let mut best: Option<refine::Refined> = None;
    let mut problem = ModelError::Degenerate("no starting poles led to a finite model; another order or band may do");
    for start in start::starting_poles(&points, settings) {
        let fitted = relocate::relocated(&points, start, settings)
            .and_then(|(poles, steps)| refine::refined(&points, residues(&points, &poles)?, steps, settings));
        match fitted {
            Ok(fitted) if best.as_ref().is_none_or(|best| fitted.cost < best.cost) => best = Some(fitted),
            Ok(_) => {}
            Err(error) => problem = error,
        }
    }
    refine::concluded(&points, &best.ok_or(problem)?, settings)
}

fn checked(response: MeasuredResponse<'_>, sample_time_s: f64, settings: &VectorFitting) -> Result<Points, ModelError> {
    let n = settings.order;
    let range = |name, found: f64, ok: bool, wanted| {
        if ok { Ok(()) } else { Err(ModelError::Parameter { name, found, wanted }) }
    };
    range("sample_time_s", sample_time_s, sample_time_s > 0.0 && sample_time_s.is_finite(), "positive")?;
    range("order", n as f64, n >= 1, "at least 1")?;
    range("iterations", settings.iterations as f64, settings.iterations >= 1, "at least 1")?;
    let pairs = settings.modes.unwrap_or(0);
    range("modes", pairs as f64, 2 * pairs <= n, "at most half the order")?;
    if let Some(delay) = settings.transient_delay_s {
        range("transient_delay_s", delay, delay.is_finite(), "finite")?;
    }
    let points = Points::new(response, sample_time_s, settings.transient_delay_s)?;
    // half as many complex points as coefficients determine them; as many leave something to judge the fit by
    let wanted = points.coefficients(n);
    if points.len() < wanted {
        return Err(ModelError::TooFewPoints { found: points.len(), wanted });
    }
    Ok(points)
}

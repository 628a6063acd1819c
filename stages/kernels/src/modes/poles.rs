//! Poles, modes and zeros of an identified model, each with its standard error.

use faer::{Mat, c64};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::map::{Root, bilinear, deviation};
use crate::model::{InnovationsModel, ModelError, Section, transmission_zeros};

/// What a pole belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoleClass {
    /// A resonance of the lever.
    Mechanical,
    /// An established pair with a quality factor between 0.5 and the least one of a mode.
    Damped,
    /// A pair near which the response does not follow the input.
    Unexcited,
    /// Detector, electronics, slow wander: real, or strongly damped and not established.
    Detector,
    /// A complex pair that the data do not establish: too small, or its damping unknown.
    Doubtful,
    /// Real and negative in the z plane: no continuous counterpart.
    Nyquist,
    /// At z = 0: part of a delay, no continuous counterpart.
    Delay,
}

impl PoleClass {
    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mechanical => "mechanical",
            Self::Damped => "damped",
            Self::Unexcited => "unexcited",
            Self::Detector => "detector",
            Self::Doubtful => "doubtful",
            Self::Nyquist => "nyquist",
            Self::Delay => "delay",
        }
    }
}

/// A pole with what it contributes. Of a complex pair only the upper one is listed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pole {
    /// Frequency and damping.
    pub root: Root,
    /// What it belongs to.
    pub kind: PoleClass,
    /// Its section's part of the static gain `G(1)`; a section of two real poles counts as a whole, at each.
    pub static_share: f64,
    /// Standard error of the static share, for a t0 that is known; see
    /// [`share_error_from_onset`](super::share_error_from_onset).
    pub static_share_std: f64,
    /// Amplitude of its ringing after a released unit load, over the static gain: `A` in `2 Re(A exp(s t))`.
    pub amplitude: c64,
    /// Amplitude of its ringing after a released unit load, over its standard error (root of chi-square over two; `>=
    /// 0`).
    pub significance: f64,
}

/// What counts as a resonance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ModeCriteria {
    /// Least quality factor of a mode. Why: detector poles are real or strongly damped.
    #[schemars(extend("exclusiveMinimum" = 0.5))]
    pub min_quality_factor: f64,
    /// Highest frequency of a mode in Hz.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub max_frequency_hz: Option<f64>,
    /// Least amplitude of a mode's ringing over its standard error. Why: the best of thousands of noise frequencies
    /// reaches 5.
    #[schemars(range(min = 0.0))]
    pub min_significance: f64,
    /// Largest relative standard error of a mode's quality factor. Why: a line that does not decay is no mode.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub max_quality_factor_error: f64,
}

impl Default for ModeCriteria {
    fn default() -> Self {
        Self { min_quality_factor: 5.0, max_frequency_hz: None, min_significance: 6.0, max_quality_factor_error: 0.5 }
    }
}

/// All poles, ascending in frequency.
///
/// # Model
/// A section `(b1 z + b2) / (z^2 + a1 z + a2)` with the poles p: residue `R = (b1 p + b2) / (2 p + a1)`; its ringing
/// after a released load is `R / (1 - p)` times the load.
/// # Method
/// `s = ln(z) / Ts` pole by pole; standard errors by the delta method, with `dp/da1 = -p / (2p + a1)`, `dp/da2 = -1 /
/// (2p + a1)`.
/// # Shapes
/// `covariance`: (2n + 1) x (2n + 1), of [`InnovationsModel::parameters`].
/// # Units
/// Hertz; shares and quality factors have none.
/// # Accuracy
/// First order in the errors. Static shares are those of the partial fractions: a mode within the detector's roll-off
/// is turned and damped by it.
/// # Errors
/// A covariance of another shape.
/// # Source
/// Paper, text before Table I; L. Ljung, System Identification (1999), section 9.4.
pub fn poles(
    model: &InnovationsModel,
    covariance: &Mat<f64>,
    criteria: &ModeCriteria,
) -> Result<Vec<Pole>, ModelError> {
    let count = 2 * model.order() + 1;
    if covariance.shape() != (count, count) {
        return Err(ModelError::Length { what: "covariance", found: covariance.nrows(), wanted: count });
    }
    let one = c64::new(1.0, 0.0);
    let gain = model.transfer(one).re;
    let to_gain: Vec<f64> = model.transfer_sensitivities(one).iter().map(|d| d.re).collect();
    let mut found = Vec::new();
    let mut first = 0;
    for section in &model.sections {
        let indices =
            [first, first + section.order.min(2) - 1, model.order() + first, model.order() + first + section.order - 1];
        let share = section.transfer(one).re / gain;
        let own = |j: usize| {
            let local = j % model.order();
            j < 2 * model.order() && (first..first + section.order).contains(&local)
        };
        let to_share: Vec<f64> =
            to_gain.iter().enumerate().map(|(j, d)| (if own(j) { *d } else { 0.0 } - share * d) / gain).collect();
        let share_std = deviation(&to_share, covariance);
        for p in section.poles().into_iter().filter(|p| p.im >= 0.0) {
            let (slopes, amplitude, to_amplitude) = sensitivities(section, p, &indices, count);
            let root = Root::new(p, &slopes, covariance, model.sample_time_s);
            let significance = significance(amplitude, &to_amplitude, covariance);
            found.push(Pole {
                root,
                kind: classify(&root, significance, criteria),
                static_share: share,
                static_share_std: share_std,
                amplitude: amplitude / gain,
                significance,
            });
        }
        first += section.order;
    }
    found.sort_by(|x, y| x.root.frequency_hz.total_cmp(&y.root.frequency_hz));
    Ok(found)
}

/// `dp/dtheta`, the ringing amplitude and its derivatives.
fn sensitivities(section: &Section, p: c64, indices: &[usize; 4], count: usize) -> (Vec<c64>, c64, Vec<c64>) {
    let zero = c64::new(0.0, 0.0);
    let (mut slopes, mut to_amplitude) = (vec![zero; count], vec![zero; count]);
    let [a1, a2, b1, b2] = *indices;
    if section.order == 1 {
        let amplitude = section.b[0] / (1.0 - p);
        slopes[a1] = c64::new(-1.0, 0.0);
        to_amplitude[a1] = -amplitude / (1.0 - p);
        to_amplitude[b1] = (1.0 - p).inv();
        return (slopes, amplitude, to_amplitude);
    }
    let m = p * 2.0 + section.a[0];
    let residue = (p * section.b[0] + section.b[1]) / m;
    let amplitude = residue / (1.0 - p);
    slopes[a1] = -p / m;
    slopes[a2] = -m.inv();
    let along = |dp: c64, da1: f64| {
        let d_residue = (dp * section.b[0]) / m - residue * (dp * 2.0 + da1) / m;
        (d_residue + amplitude * dp) / (1.0 - p)
    };
    to_amplitude[a1] = along(slopes[a1], 1.0);
    to_amplitude[a2] = along(slopes[a2], 0.0);
    to_amplitude[b1] = p / m / (1.0 - p);
    to_amplitude[b2] = m.inv() / (1.0 - p);
    (slopes, amplitude, to_amplitude)
}

/// Root of `v^T S^-1 v` with v the real and imaginary part of the amplitude.
fn significance(amplitude: c64, slopes: &[c64], covariance: &Mat<f64>) -> f64 {
    let (re, im): (Vec<f64>, Vec<f64>) = slopes.iter().map(|d| (d.re, d.im)).unzip();
    let (rr, ri, ii) = (bilinear(&re, covariance, &re), bilinear(&re, covariance, &im), bilinear(&im, covariance, &im));
    if amplitude.im == 0.0 && ii == 0.0 {
        return if rr > 0.0 { amplitude.re.abs() / rr.sqrt() } else { 0.0 };
    }
    let determinant = rr * ii - ri * ri;
    let square = (ii * amplitude.re * amplitude.re - 2.0 * ri * amplitude.re * amplitude.im
        + rr * amplitude.im * amplitude.im)
        / determinant;
    if square.is_finite() && square > 0.0 { square.sqrt() } else { 0.0 }
}

fn classify(root: &Root, significance: f64, criteria: &ModeCriteria) -> PoleClass {
    if root.z.norm_sqr() == 0.0 {
        return PoleClass::Delay;
    }
    if !root.is_complex() {
        return if root.z.re < 0.0 { PoleClass::Nyquist } else { PoleClass::Detector };
    }
    let established = significance >= criteria.min_significance
        && root.quality_factor_std <= criteria.max_quality_factor_error * root.quality_factor
        && criteria.max_frequency_hz.is_none_or(|most| root.frequency_hz <= most);
    match (root.quality_factor < criteria.min_quality_factor, established) {
        (false, true) => PoleClass::Mechanical,
        (false, false) => PoleClass::Doubtful,
        // what grows has a negative one
        (true, true) if root.quality_factor > 0.5 => PoleClass::Damped,
        (true, _) => PoleClass::Detector,
    }
}

/// All transmission zeros, ascending in frequency, with standard errors; of a pair only the upper one.
///
/// Method: implicit function theorem, `dz/dtheta = -(dG/dtheta) / (dG/dz)` at the zero. Errors: see
/// [`transmission_zeros`], and a covariance of another shape.
pub fn zeros(model: &InnovationsModel, covariance: &Mat<f64>) -> Result<Vec<Root>, ModelError> {
    let count = 2 * model.order() + 1;
    if covariance.shape() != (count, count) {
        return Err(ModelError::Length { what: "covariance", found: covariance.nrows(), wanted: count });
    }
    let mut found: Vec<Root> = transmission_zeros(model)?
        .into_iter()
        .filter(|zero| zero.im >= 0.0)
        .map(|zero| {
            let slope = model.transfer_slope(zero);
            let slopes: Vec<c64> = model.transfer_sensitivities(zero).iter().map(|d| -d / slope).collect();
            Root::new(zero, &slopes, covariance, model.sample_time_s)
        })
        .collect();
    found.sort_by(|x, y| x.frequency_hz.total_cmp(&y.frequency_hz));
    Ok(found)
}

//! What a fitted model's residual says of it.

use faer::Mat;

use super::model::BlockModel;
use super::options::BlockError;
use super::result::{BlockFit, Tried};
use super::screening::{Candidate, Stretch};
use super::start::Linear;
use crate::linear_algebra::product;
use crate::pem::{ResidualColour, time_domain_covariance};

/// Abscissas of the curve that are kept.
const USED: usize = 2048;

/// How a candidate is listed.
pub(super) fn described(candidate: &Candidate, on_all: bool) -> Tried {
    let list = |part: &super::Rational| {
        let poles = part.poles().into_iter().filter(|z| z.im >= 0.0);
        let named = |z: faer::c64| match z.im {
            0.0 => format!("{:.4}", z.re),
            im => format!("{:.4}+-{:.4}i", z.re, im),
        };
        poles.map(named).collect::<Vec<_>>().join(" ")
    };
    let description = format!("{} | {}", list(&candidate.model.first), list(&candidate.model.second));
    Tried { structure: candidate.structure, description, rms: candidate.mean_square.sqrt(), on_all }
}

/// The candidate with its covariance. Errors: not finite.
pub(super) fn concluded(
    best: Candidate,
    whole: Stretch<'_>,
    linear: &Linear,
    tried: Vec<Tried>,
) -> Result<BlockFit, BlockError> {
    let model = best.model.normalised(whole.u);
    let (output, columns) = model.sensitivities(whole.u);
    let scored = whole.skipped..whole.y.len();
    let slices: Vec<&[f64]> = columns.iter().map(|column| &column[scored.clone()]).collect();
    let residual: Vec<f64> = scored.clone().map(|t| whole.y[t] - output[t]).collect();
    let covariance = time_domain_covariance(&slices, &residual, &[residual.len()], ResidualColour::Spectrum)?;
    let rms = |e: &[f64]| (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt();
    let before = model.first.filter(whole.u);
    let stride = scored.len().div_ceil(USED).max(1);
    let used = before[scored.clone()].iter().step_by(stride).copied().collect();
    let curve_covariance = curve_covariance(&model, whole, &covariance);
    Ok(BlockFit {
        structure: best.structure,
        training_rms: rms(&residual),
        linear_rms: rms(linear.residual.get(scored).unwrap_or_default()),
        model,
        covariance,
        curve_covariance,
        tried,
        used,
    })
}

/// Covariance of the curve's values where both parts leave the standard deviation of their input as it is.
fn curve_covariance(model: &BlockModel, stretch: Stretch<'_>, covariance: &Mat<f64>) -> Mat<f64> {
    let (before, to_first) = model.first.sensitivities(stretch.u);
    let (output, to_second) = model.second.sensitivities(&model.curve.of(&before));
    let (wider, larger) = (growth(&before, &to_first, stretch.skipped), growth(&output, &to_second, stretch.skipped));
    let (knots, values) = (model.curve.knots(), model.curve.values());
    let slopes = model.curve.slope_of(&knots);
    let behind = wider.len() + values.len();
    let to_values = Mat::from_fn(values.len(), behind + larger.len(), |k, j| {
        if j < wider.len() {
            slopes[k] * knots[k] * wider[j]
        } else if j < behind {
            f64::from(u8::from(j == wider.len() + k))
        } else {
            values[k] * larger[j - behind]
        }
    });
    let half = product(to_values.as_ref(), covariance.as_ref());
    product(half.as_ref(), to_values.transpose())
}

/// Relative change of a signal's standard deviation along each of its derivatives.
fn growth(signal: &[f64], derivatives: &[Vec<f64>], skipped: usize) -> Vec<f64> {
    let scored = &signal[skipped..];
    let mean = scored.iter().sum::<f64>() / scored.len() as f64;
    let along = |other: &[f64]| scored.iter().zip(other).map(|(s, o)| (s - mean) * o).sum::<f64>();
    let power = along(scored).max(f64::MIN_POSITIVE);
    derivatives.iter().map(|column| along(&column[skipped..]) / power).collect()
}

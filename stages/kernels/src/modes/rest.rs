//! Gain and delay of an identified model at rest.

use faer::{Mat, c64};

use super::map::deviation;
use crate::model::{InnovationsModel, ModelError};

/// What a slow input meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtRest {
    /// `G(1)`, the static gain.
    pub gain: f64,
    /// Its standard error.
    pub gain_std: f64,
    /// Group delay at zero frequency, `-Ts G'(1) / G(1)`: from sequence to sequence, so that a held input counts half a
    /// sample.
    pub delay_s: f64,
    /// Its standard error.
    pub delay_std_s: f64,
}

/// Static gain and delay, by the delta method. Errors: a covariance of another shape than
/// [`InnovationsModel::parameters`] wants.
pub fn at_rest(model: &InnovationsModel, covariance: &Mat<f64>) -> Result<AtRest, ModelError> {
    let count = 2 * model.order() + 1;
    if covariance.shape() != (count, count) {
        return Err(ModelError::Length { what: "covariance", found: covariance.nrows(), wanted: count });
    }
    let one = c64::new(1.0, 0.0);
    let (gain, slope) = (model.transfer(one).re, model.transfer_slope(one).re);
    let to_gain: Vec<f64> = model.transfer_sensitivities(one).iter().map(|d| d.re).collect();
    let to_slope = model.transfer_slope_sensitivities(one);
    // d(G'/G) = (dG' - G'/G dG) / G
    let to_delay =
        |(to_slope, to_gain): (&c64, &f64)| -model.sample_time_s * (to_slope.re - slope / gain * to_gain) / gain;
    let to_delay: Vec<f64> = to_slope.iter().zip(&to_gain).map(to_delay).collect();
    Ok(AtRest {
        gain,
        gain_std: deviation(&to_gain, covariance),
        delay_s: -model.sample_time_s * slope / gain,
        delay_std_s: deviation(&to_delay, covariance),
    })
}

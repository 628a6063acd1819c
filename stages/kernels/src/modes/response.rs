//! Frequency response of an identified model, with its band.

use faer::{Mat, c64};

use super::map::bilinear;
use crate::model::{InnovationsModel, ModelError};

/// `G(exp(i w Ts))` at one frequency, and the covariance of its real and imaginary part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponsePoint {
    /// In hertz.
    pub frequency_hz: f64,
    /// G.
    pub value: c64,
    /// Variance of the real part.
    pub variance_re: f64,
    /// Variance of the imaginary part.
    pub variance_im: f64,
    /// Covariance of the two.
    pub covariance: f64,
}

impl ResponsePoint {
    /// Standard error of |G|, to first order.
    pub fn magnitude_std(&self) -> f64 {
        let unit = self.value / self.value.norm();
        let variance = unit.re * unit.re * self.variance_re
            + 2.0 * unit.re * unit.im * self.covariance
            + unit.im * unit.im * self.variance_im;
        variance.max(0.0).sqrt()
    }

    /// Standard error of the phase in radians, to first order.
    pub fn phase_std_rad(&self) -> f64 {
        let unit = self.value / self.value.norm();
        let variance = unit.im * unit.im * self.variance_re - 2.0 * unit.re * unit.im * self.covariance
            + unit.re * unit.re * self.variance_im;
        variance.max(0.0).sqrt() / self.value.norm()
    }
}

/// The response at each frequency, by the delta method. Errors: a covariance of another shape than
/// [`InnovationsModel::parameters`] wants.
pub fn response(
    model: &InnovationsModel,
    covariance: &Mat<f64>,
    frequencies_hz: &[f64],
) -> Result<Vec<ResponsePoint>, ModelError> {
    let count = 2 * model.order() + 1;
    if covariance.shape() != (count, count) {
        return Err(ModelError::Length { what: "covariance", found: covariance.nrows(), wanted: count });
    }
    Ok(frequencies_hz
        .iter()
        .map(|&frequency_hz| {
            let z = c64::cis(std::f64::consts::TAU * frequency_hz * model.sample_time_s);
            let (re, im): (Vec<f64>, Vec<f64>) = model.transfer_sensitivities(z).iter().map(|d| (d.re, d.im)).unzip();
            ResponsePoint {
                frequency_hz,
                value: model.transfer(z),
                variance_re: bilinear(&re, covariance, &re),
                variance_im: bilinear(&im, covariance, &im),
                covariance: bilinear(&re, covariance, &im),
            }
        })
        .collect())
}

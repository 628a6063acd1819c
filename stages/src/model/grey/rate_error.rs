//! What the error of the sample rate adds to that of the parameters.

use afmid_kernels::grey::{Grey, GreyHold, GreyQuantity};

use crate::artifacts::RateError;

/// Adds it to parameters and their covariance: frequencies and corners scale with the rate, the delay with one over it,
/// all together. What was given stays as it was given.
pub(super) fn widen(fit: &mut Grey, rate_error: RateError) {
    let slope = |quantity: GreyQuantity| match quantity {
        GreyQuantity::Frequency(_) | GreyQuantity::RealPole(_) => 1.0,
        GreyQuantity::Delay => -1.0,
        GreyQuantity::QualityFactor(_) | GreyQuantity::Gain { .. } | GreyQuantity::Feedthrough(_) => 0.0,
    };
    let changes: Vec<f64> = fit
        .parameters
        .iter()
        .map(|p| {
            if p.hold == GreyHold::Free { slope(p.quantity) * p.estimate.value * rate_error.relative_std } else { 0.0 }
        })
        .collect();
    for (i, change) in changes.iter().enumerate() {
        for (j, other) in changes.iter().enumerate() {
            fit.covariance[(i, j)] += change * other;
        }
    }
    for (parameter, change) in fit.parameters.iter_mut().zip(&changes).filter(|(_, change)| **change != 0.0) {
        parameter.estimate.std = parameter.estimate.std.hypot(*change);
    }
}

//! From the contact slope to the optical lever sensitivity.

use super::contact_slope::ContactSlope;
use super::error::CalibrationError;
use serde::{Deserialize, Serialize};

/// A number with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub std: f64,
}

/// The piezo's calibration and, where known, the springs in series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlopeGauge {
    /// Metres of travel per monitored volt.
    pub piezo_m_per_v: Estimate,
    /// Contact stiffness, N/m; `None`: rigid as far as is known.
    pub contact_stiffness_n_per_m: Option<f64>,
    /// Lever stiffness, N/m, for the correction.
    pub stiffness_n_per_m: Option<f64>,
}

/// The optical lever sensitivity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// As the slope reads, V/m: too low where the contact gives way.
    pub apparent_v_per_m: Estimate,
    /// Corrected for the contact, V/m; the apparent one where the contact is unknown.
    pub corrected_v_per_m: Estimate,
    /// `1 + k / k_contact`; 1 where unknown.
    pub contact_factor: f64,
}

/// Sensitivity from the slope.
///
/// # Model
/// The piezo's travel is shared by lever and contact in series: `|dV/dz| = S k_c / (k + k_c)`, so `S = |dV/dz| (1 + k /
/// k_c)`. 60 N/m under 3.8 N/m: the slope reads 6.0 % low, and a spring constant taken from it, which goes as `S^2`,
/// 11.6 % low: it must be multiplied by 1.13.
///
/// # Errors
/// Stiffnesses or piezo calibration not above zero.
pub fn sensitivity(slope: &ContactSlope, gauge: SlopeGauge) -> Result<Sensitivity, CalibrationError> {
    let piezo = gauge.piezo_m_per_v;
    positive("piezo_m_per_v", piezo.value)?;
    let value = slope.slope_v_per_v.abs() / piezo.value;
    let relative = (slope.slope_std_v_per_v / slope.slope_v_per_v).hypot(piezo.std / piezo.value);
    let apparent = Estimate { value, std: value * relative };
    let contact_factor = match (gauge.contact_stiffness_n_per_m, gauge.stiffness_n_per_m) {
        (Some(contact), Some(lever)) => {
            positive("contact_stiffness_n_per_m", contact)?;
            positive("stiffness_n_per_m", lever)?;
            1.0 + lever / contact
        }
        _ => 1.0,
    };
    let corrected = Estimate { value: value * contact_factor, std: apparent.std * contact_factor };
    Ok(Sensitivity { apparent_v_per_m: apparent, corrected_v_per_m: corrected, contact_factor })
}

pub(super) fn positive(name: &'static str, value: f64) -> Result<(), CalibrationError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(CalibrationError::Value { name, got: value, wanted: "wanted a number above 0" })
    }
}

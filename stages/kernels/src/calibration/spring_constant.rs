//! The spring constant from thermal motion.

use super::error::CalibrationError;
use super::sensitivity_model::{Estimate, positive};
use std::f64::consts::PI;

/// Boltzmann constant, J/K (exact in the SI).
const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;

/// What the thermal method needs beside the peak.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalGauge {
    /// Sensitivity, V/m: corrected, or as the contact slope reads it if `contact_stiffness_n_per_m` is to correct it
    /// here.
    pub sensitivity_v_per_m: Estimate,
    /// Contact stiffness for a joint correction; `None`: the sensitivity is taken as it is.
    pub contact_stiffness_n_per_m: Option<Estimate>,
    /// Temperature, K.
    pub temperature_k: Estimate,
    /// `c_slope_1^2 / c_tip_1`.
    pub mode_shape_factor: Estimate,
    /// Detector poles, Hz: they attenuate the peak.
    pub detector_pole_hz: Vec<f64>,
}

/// The spring constant, with what it came from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringConstant {
    /// Static stiffness at the tip, N/m.
    pub stiffness_n_per_m: Estimate,
    /// Without the contact's correction, N/m; equal to the above where there is none.
    pub apparent_n_per_m: f64,
    /// Sensitivity consistent with the stiffness, V/m.
    pub sensitivity_v_per_m: Estimate,
    /// `|D(f1)|^2` of the detector poles, by which the peak's variance was divided.
    pub attenuation: f64,
    /// Shares of the relative error, before a soft contact makes them grow: peak, sensitivity, temperature, mode shape,
    /// contact.
    pub relative_errors: [f64; 5],
}

/// Stiffness from the variance of the signal in mode 1.
///
/// # Model
/// Equipartition gives mode n of a lever driven at its tip the stiffness `k_n = k / c_tip_n` and `<q_n^2> = c_tip_n k_B
/// T / k`. The detector sees `v_n = S (c_slope_n / c_tip_n) q_n`. Hence `<v_1^2> = S^2 (c_slope_1^2 / c_tip_1) k_B T /
/// k`, and `k = S^2 chi k_B T |D(f1)|^2 / <v_1^2>` with `chi = c_slope_1^2 / c_tip_1` (0.8175 for a uniform beam seen
/// by its end slope: `c_tip_1 = 0.9707`, `c_slope_1 = 0.8908`). With a soft contact `S = S_a (1 + k/k_c)`; `r = S_a^2
/// chi k_B T |D|^2 / <v_1^2>` then gives `k = r (1 + k/k_c)^2`, of which the smaller root is the spring constant.
///
/// # Accuracy
/// First-order error propagation. With a soft contact its own relative error counts `2 x / (1 + x)` times, `x = k/k_c`, and
/// all of them grow by `(1 + x) / (1 - x)`.
///
/// # Errors
/// Arguments not above zero; a contact too soft for any lever (`r >= k_c / 4`).
///
/// # Source
/// H.-J. Butt and M. Jaschke, Nanotechnology 6 (1995) 1.
pub fn spring_constant(
    frequency_hz: f64,
    variance_v2: Estimate,
    gauge: &ThermalGauge,
) -> Result<SpringConstant, CalibrationError> {
    let (sensitivity, temperature, factor) = (gauge.sensitivity_v_per_m, gauge.temperature_k, gauge.mode_shape_factor);
    for (name, value) in [
        ("variance of mode 1", variance_v2.value),
        ("sensitivity_v_per_m", sensitivity.value),
        ("temperature_k", temperature.value),
        ("mode_shape_factor", factor.value),
    ] {
        positive(name, value)?;
    }
    let attenuation = attenuation(frequency_hz, &gauge.detector_pole_hz);
    let thermal = BOLTZMANN_J_PER_K * temperature.value;
    let apparent = sensitivity.value.powi(2) * factor.value * thermal * attenuation / variance_v2.value;
    let (x, contact_relative) = match gauge.contact_stiffness_n_per_m {
        None => (0.0, 0.0),
        Some(contact) => {
            positive("contact_stiffness_n_per_m", contact.value)?;
            let ratio = apparent / contact.value;
            if ratio >= 0.25 {
                return Err(CalibrationError::Value {
                    name: "contact_stiffness_n_per_m",
                    got: contact.value,
                    wanted: "wanted more than four times the apparent spring constant: no lever gives this slope over a softer contact",
                });
            }
            // x = k/k_c solves x = ratio (1 + x)^2: the smaller root without a difference of numbers that are almost equal
            let x = 2.0 * ratio / (1.0 - 2.0 * ratio + (1.0 - 4.0 * ratio).sqrt());
            (x, contact.std / contact.value)
        }
    };
    let growth = (1.0 + x) / (1.0 - x);
    let relative_errors = [
        variance_v2.std / variance_v2.value,
        2.0 * sensitivity.std / sensitivity.value,
        temperature.std / temperature.value,
        factor.std / factor.value,
        2.0 * x / (1.0 + x) * contact_relative,
    ];
    let norm = |errors: &[f64]| errors.iter().map(|e| e * e).sum::<f64>().sqrt();
    let stiffness = gauge.contact_stiffness_n_per_m.map_or(apparent, |contact| contact.value * x);
    let stiffness_std = stiffness * norm(&relative_errors) * growth;
    // the correction is as uncertain as k from all else, and as the contact, which k follows
    let correction_std =
        sensitivity.value * x * (norm(&relative_errors[..4]) * growth).hypot((1.0 + x) / (1.0 - x) * contact_relative);
    Ok(SpringConstant {
        stiffness_n_per_m: Estimate { value: stiffness, std: stiffness_std },
        apparent_n_per_m: apparent,
        sensitivity_v_per_m: Estimate {
            value: sensitivity.value * (1.0 + x),
            std: (sensitivity.std * (1.0 + x)).hypot(correction_std),
        },
        attenuation,
        relative_errors,
    })
}

/// `prod 1 / (1 + (f/p)^2)`.
fn attenuation(frequency_hz: f64, pole_hz: &[f64]) -> f64 {
    pole_hz.iter().map(|p| 1.0 / (1.0 + (frequency_hz / p).powi(2))).product()
}

/// The mode-shape factor of a uniform beam seen by the slope of its end.
///
/// # Model
/// `c_tip_1 = 12 / alpha^4 = 0.9707` (`alpha = 1.8751`, first root of `1 + cos cosh = 0`). Mode 1 has 1.3765/L of end
/// slope per end displacement, the statically bent beam 1.5/L: `c_slope_1 = 0.9707 * 1.3765 / 1.5 = 0.8908`; `0.8908^2
/// / 0.9707 = 0.8175`.
pub const UNIFORM_BEAM_FACTOR: f64 = 0.8175;

/// Decay time of a mode's amplitude, s: `Q / (pi f)`.
pub fn ringdown_s(frequency_hz: f64, quality_factor: f64) -> f64 {
    quality_factor / (PI * frequency_hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exact(value: f64) -> Estimate {
        Estimate { value, std: 0.0 }
    }

    #[test]
    fn joint_correction_undoes_the_soft_contact() {
        let (k, k_c, s, chi) = (3.8, 60.0, 1e7, 0.830);
        let variance = exact(s * s * chi * BOLTZMANN_J_PER_K * 295.0 / k);
        let mut gauge = ThermalGauge {
            sensitivity_v_per_m: exact(s / (1.0 + k / k_c)),
            contact_stiffness_n_per_m: None,
            temperature_k: exact(295.0),
            mode_shape_factor: Estimate { value: chi, std: 0.01 * chi },
            detector_pole_hz: vec![],
        };
        let apparent = spring_constant(46.3e3, variance, &gauge).unwrap();
        // (1 + k/k_c)^-2 = 0.8844: 11.6 % low; to be multiplied by 1.13
        assert!((apparent.stiffness_n_per_m.value / k - 0.8844).abs() < 1e-4);
        gauge.contact_stiffness_n_per_m = Some(exact(k_c));
        let corrected = spring_constant(46.3e3, variance, &gauge).unwrap();
        assert!((corrected.stiffness_n_per_m.value / k - 1.0).abs() < 1e-12);
        assert!((corrected.sensitivity_v_per_m.value / s - 1.0).abs() < 1e-12);
        let (relative, x) = (corrected.stiffness_n_per_m.std / k, k / k_c);
        assert!((relative / (0.01 * (1.0 + x) / (1.0 - x)) - 1.0).abs() < 1e-9);
        // a contact that is another by 1 %: k and the sensitivity move as their errors say
        let of_contact = |value: f64, std: f64| {
            let contact_stiffness_n_per_m = Some(Estimate { value, std });
            let mode_shape_factor = exact(chi);
            spring_constant(
                46.3e3,
                variance,
                &ThermalGauge { contact_stiffness_n_per_m, mode_shape_factor, ..gauge.clone() },
            )
            .unwrap()
        };
        let (stated, moved) = (of_contact(k_c, 0.01 * k_c), of_contact(1.01 * k_c, 0.0));
        let step = |of: fn(&SpringConstant) -> Estimate| (of(&moved).value - of(&stated).value).abs() / of(&stated).std;
        // the second order of 1 %
        assert!((step(|k| k.stiffness_n_per_m) - 1.0).abs() < 0.02);
        assert!((step(|k| k.sensitivity_v_per_m) - 1.0).abs() < 0.02);
        // what is stiffer by any factor is rigid in the limit: a part of 2 k/k_c beside what rounding leaves
        let k = apparent.stiffness_n_per_m;
        for contact in (2..=300).map(|power| 10_f64.powi(power)) {
            let found = of_contact(contact, 0.0);
            let away = found.stiffness_n_per_m.value / k.value - 1.0;
            let limit = 2.0 * k.value / contact;
            assert!((away - limit).abs() < 3.0 * limit * limit + 1e-14, "{contact}: {away}");
            assert!(found.sensitivity_v_per_m.value >= gauge.sensitivity_v_per_m.value, "{contact}");
        }
        gauge.contact_stiffness_n_per_m = Some(exact(1e15));
        let std = spring_constant(46.3e3, variance, &gauge).unwrap().stiffness_n_per_m.std;
        assert!((std / k.std - 1.0).abs() < 1e-12);
        gauge.contact_stiffness_n_per_m = Some(exact(10.0));
        assert!(spring_constant(46.3e3, variance, &gauge).is_err());
    }

    #[test]
    fn detector_poles_attenuate_the_peak() {
        // 46.3 kHz under 1.3, 1.9 and 2.4 MHz: 0.127 + 0.059 + 0.037 %
        assert!((attenuation(46.3e3, &[1.3e6, 1.9e6, 2.4e6]) - 0.99777).abs() < 1e-5);
    }
}

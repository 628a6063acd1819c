//! The optical readout: sensitivity, electronics, delay.

use super::error::{SimulateError, require};

/// What turns the lever's slope into volts.
///
/// # Model
/// `v = sensitivity D(s) exp(-s delay) s`, with `D` a chain of real poles `w_i / (s + w_i)`.
/// The poles belong to the propagated state (exact); the delay shifts the instants at which the state is read (exact
/// for any fraction of a sample).
#[derive(Debug, Clone, PartialEq)]
pub struct Detector {
    /// Optical lever sensitivity, V per m of static tip deflection.
    pub sensitivity_v_per_m: f64,
    /// Real poles, Hz.
    pub pole_hz: Vec<f64>,
    /// Delay of the deflection channel, s.
    pub delay_s: f64,
}

impl Detector {
    /// Every parameter's range.
    pub fn check(&self) -> Result<(), SimulateError> {
        let sensitivity = self.sensitivity_v_per_m;
        require("sensitivity_v_per_m", sensitivity, sensitivity > 0.0, "wanted above 0")?;
        require("delay_s", self.delay_s, self.delay_s >= 0.0, "wanted 0 or more")?;
        for &pole in &self.pole_hz {
            require("detector_poles_hz", pole, pole > 0.0, "wanted above 0")?;
        }
        Ok(())
    }
}

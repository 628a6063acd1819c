//! The modal lever.

use super::error::{SimulateError, require};

/// One flexural mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Undamped natural frequency, Hz.
    pub frequency_hz: f64,
    /// Quality factor, above 1/2.
    pub quality_factor: f64,
    /// Share of the static displacement of the tip under a force at the tip (`c_tip`; the shares sum to one).
    pub tip_share: f64,
    /// Share of the static detector signal under a force at the tip (`c_slope`; the shares sum to one).
    pub detector_share: f64,
}

/// A lever as the sum of its modes, driven at its tip.
///
/// # Model
/// `q_n'' + (w_n/Q_n) q_n' + w_n^2 q_n = w_n^2 (F + F_n) / k_n` with the modal stiffness `k_n = k / tip_share_n`:
/// `q_n` is the mode's part of the displacement of the tip, `sum q_n` the tip's. The photodiode sees
/// `s = sum (detector_share_n / tip_share_n) q_n`, so that a static force gives `x = s = F / k`.
/// `F_n` is the mode's own thermal force, white with two-sided density `2 k_B T k_n / (w_n Q_n)`; by equipartition
/// `<q_n^2> = k_B T / k_n`. The base moves so slowly that its inertia is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalLever {
    /// Static stiffness at the tip, N/m.
    pub stiffness_n_per_m: f64,
    /// The modes; any number but none.
    pub modes: Vec<Mode>,
}

/// Shares may miss one by rounding of their decimal digits.
const SHARE_TOLERANCE: f64 = 1e-6;

impl ModalLever {
    /// Every parameter's range.
    pub fn check(&self) -> Result<(), SimulateError> {
        require("stiffness_n_per_m", self.stiffness_n_per_m, self.stiffness_n_per_m > 0.0, "wanted above 0")?;
        if self.modes.is_empty() {
            return Err(SimulateError::parameter("frequencies_hz", 0, "wanted at least one mode"));
        }
        for mode in &self.modes {
            require("frequencies_hz", mode.frequency_hz, mode.frequency_hz > 0.0, "wanted above 0")?;
            require(
                "quality_factors",
                mode.quality_factor,
                mode.quality_factor > 0.5,
                "wanted above 0.5 (oscillating)",
            )?;
            require("tip_shares", mode.tip_share, mode.tip_share > 0.0, "wanted above 0")?;
            require("detector_shares", mode.detector_share, true, "wanted a number")?;
        }
        for (name, sum) in [
            ("tip_shares", self.modes.iter().map(|m| m.tip_share).sum::<f64>()),
            ("detector_shares", self.modes.iter().map(|m| m.detector_share).sum::<f64>()),
        ] {
            require(name, sum, (sum - 1.0).abs() < SHARE_TOLERANCE, "their sum must be 1: divide each by it")?;
        }
        Ok(())
    }

    /// `k_n = k / tip_share_n`, N/m.
    pub fn modal_stiffness_n_per_m(&self, mode: &Mode) -> f64 {
        self.stiffness_n_per_m / mode.tip_share
    }
}

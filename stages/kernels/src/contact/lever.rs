//! The free lever as its tip sees it.

use faer::c64;
use std::f64::consts::TAU;

use crate::model::ModelError;
use crate::ringdown::{Estimate, ModeEstimate};

/// The free lever: stiffness, modes, and what each mode has of the tip's static compliance.
///
/// # Model
/// `G(s) = (1/k) (sum_n c_n w_n^2 / (s^2 + w_n/Q_n s + w_n^2) + 1 - sum_n c_n)`, m/N: tip displacement over tip force.
/// What the shares leave of one is the compliance of all higher modes, taken as static.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeLever {
    pub(super) stiffness_n_per_m: Estimate,
    pub(super) modes: Vec<ModeEstimate>,
    pub(super) tip_share: Vec<f64>,
    pub(super) tip_share_error: f64,
}

/// Shares may exceed one by rounding of their decimal digits.
const SHARE_TOLERANCE: f64 = 1e-6;

/// `G`, its derivative by `s`, and by each of [`FreeLever::parameters`].
pub(super) struct Compliance {
    pub value: c64,
    pub by_s: c64,
    pub by_parameter: Vec<c64>,
}

impl FreeLever {
    /// A lever of `stiffness` (N/m) with `modes` and as many `tip_share`s, each but the first known to the relative
    /// standard error `tip_share_error`; the first makes up for the others' errors, as the sum is known.
    ///
    /// # Errors
    /// No mode, unequal numbers, values that are not above zero, shares that sum to more than one.
    pub fn new(
        stiffness: Estimate,
        modes: Vec<ModeEstimate>,
        tip_share: Vec<f64>,
        tip_share_error: f64,
    ) -> Result<Self, ModelError> {
        let positive = |name, found: f64| {
            let fine = found > 0.0 && found.is_finite();
            if fine { Ok(()) } else { Err(ModelError::Parameter { name, found, wanted: "a number above 0" }) }
        };
        let error = |name, found: f64| {
            let fine = found >= 0.0 && found.is_finite();
            if fine { Ok(()) } else { Err(ModelError::Parameter { name, found, wanted: "a number, 0 or more" }) }
        };
        positive("stiffness", stiffness.value)?;
        error("standard error of the stiffness", stiffness.std)?;
        error("relative error of the tip shares", tip_share_error)?;
        if modes.is_empty() {
            return Err(ModelError::Parameter { name: "number of free modes", found: 0.0, wanted: "at least 1" });
        }
        if tip_share.len() != modes.len() {
            return Err(ModelError::Parameter {
                name: "number of tip shares",
                found: tip_share.len() as f64,
                wanted: "one for each free mode",
            });
        }
        for (mode, share) in modes.iter().zip(&tip_share) {
            positive("frequency of a free mode", mode.frequency_hz.value)?;
            error("standard error of a free mode's frequency", mode.frequency_hz.std)?;
            positive("quality factor of a free mode", mode.quality_factor.value)?;
            error("standard error of a free mode's quality factor", mode.quality_factor.std)?;
            positive("tip share", *share)?;
        }
        let sum = tip_share.iter().sum::<f64>();
        if sum > 1.0 + SHARE_TOLERANCE {
            return Err(ModelError::Parameter { name: "sum of the tip shares", found: sum, wanted: "at most 1" });
        }
        Ok(Self { stiffness_n_per_m: stiffness, modes, tip_share, tip_share_error })
    }

    /// Static stiffness at the tip, N/m.
    pub fn stiffness(&self) -> Estimate {
        self.stiffness_n_per_m
    }

    /// Its free modes.
    pub fn modes(&self) -> &[ModeEstimate] {
        &self.modes
    }

    /// Standard errors of the parameters: stiffness, then per mode angular frequency (rad/s), quality factor and share.
    pub(super) fn parameter_std(&self) -> Vec<f64> {
        let modes = self.modes.iter().zip(&self.tip_share).flat_map(|(mode, share)| {
            [TAU * mode.frequency_hz.std, mode.quality_factor.std, share * self.tip_share_error]
        });
        std::iter::once(self.stiffness_n_per_m.std).chain(modes).collect()
    }

    /// Compliance of the tip at `s` with its derivatives.
    pub(super) fn compliance(&self, s: c64) -> Compliance {
        let k = self.stiffness_n_per_m.value;
        let mut value = c64::new(1.0 - self.tip_share.iter().sum::<f64>(), 0.0);
        let mut by_s = c64::new(0.0, 0.0);
        let mut by_parameter = vec![c64::new(0.0, 0.0)];
        let mut lowest = None;
        for (mode, &share) in self.modes.iter().zip(&self.tip_share) {
            let (w, q) = (TAU * mode.frequency_hz.value, mode.quality_factor.value);
            let d = s * s + s * (w / q) + w * w;
            let part = c64::new(w * w, 0.0) / d;
            value += part * share;
            by_s -= part / d * (s * 2.0 + w / q) * share;
            // d(w^2/d)/dw = (2 w - w^2/d (s/Q + 2 w)) / d
            by_parameter.push((c64::new(2.0 * w, 0.0) - part * (s / q + 2.0 * w)) / d * (share / k));
            by_parameter.push(part / d * s * (w / (q * q)) * (share / k));
            // the first mode gives what the others take: their sum is known better than any of them
            let first = *lowest.get_or_insert(part);
            by_parameter.push((part - first) / k);
        }
        value /= k;
        by_parameter[0] = -value / k;
        Compliance { value, by_s: by_s / k, by_parameter }
    }

    /// `sum_n d_n'(s) / d_n(s)` of the modes' denominators.
    pub(super) fn denominators_slope(&self, s: c64) -> c64 {
        self.modes.iter().fold(c64::new(0.0, 0.0), |sum, mode| {
            let (w, q) = (TAU * mode.frequency_hz.value, mode.quality_factor.value);
            sum + (s * 2.0 + w / q) / (s * s + s * (w / q) + w * w)
        })
    }
}

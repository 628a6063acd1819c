//! What is fitted to frequency responses, and how.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::FrfQuantity;
use crate::model::ModelError;
use crate::ringdown::ModesWanted;
use crate::stabilisation::StabilisationCriteria;

/// What is fitted, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FrfModesOptions {
    /// What the responses are; default: a plain transfer function.
    #[serde(skip)]
    pub quantity: FrfQuantity,
    /// Decay that an exponential window added to the responses, 1/s; it is taken off the poles. Default 0.
    #[serde(skip)]
    pub added_decay_per_s: f64,
    /// Response, from 0, that was measured where the force acts: it scales the shapes to unit modal mass. Default none.
    #[serde(skip)]
    pub driving_point: Option<usize>,
    /// Oscillating modes; default: found by the data, at most 12.
    #[serde(skip)]
    pub modes: ModesWanted,
    /// Lowest line of the fit in Hz; absent: the first above 0. Why: lines below the sensor's band are noise.
    #[schemars(range(min = 0.0))]
    pub from_hz: Option<f64>,
    /// Highest line of the fit in Hz; absent: the last. Why: above, the force may no longer excite.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub to_hz: Option<f64>,
    /// Fit what modes below the band leave in it, `1/(i w)^2` of a receptance. Why true: a free body moves as a whole,
    /// and integration of an acceleration leaves the same.
    pub lower_residual: bool,
    /// Fit what modes above the band leave in it, a constant receptance. Why true: every body has such modes.
    pub upper_residual: bool,
    /// Real poles beside the modes, 0 to 4: creep, or a filter of the electronics. Why 0: structures have none.
    #[schemars(range(min = 0, max = 4))]
    pub real_poles: usize,
    /// Largest order of the polynomials that the search starts from, 4 to 120. Why 60: noise needs poles too, some four
    /// for each mode.
    #[schemars(range(min = 4, max = 120))]
    pub max_order: usize,
    /// Largest relative change of a stable pole's frequency from one order to the next. Why 0.01: as is usual.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = 0.0))]
    pub stable_frequency: f64,
    /// Largest relative change of a stable pole's damping. Why 0.2: noise moves a start's damping more than its
    /// frequency, and the likelihood decides in the end.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub stable_damping: f64,
    /// Least quality factor of a mode. Why 2: below, a peak is as wide as its frequency and the residual terms explain
    /// it as well.
    #[schemars(extend("exclusiveMinimum" = 0.5))]
    pub least_quality_factor: f64,
    /// Probability that noise alone yields a further mode. Why 0.001: one set of responses in a thousand gains a mode
    /// that is not there.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub false_alarm: f64,
}

impl Default for FrfModesOptions {
    fn default() -> Self {
        Self {
            quantity: FrfQuantity::default(),
            added_decay_per_s: 0.0,
            driving_point: None,
            modes: ModesWanted::AtMost(12),
            from_hz: None,
            to_hz: None,
            lower_residual: true,
            upper_residual: true,
            real_poles: 0,
            max_order: 60,
            stable_frequency: 0.01,
            stable_damping: 0.2,
            least_quality_factor: 2.0,
            false_alarm: 1e-3,
        }
    }
}

impl FrfModesOptions {
    /// Errors: a number out of its range, a driving point that is no response.
    pub(super) fn check(&self, responses: usize) -> Result<(), ModelError> {
        let range = |name, found: f64, ok: bool, wanted| {
            if ok { Ok(()) } else { Err(ModelError::Parameter { name, found, wanted }) }
        };
        let count = self.largest();
        range("modes", count as f64, count >= 1, "at least 1")?;
        let decay = self.added_decay_per_s;
        range("added_decay_per_s", decay, decay >= 0.0 && decay.is_finite(), "0 or more")?;
        range("real_poles", self.real_poles as f64, self.real_poles <= 4, "0 to 4")?;
        range("max_order", self.max_order as f64, (4..=120).contains(&self.max_order), "4 to 120")?;
        let least = self.least_quality_factor;
        range("least_quality_factor", least, least > 0.5, "above 0.5")?;
        let alarm = self.false_alarm;
        range("false_alarm", alarm, alarm > 0.0 && alarm < 1.0, "between 0 and 1")?;
        let point = self.driving_point.unwrap_or(0);
        range("driving_point", point as f64, point < responses, "the number of a response, from 0")
    }

    /// Largest number of modes.
    pub(super) fn largest(&self) -> usize {
        match self.modes {
            ModesWanted::Fixed(count) | ModesWanted::AtMost(count) => count,
        }
    }

    /// When a pole of one order counts as that of the next.
    pub(super) fn criteria(&self) -> StabilisationCriteria {
        StabilisationCriteria {
            frequency: self.stable_frequency,
            damping: self.stable_damping,
            min_quality_factor: self.least_quality_factor,
            ..StabilisationCriteria::default()
        }
    }
}

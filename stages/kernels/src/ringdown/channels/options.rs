//! What is fitted to several channels, and how.

use std::ops::Range;

use faer::c64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Watch;
use crate::model::ModelError;
use crate::ringdown::RingdownNoise;

/// How many modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModesWanted {
    /// So many.
    Fixed(usize),
    /// As many as the data show, at most so many.
    AtMost(usize),
}

/// Where each channel's noise comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum ChannelNoise {
    /// White noise, each channel's variance from its residuals.
    White,
    /// White noise and wander of each channel, from its residuals and free stretches.
    Estimated,
    /// Given, one per channel.
    Known(Vec<RingdownNoise>),
}

/// What is fitted, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ChannelOptions {
    /// Oscillating modes; default: found by the data, at most 12.
    #[serde(skip)]
    pub modes: ModesWanted,
    /// Where the noise's variances come from; default: estimated, per channel.
    #[serde(skip)]
    pub noise: ChannelNoise,
    /// Estimate a linear drift of each record beside its offset. Why true: sensors drift, and a slope costs next to
    /// nothing.
    pub drift: bool,
    /// Probability that noise alone yields a further mode. Why 0.001: one record in a thousand gains a mode that is
    /// not there, and one that is there needs an amplitude of six standard errors.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub false_alarm: f64,
    /// Least quality factor of an exponential. Why 0.5005: at 0.5 a pair is a real pole twice; so near to it a coupling
    /// capacitor or a relaxing sensor finds its place, and is dropped afterwards.
    #[schemars(extend("exclusiveMinimum" = 0.5))]
    pub least_quality_factor: f64,
    /// Start from these poles, rad/s, upper half plane, instead of finding modes; their number replaces `modes`.
    /// Default none. For the early and the late part of a decay whose modes are known.
    #[serde(skip)]
    pub start: Vec<c64>,
    /// Missing samples per event and channel, clipped say; default empty: none. What stands there is never used.
    #[serde(skip)]
    pub missing: Vec<Vec<Vec<Range<usize>>>>,
    /// Who watches, and may end it.
    #[serde(skip)]
    pub watch: Watch,
}

impl Default for ChannelOptions {
    fn default() -> Self {
        Self {
            modes: ModesWanted::AtMost(12),
            noise: ChannelNoise::Estimated,
            drift: true,
            false_alarm: 1e-3,
            least_quality_factor: 0.5005,
            start: Vec::new(),
            missing: Vec::new(),
            watch: Watch::default(),
        }
    }
}

impl ChannelOptions {
    /// Errors: a number out of its range, noise for another number of channels.
    pub(super) fn check(&self, channels: usize) -> Result<(), ModelError> {
        let (ModesWanted::Fixed(count) | ModesWanted::AtMost(count)) = self.modes;
        if count == 0 {
            return Err(ModelError::Parameter { name: "modes", found: 0.0, wanted: "at least 1" });
        }
        if !(self.false_alarm > 0.0 && self.false_alarm < 1.0) {
            let found = self.false_alarm;
            return Err(ModelError::Parameter { name: "false_alarm", found, wanted: "between 0 and 1" });
        }
        if self.least_quality_factor.is_nan() || self.least_quality_factor <= 0.5 {
            let found = self.least_quality_factor;
            return Err(ModelError::Parameter { name: "least_quality_factor", found, wanted: "above 0.5" });
        }
        if let Some(pole) = self.start.iter().find(|s| !(s.re < 0.0 && s.im > 0.0 && s.is_finite())) {
            let found = if pole.re < 0.0 { pole.im } else { pole.re };
            return Err(ModelError::Parameter {
                name: "start",
                found,
                wanted: "decaying poles of the upper half plane",
            });
        }
        match &self.noise {
            ChannelNoise::Known(noise) if noise.len() != channels => {
                Err(ModelError::Length { what: "noise", found: noise.len(), wanted: channels })
            }
            _ => Ok(()),
        }
    }
}

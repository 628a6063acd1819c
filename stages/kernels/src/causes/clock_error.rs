//! A sampling clock that drifts.

use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// All modes drift in proportion.
pub struct ClockError;

const ABOUT: About = About {
    id: "clock-error",
    physics: "the sampling clock drifts over the archive: all frequencies seem to",
    part: Part::Archive,
    needs: &[Need::Release, Need::Records],
    parameters: &[Parameter {
        name: "relative_drift",
        unit: "1",
        meaning: "relative change of the sampling rate from the first record to the last",
        low: -0.1,
        high: 0.1,
    }],
    class: &["frequency-drift", "clock-error"],
    resembles: "frequency-drift: the same signal",
    next_measurement: "a reference clock in a spare channel",
    identifiable: Identifiable::No("the same signal as frequency-drift, which stands for both"),
    source: "IEEE Std 1057-2017, on time base errors",
};

impl Cause for ClockError {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let drift = values[0];
        effects.frequency.push(Arc::new(move |at| -drift * (at.place - 0.5)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![1e-3 / scene.quality_factor.first().copied().unwrap_or(100.0).max(1.0)]]
    }
}

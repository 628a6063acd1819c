//! A lever that changes over the archive.

use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// All modes drift in proportion.
pub struct FrequencyDrift;

const ABOUT: About = About {
    id: "frequency-drift",
    physics: "temperature or adsorption moves all frequencies in proportion from record to record",
    part: Part::Archive,
    needs: &[Need::Records],
    parameters: &[Parameter {
        name: "relative_drift",
        unit: "1",
        meaning: "relative change of all frequencies from the first record to the last",
        low: -0.1,
        high: 0.1,
    }],
    class: &["frequency-drift", "clock-error"],
    resembles: "mass-change: a step; clock-error: the same signal",
    next_measurement: "a reference clock in a spare channel, a thermometer at the lever",
    identifiable: Identifiable::Shape,
    source: "J. E. Sader, J. Appl. Phys. 84 (1998) 64, for what the frequencies depend on",
};

impl Cause for FrequencyDrift {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let drift = values[0];
        effects.frequency.push(Arc::new(move |at| drift * (at.place - 0.5)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![1e-3 / scene.quality_factor.first().copied().unwrap_or(100.0).max(1.0)]]
    }
}

//! Samples that were never stored.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// Time jumps inside a record.
pub struct MissingSamples;

const ABOUT: About = About {
    id: "missing-samples",
    physics: "the acquisition drops samples: time jumps",
    part: Part::Record,
    needs: &[Need::Release],
    parameters: &[
        Parameter { name: "samples", unit: "1", meaning: "samples lost", low: 0.0, high: 1e6 },
        Parameter { name: "time_s", unit: "s", meaning: "when, since the record's start", low: 0.0, high: 1e4 },
    ],
    class: &["missing-samples"],
    resembles: "finite-rupture: no other effect shifts all phases at once in the middle of an event",
    next_measurement: "a counter or a sine in a spare channel",
    identifiable: Identifiable::No("a jump is not looked for yet"),
    source: "IEEE Std 1057-2017",
};

impl Cause for MissingSamples {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        effects.lost.push((values[1], values[0].max(0.0) as usize));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![1.0, 0.5 * scene.window_s]]
    }
}

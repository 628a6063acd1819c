//! Force that reaches the readout without the lever.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// `d0 u` beside the modes.
pub struct Feedthrough;

const ABOUT: About = About {
    id: "feedthrough",
    physics: "part of the signal follows the force at once: modes beyond the model's, or a bent base",
    part: Part::Lever,
    needs: &[Need::Release],
    parameters: &[Parameter {
        name: "share",
        unit: "1",
        meaning: "signal per load that bypasses the modes",
        low: -0.2,
        high: 0.2,
    }],
    class: &["feedthrough"],
    resembles: "truncated modes: their compliance below resonance is the same constant",
    next_measurement: "a wider band: modes come out one by one, a true feedthrough stays",
    identifiable: Identifiable::Shape,
    source: "D. J. Ewins, Modal Testing, 2nd ed., 2000, on residual terms",
};

impl Cause for Feedthrough {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        effects.feedthrough += values[0];
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![if scene.level_v > 0.0 { 0.01 } else { 0.0 }]]
    }
}

//! A laser that flickers.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// Noise that grows with the deflection.
pub struct IntensityNoise;

const ABOUT: About = About {
    id: "intensity-noise",
    physics: "the laser's intensity fluctuates: noise in proportion to the deflection",
    part: Part::Record,
    needs: &[Need::Release],
    parameters: &[Parameter {
        name: "relative",
        unit: "1",
        meaning: "standard deviation of the intensity over its mean",
        low: 0.0,
        high: 0.1,
    }],
    class: &["intensity-noise"],
    resembles: "thermal noise: does not depend on the deflection",
    next_measurement: "the same spot at two deflections at rest",
    identifiable: Identifiable::No("it biases nothing: its size is not looked for yet"),
    source: "D. P. E. Smith, Rev. Sci. Instrum. 66 (1995) 3191",
};

impl Cause for IntensityNoise {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        effects.intensity = effects.intensity.hypot(values[0]);
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![scene.noise_v / scene.level_v]]
    }
}

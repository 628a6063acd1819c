//! A sensor whose output flattens.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// `y = q + a q^3`.
pub struct OutputCubic;

const ABOUT: About = About {
    id: "output-cubic",
    physics: "the sensor flattens or steepens symmetrically: a term in the cube of the motion",
    part: Part::Detector,
    needs: &[Need::Run, Need::OneChannel],
    parameters: &[Parameter {
        name: "a",
        unit: "1/V^2",
        meaning: "weight of the cube of the output",
        low: -10.0,
        high: 10.0,
    }],
    class: &["output-cubic"],
    resembles: "duffing: also odd harmonics, but it shifts the resonance; output-saturation: hurts large outputs only",
    next_measurement: "calibrate the sensor statically, or read the motion with a second one",
    identifiable: Identifiable::Shape,
    source: "R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 3",
};

impl Cause for OutputCubic {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let a = values[0];
        effects.optics.push(Passage::map(move |v| v + a * v * v * v));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.01 / scene.level_v.powi(2)]]
    }
}

//! A sensor whose output bends to one side.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// `y = q + a q^2`.
pub struct OutputQuadratic;

const ABOUT: About = About {
    id: "output-quadratic",
    physics: "the sensor answers more to one side than to the other: a term in the square of the motion",
    part: Part::Detector,
    needs: &[Need::Run, Need::OneChannel],
    parameters: &[Parameter {
        name: "a",
        unit: "1/V",
        meaning: "weight of the square of the output",
        low: -10.0,
        high: 10.0,
    }],
    class: &["output-quadratic"],
    resembles: "quadratic-stiffness: also even harmonics, but it lowers the resonance",
    next_measurement: "calibrate the sensor statically, or read the motion with a second one",
    identifiable: Identifiable::Shape,
    source: "R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 3",
};

impl Cause for OutputQuadratic {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let a = values[0];
        effects.optics.push(Passage::map(move |v| v + a * v * v));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.01 / scene.level_v]]
    }
}

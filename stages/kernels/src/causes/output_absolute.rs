//! A sensor with two slopes.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// `y = q + a abs(q)`.
pub struct OutputAbsolute;

const ABOUT: About = About {
    id: "output-absolute",
    physics: "the sensor has one sensitivity to one side and another to the other",
    part: Part::Detector,
    needs: &[Need::Run, Need::OneChannel],
    parameters: &[Parameter {
        name: "a",
        unit: "1",
        meaning: "half the difference of the two sensitivities",
        low: -1.0,
        high: 1.0,
    }],
    class: &["output-absolute"],
    resembles: "output-quadratic: differs at small outputs, where two slopes stay two slopes",
    next_measurement: "calibrate the sensor statically on both sides of zero",
    identifiable: Identifiable::Shape,
    source: "R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 3",
};

impl Cause for OutputAbsolute {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let a = values[0];
        effects.optics.push(Passage::map(move |v| v + a * v.abs()));
    }

    fn trials(&self, _scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.01]]
    }
}

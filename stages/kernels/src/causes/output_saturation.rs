//! A sensor that saturates.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// A share of what exceeds a level is lost: `y = q - share (abs(q) - level)+ sgn(q)`.
pub struct OutputSaturation;

const ABOUT: About = About {
    id: "output-saturation",
    physics: "the sensor or its amplifier runs into a limit: beyond a level a share of the output is lost, all of it where it clips",
    part: Part::Detector,
    needs: &[Need::Run, Need::OneChannel],
    parameters: &[
        Parameter {
            name: "share",
            unit: "1",
            meaning: "share that is lost of what exceeds the level",
            low: 0.0,
            high: 2.0,
        },
        Parameter { name: "level", unit: "V", meaning: "level beyond which it is lost", low: 0.0, high: 1e6 },
    ],
    class: &["output-saturation"],
    resembles: "output-cubic: bends at small outputs too; clipping by the converter: flat tops in the code histogram",
    next_measurement: "lower the sensor gain at the same drive: the loss goes",
    identifiable: Identifiable::Shape,
    source: "R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 3",
};

impl Cause for OutputSaturation {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (share, level) = (values[0], values[1].abs());
        effects.optics.push(Passage::map(move |v| v - share * (v.abs() - level).max(0.0) * v.signum()));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [0.2, 0.35, 0.5, 0.7, 0.85].iter().map(|part| vec![0.1, part * scene.level_v]).collect()
    }
}

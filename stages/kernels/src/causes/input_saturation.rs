//! An actuator that saturates.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// A share of what exceeds a level is lost: `u - share (abs(u) - level)+ sgn(u)`.
pub struct InputSaturation;

const ABOUT: About = About {
    id: "input-saturation",
    physics: "the actuator or its amplifier runs into a limit: beyond a level a share of the input does not act",
    part: Part::Input,
    needs: &[Need::Input],
    parameters: &[
        Parameter {
            name: "share",
            unit: "1",
            meaning: "share that is lost of what exceeds the level",
            low: 0.0,
            high: 2.0,
        },
        Parameter { name: "level", unit: "input", meaning: "level beyond which it is lost", low: 0.0, high: 1e6 },
    ],
    class: &["input-saturation"],
    resembles: "output-saturation: loses what exceeds a level of the output, whatever the input",
    next_measurement: "measure the force at the actuator, or lower the drive: the loss goes",
    identifiable: Identifiable::Shape,
    source: "R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 3",
};

impl Cause for InputSaturation {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (share, level) = (values[0], values[1].abs());
        effects.input.push(Passage::map(move |u| u - share * (u.abs() - level).max(0.0) * u.signum()));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [0.2, 0.35, 0.5, 0.7, 0.85].iter().map(|part| vec![0.1, part * scene.input_level]).collect()
    }
}

//! An output that rests off zero.

use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// `y = q + offset`.
pub struct Offset;

const ABOUT: About = About {
    id: "offset",
    physics: "the sensor or its amplifier adds a constant",
    part: Part::Record,
    needs: &[Need::Run, Need::OneRun],
    parameters: &[Parameter {
        name: "offset",
        unit: "V",
        meaning: "constant part of the output",
        low: -1e6,
        high: 1e6,
    }],
    class: &["offset"],
    resembles: "a constant force or input: the same in a linear system, but it shifts the resonance of a nonlinear one",
    next_measurement: "record without input before and after",
    identifiable: Identifiable::Shape,
    source: "L. Ljung, System Identification, 2nd ed., 1999, section 14.1",
};

impl Cause for Offset {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let offset = values[0];
        effects.added.push(Arc::new(move |_| offset));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.01 * scene.level_v]]
    }
}

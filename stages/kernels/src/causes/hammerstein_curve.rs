//! A linear system behind a curve.

use std::sync::Arc;

use super::{About, Cause, Domain, Identifiable, Parameter, Part, Scene};
use crate::effects::Effects;

/// `y = G f(u)`.
pub struct HammersteinCurve;

const ABOUT: About = About {
    id: "hammerstein-curve",
    physics: "the actuator or its amplifier is bent: a static curve before all dynamics",
    part: Part::Input,
    domain: Domain::InputOutput,
    parameters: &[
        Parameter {
            name: "bend",
            unit: "1",
            meaning: "departure of the curve from a straight line over what it passes, both rms; simulated as a cubic of a signal of size 1",
            low: 0.0,
            high: 1.0,
        },
        Parameter { name: "poles_before", unit: "1", meaning: "poles before the curve", low: 0.0, high: 20.0 },
        Parameter { name: "poles_behind", unit: "1", meaning: "poles behind the curve", low: 0.0, high: 20.0 },
    ],
    class: &["hammerstein-curve"],
    resembles: "wiener-hammerstein-curve with a fast part before the curve; input-saturation: the same beside an oscillator",
    next_measurement: "measure behind the actuator: from there on the system is linear",
    identifiable: Identifiable::Record,
    source: "M. Schoukens, K. Tiels, Automatica 85 (2017) 272",
};

impl Cause for HammersteinCurve {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let bend = values[0];
        effects.input.push(Arc::new(move |x| x - bend * x * x * x));
    }

    fn trials(&self, _scene: &Scene) -> Vec<Vec<f64>> {
        // fitted with the linear parts around it, not beside an oscillator
        Vec::new()
    }
}

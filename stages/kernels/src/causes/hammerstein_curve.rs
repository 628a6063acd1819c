//! A linear system behind a curve.

use super::wiener_hammerstein_curve::{CURVE, cubic};
use super::{About, Cause, Identifiable, Need, Part, Scene};
use crate::effects::Effects;

/// `y = G f(u)`.
pub struct HammersteinCurve;

const ABOUT: About = About {
    id: "hammerstein-curve",
    physics: "the actuator or its amplifier is bent: a static curve before all dynamics",
    part: Part::Input,
    needs: &[Need::Input],
    parameters: CURVE,
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
        effects.input.push(cubic(values[0]));
    }

    fn trials(&self, _scene: &Scene) -> Vec<Vec<f64>> {
        // fitted with the linear parts around it, not beside an oscillator
        Vec::new()
    }
}

//! A photodiode whose output bends.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// `v = s + a2 s^2`.
pub struct QuadraticDetector;

const ABOUT: About = About {
    id: "quadratic-detector",
    physics: "the spot sits off the middle of the photodiode: its answer has a term in the square of the deflection",
    part: Part::Detector,
    needs: &[Need::Release],
    parameters: &[Parameter {
        name: "a2",
        unit: "1/V",
        meaning: "weight of the square of the deflection signal",
        low: -0.5,
        high: 0.5,
    }],
    class: &["quadratic-detector"],
    resembles: "interference-fringe: the free baseline then waves with the piezo position",
    next_measurement: "shift the spot on the photodiode: a2 changes sign",
    identifiable: Identifiable::Shape,
    source: "T. E. Schaeffer, P. K. Hansma, J. Appl. Phys. 84 (1998) 4661",
};

impl Cause for QuadraticDetector {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let a2 = values[0];
        effects.optics.push(Passage::map(move |s| s + a2 * s * s));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.01 / scene.level_v]]
    }
}

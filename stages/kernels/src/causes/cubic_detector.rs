//! A photodiode that saturates.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// `v = s + a3 s^3`.
pub struct CubicDetector;

const ABOUT: About = About {
    id: "cubic-detector",
    physics: "the spot is as wide as the photodiode's travel: its answer flattens symmetrically, a term in the cube of the deflection",
    part: Part::Detector,
    needs: &[Need::Release],
    parameters: &[Parameter {
        name: "a3",
        unit: "1/V^2",
        meaning: "weight of the cube of the deflection signal",
        low: -0.5,
        high: 0.5,
    }],
    class: &["cubic-detector"],
    resembles: "nonlinear-damping: bends the envelope too, but makes no third harmonic",
    next_measurement: "repeat at half the laser power: a3 in 1/V^2 grows fourfold, a lever's nonlinearity does not",
    identifiable: Identifiable::Shape,
    source: "T. E. Schaeffer, P. K. Hansma, J. Appl. Phys. 84 (1998) 4661",
};

impl Cause for CubicDetector {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let a3 = values[0];
        effects.optics.push(Passage::map(move |s| s + a3 * s * s * s));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.01 / scene.level_v.powi(2)]]
    }
}

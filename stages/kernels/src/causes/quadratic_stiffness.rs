//! A spring that is softer one way than the other.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// `+ w^2 k2 q^2` on the first mode.
pub struct QuadraticStiffness;

const ABOUT: About = About {
    id: "quadratic-stiffness",
    physics: "stiffness changes with the side that the oscillator swings to: a bias, a magnet or gravity acts from one side",
    part: Part::Lever,
    needs: &[Need::Run, Need::Mode],
    parameters: &[Parameter {
        name: "k2",
        unit: "1/V",
        meaning: "relative change of stiffness per deflection",
        low: -10.0,
        high: 10.0,
    }],
    class: &["quadratic-stiffness"],
    resembles: "output-quadratic: also even harmonics, but it shifts no frequency and follows the output instantly",
    next_measurement: "drive at two amplitudes: the mean output moves with the square and the resonance falls with it",
    identifiable: Identifiable::Shape,
    source: "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, 1979, chapter 2",
};

impl Cause for QuadraticStiffness {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let law = PowerLaw::new(0, values[0], &[(Quantity::Deflection, 0); 2]);
        effects.modal_force.push(ModalForce::Power(law));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.01 / scene.level_v]]
    }
}

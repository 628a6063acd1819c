//! A spring that stiffens late.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// `+ w^2 k5 q^5` on the first mode.
pub struct QuinticStiffness;

const ABOUT: About = About {
    id: "quintic-stiffness",
    physics: "stiffness grows with the fourth power of the deflection: contact, magnets or geometry at large swings",
    part: Part::Lever,
    needs: &[Need::Run, Need::Mode],
    parameters: &[Parameter {
        name: "k5",
        unit: "1/V^4",
        meaning: "relative change of stiffness per fourth power of the deflection",
        low: -10.0,
        high: 10.0,
    }],
    class: &["quintic-stiffness"],
    resembles: "duffing: grows with the square; only a range of amplitudes tells the two apart",
    next_measurement: "drive at three amplitudes: the shift of the resonance against amplitude on logarithmic axes has slope 4, not 2",
    identifiable: Identifiable::Shape,
    source: "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, 1979, chapter 2",
};

impl Cause for QuinticStiffness {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let law = PowerLaw::new(0, values[0], &[(Quantity::Deflection, 0); 5]);
        effects.modal_force.push(ModalForce::Power(law));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.01 / scene.level_v.powi(4)]]
    }
}

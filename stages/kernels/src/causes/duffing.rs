//! A lever that stiffens with its deflection.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// `+ w^2 k3 q^3` on the first mode.
pub struct Duffing;

const ABOUT: About = About {
    id: "duffing",
    physics: "stiffness grows with the square of the deflection: large swings are faster than small ones",
    part: Part::Lever,
    needs: &[Need::Mode],
    parameters: &[Parameter {
        name: "k3",
        unit: "1/V^2",
        meaning: "relative change of the first mode's stiffness per square of its deflection signal",
        low: -10.0,
        high: 10.0,
    }],
    class: &["duffing"],
    resembles: "tip-sample-force: also an early shift of frequency, but it depends on the gap, not on the amplitude",
    next_measurement: "drive the free lever far from the surface at two amplitudes: the resonance moves with the square of the amplitude",
    identifiable: Identifiable::Shape,
    source: "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, 1979, chapter 2",
};

impl Cause for Duffing {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let law = PowerLaw::new(0, values[0], &[(Quantity::Deflection, 0); 3]);
        effects.modal_force.push(ModalForce::Power(law));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.003 / scene.level_v.powi(2)]]
    }
}

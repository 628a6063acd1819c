//! Two modes that feed one another at one to two.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// `w1^2 c1 q1 q2` on the first mode, `w2^2 c2 q1^2` on the second.
pub struct QuadraticCoupling;

const ABOUT: About = About {
    id: "quadratic-coupling",
    physics: "the square of one mode's swing drives another at twice its frequency, and that one pumps it in turn: \
              internal resonance 1:2",
    part: Part::Lever,
    needs: &[Need::Run, Need::TwoModes],
    parameters: &[
        Parameter {
            name: "c1",
            unit: "1/V",
            meaning: "relative change of the first mode's stiffness per deflection signal of the second",
            low: -10.0,
            high: 10.0,
        },
        Parameter {
            name: "c2",
            unit: "1/V",
            meaning: "force on the second mode over its stiffness, per square of the first's deflection signal",
            low: -10.0,
            high: 10.0,
        },
    ],
    class: &["quadratic-coupling"],
    resembles: "quadratic-stiffness: its second harmonic does not beat, and does not feed back",
    next_measurement: "detune the modes by a small mass: energy no longer goes to and fro between them",
    identifiable: Identifiable::Shape,
    source: "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, 1979, chapter 6",
};

impl Cause for QuadraticCoupling {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        use Quantity::Deflection as Q;
        effects.modal_force.extend([
            ModalForce::Power(PowerLaw::new(0, values[0], &[(Q, 0), (Q, 1)])),
            ModalForce::Power(PowerLaw::new(1, values[1], &[(Q, 0), (Q, 0)])),
        ]);
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let c = 0.003 / scene.level_v;
        vec![vec![c, c], vec![c, 0.0]]
    }
}

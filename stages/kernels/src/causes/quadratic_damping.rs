//! Damping by a fluid that is pushed aside.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// `+ c abs(q') q'` on the first mode.
pub struct QuadraticDamping;

const ABOUT: About = About {
    id: "quadratic-damping",
    physics: "the medium or a clamp takes energy in proportion to the square of the speed: large swings decay faster",
    part: Part::Lever,
    needs: &[Need::Mode],
    parameters: &[Parameter {
        name: "c",
        unit: "1/V",
        meaning: "loss per amplitude: adds c abs(q') to the first mode's rate of damping",
        low: -10.0,
        high: 10.0,
    }],
    class: &["quadratic-damping"],
    resembles: "nonlinear-damping: the loss grows with the square of the amplitude instead; near-surface-damping: it depends on the gap",
    next_measurement: "let it ring from twice the amplitude: the early loss doubles (nonlinear-damping: fourfold), and vacuum removes it",
    identifiable: Identifiable::Shape,
    source: "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, 1979, chapter 2",
};

impl Cause for QuadraticDamping {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let factors = [(Quantity::Speed, 0), (Quantity::Rate, 0)];
        effects.modal_force.push(ModalForce::Power(PowerLaw::new(0, values[0], &factors)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.003 / scene.level_v]]
    }
}

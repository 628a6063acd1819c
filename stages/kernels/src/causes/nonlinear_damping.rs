//! Damping that grows with the swing.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// `+ w c q^2 q'` on the first mode.
pub struct NonlinearDamping;

const ABOUT: About = About {
    id: "nonlinear-damping",
    physics: "energy is lost in strongly bent parts or by coupling: the loss factor grows with the square of the deflection",
    part: Part::Lever,
    needs: &[Need::Mode],
    parameters: &[Parameter {
        name: "c",
        unit: "1/V^2",
        meaning: "loss 1/Q per square of the first mode's deflection signal",
        low: -10.0,
        high: 10.0,
    }],
    class: &["nonlinear-damping"],
    resembles: "quadratic-damping: grows with the amplitude, not its square; cubic-detector: bends the envelope too, but makes a third harmonic",
    next_measurement: "let it ring from twice the amplitude: the early loss grows fourfold (quadratic-damping: twofold)",
    identifiable: Identifiable::Shape,
    source: "A. Eichler et al., Nat. Nanotechnol. 6 (2011) 339",
};

impl Cause for NonlinearDamping {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let factors = [(Quantity::Deflection, 0), (Quantity::Deflection, 0), (Quantity::Rate, 0)];
        effects.modal_force.push(ModalForce::Power(PowerLaw::new(0, values[0], &factors)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.003 / scene.level_v.powi(2)]]
    }
}

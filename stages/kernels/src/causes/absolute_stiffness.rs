//! A joint that slips the more the further it is bent.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// `+ w^2 k abs(q) q` on the first mode.
pub struct AbsoluteStiffness;

const ABOUT: About = About {
    id: "absolute-stiffness",
    physics: "micro-slip in a joint or a clamp: stiffness falls in proportion to the amplitude",
    part: Part::Lever,
    needs: &[Need::Run, Need::Mode],
    parameters: &[Parameter {
        name: "k",
        unit: "1/V",
        meaning: "relative change of the first mode's stiffness per absolute value of its deflection signal",
        low: -10.0,
        high: 10.0,
    }],
    class: &["absolute-stiffness"],
    resembles: "duffing: the frequency moves with the square of the amplitude instead",
    next_measurement: "tighten the joint, or let it ring from half the amplitude: the shift of the frequency halves (duffing: a quarter)",
    identifiable: Identifiable::Shape,
    source: "W. D. Iwan, J. Appl. Mech. 33 (1966) 893",
};

impl Cause for AbsoluteStiffness {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let factors = [(Quantity::Distance, 0), (Quantity::Deflection, 0)];
        effects.modal_force.push(ModalForce::Power(PowerLaw::new(0, values[0], &factors)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.003 / scene.level_v]]
    }
}

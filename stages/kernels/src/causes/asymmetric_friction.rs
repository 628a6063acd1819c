//! Viscous friction that differs between the two directions.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// `+ d abs(q')` on the first mode.
pub struct AsymmetricFriction;

const ABOUT: About = About {
    id: "asymmetric-friction",
    physics: "viscous friction is stronger one way than the other: a guide or a seal under a side load",
    part: Part::Lever,
    needs: &[Need::Run, Need::Mode],
    parameters: &[Parameter {
        name: "viscous_difference",
        unit: "1",
        meaning: "half of the viscous friction forwards less backwards; of an oscillator over its mass and rate w, of an axis as it is",
        low: -1e6,
        high: 1e6,
    }],
    class: &["asymmetric-friction"],
    resembles: "offset: the same at one speed",
    next_measurement: "move both ways at two constant speeds: the difference of the forces grows with the speed, that of a constant force does not",
    identifiable: Identifiable::Shape,
    source: "A. Janot, P.-O. Vandanjon, M. Gautier, IEEE Trans. Control Syst. Technol. 22 (2014) 132",
};

impl Cause for AsymmetricFriction {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let law = PowerLaw::new(0, values[0], &[(Quantity::Speed, 0)]);
        effects.modal_force.push(ModalForce::Power(law));
    }

    fn trials(&self, _scene: &Scene) -> Vec<Vec<f64>> {
        // the force balance of an axis shows it; beside an oscillator's own laws it is one of many even ones
        Vec::new()
    }
}

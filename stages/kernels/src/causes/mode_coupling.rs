//! A mode that feels another's swing.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// `w2^2 (1 + c q1^2)`.
pub struct ModeCoupling;

const ABOUT: About = About {
    id: "mode-coupling",
    physics: "the swing of the first mode stiffens the second",
    part: Part::Lever,
    needs: &[Need::Release, Need::TwoModes],
    parameters: &[Parameter {
        name: "coupling",
        unit: "1/V^2",
        meaning: "relative change of the second mode's stiffness per square of the first mode's signal",
        low: -10.0,
        high: 10.0,
    }],
    class: &["mode-coupling"],
    resembles: "duffing: acts on the first mode itself",
    next_measurement: "drive both modes: the second one's resonance moves with the first one's amplitude",
    identifiable: Identifiable::Shape,
    source: "M. H. Matheny et al., Nano Lett. 13 (2013) 1622",
};

impl Cause for ModeCoupling {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        use Quantity::Deflection as Q;
        effects.modal_force.push(ModalForce::Power(PowerLaw::new(1, values[0], &[(Q, 0), (Q, 0), (Q, 1)])));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.003 / scene.level_v.powi(2)]]
    }
}

//! Air that is squeezed near the surface.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce};

/// `+ c exp(-z / l) q'`.
pub struct NearSurfaceDamping;

const ABOUT: About = About {
    id: "near-surface-damping",
    physics: "near the surface the squeezed film damps the first periods more",
    part: Part::Lever,
    needs: &[Need::Release, Need::Mode],
    parameters: &[
        Parameter {
            name: "damping",
            unit: "1",
            meaning: "additional damping rate at the point of release over the first mode's angular frequency",
            low: 0.0,
            high: 1.0,
        },
        Parameter { name: "length_v", unit: "V", meaning: "its decay length, as deflection", low: 1e-3, high: 10.0 },
    ],
    class: &["near-surface-damping"],
    resembles: "nonlinear-damping: depends on the amplitude, this on the gap",
    next_measurement: "repeat in vacuum or further away",
    identifiable: Identifiable::Shape,
    source: "M. Bao, H. Yang, Sens. Actuators A 136 (2007) 3",
};

impl Cause for NearSurfaceDamping {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (damping, length) = (values[0], values[1]);
        effects.modal_force.push(ModalForce::law(move |motion, acceleration| {
            if let (Some(a), Some(v), Some(w)) =
                (acceleration.first_mut(), motion.velocity.first(), motion.omega.first())
            {
                *a -= damping * w * (-motion.gap.max(0.0) / length).exp() * v;
            }
        }));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [0.1, 0.3].map(|share| vec![0.001, share * scene.level_v]).to_vec()
    }
}

//! Attraction that returns on the backswing.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce};

/// `u -= F exp(-z / l)`.
pub struct TipSampleForce;

const ABOUT: About = About {
    id: "tip-sample-force",
    physics: "the tip swings back towards the surface in the first periods and feels its attraction",
    part: Part::Force,
    needs: &[Need::Release],
    parameters: &[
        Parameter {
            name: "strength_v",
            unit: "V",
            meaning: "attraction at the point of release, as static deflection",
            low: -1.0,
            high: 1.0,
        },
        Parameter { name: "length_v", unit: "V", meaning: "its decay length, as deflection", low: 1e-3, high: 10.0 },
    ],
    class: &["tip-sample-force"],
    resembles: "duffing: depends on the amplitude, this on the gap",
    next_measurement: "pull further away, or release with another load: the gap of the backswing changes, the lever does not",
    identifiable: Identifiable::Shape,
    source: "F. J. Giessibl, Rev. Mod. Phys. 75 (2003) 949",
};

impl Cause for TipSampleForce {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (strength, length) = (values[0], values[1]);
        effects.modal_force.push(ModalForce::law(move |motion, acceleration| {
            let pull = strength * (-motion.gap.max(0.0) / length).exp();
            acceleration.iter_mut().zip(motion.omega).for_each(|(a, w)| *a -= w * w * pull);
        }));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [0.03, 0.1, 0.3].map(|share| vec![0.003 * scene.level_v, share * scene.level_v]).to_vec()
    }
}

//! An actuator with play.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// A share of what lies within the zone is lost: `u - share clamp(u, -width, width)`.
pub struct InputDeadZone;

const ABOUT: About = About {
    id: "input-dead-zone",
    physics: "play or stiction keeps small inputs from acting: a share of what lies within a zone is lost",
    part: Part::Input,
    needs: &[Need::Input],
    parameters: &[
        Parameter { name: "share", unit: "1", meaning: "share that is lost within the zone", low: 0.0, high: 2.0 },
        Parameter { name: "width", unit: "input", meaning: "half width of the zone", low: 0.0, high: 1e6 },
    ],
    class: &["input-dead-zone"],
    resembles: "coulomb-friction: also hurts small signals, but resists the motion, not the input",
    next_measurement: "measure the force at the actuator at a small drive",
    identifiable: Identifiable::Shape,
    source: "R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 3",
};

impl Cause for InputDeadZone {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (share, width) = (values[0], values[1].abs());
        effects.input.push(Passage::map(move |u| u - share * u.max(-width).min(width)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [0.05, 0.1, 0.2, 0.35, 0.5].iter().map(|part| vec![0.1, part * scene.input_level]).collect()
    }
}

//! A delay of the whole readout.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// `exp(-s delay)`.
pub struct ConstantDelay;

const ABOUT: About = About {
    id: "constant-delay",
    physics: "cables and converters delay the whole signal",
    part: Part::Detector,
    needs: &[Need::Release],
    parameters: &[Parameter { name: "delay_s", unit: "s", meaning: "delay", low: 0.0, high: 1e-5 }],
    class: &["constant-delay", "extra-pole"],
    resembles: "onset: the same signal",
    next_measurement: "the piezo monitor's kinks against those of the deflection in contact",
    identifiable: Identifiable::No("absorbed in every event's onset"),
    source: "R. W. Stark et al., Rev. Sci. Instrum. 76 (2005), on the delay",
};

impl Cause for ConstantDelay {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        effects.delay_s += values[0];
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![scene.interval_s]]
    }
}

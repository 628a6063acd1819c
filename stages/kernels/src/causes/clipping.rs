//! A converter or amplifier at its limits.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// `v` limited on both sides.
pub struct Clipping;

const ABOUT: About = About {
    id: "clipping",
    physics: "the signal leaves the range of an amplifier before the converter's own limits",
    part: Part::Record,
    needs: &[Need::Release],
    parameters: &[Parameter {
        name: "limit_v",
        unit: "V",
        meaning: "largest absolute volt that passes",
        low: 1e-3,
        high: 1e3,
    }],
    class: &["clipping"],
    resembles: "cubic-detector: also flattens, but smoothly; codes pile up only here",
    next_measurement: "a smaller gain, or a centred spot",
    identifiable: Identifiable::Record,
    source: "R. W. Stark et al., Rev. Sci. Instrum. 76 (2005), on the converter's range",
};

impl Cause for Clipping {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let limit = values[0];
        effects.limits = Some(match effects.limits {
            Some((low, high)) => (low.max(-limit), high.min(limit)),
            None => (-limit, limit),
        });
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![scene.level_v]]
    }
}

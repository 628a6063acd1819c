//! Events that are not aligned.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// Onsets scatter.
pub struct AlignmentJitter;

const ABOUT: About = About {
    id: "alignment-jitter",
    physics: "events lie a fraction of a sample apart: their mean blurs the high modes",
    part: Part::Record,
    needs: &[Need::Release],
    parameters: &[Parameter {
        name: "jitter_s",
        unit: "s",
        meaning: "standard deviation of the onsets",
        low: 0.0,
        high: 1e-5,
    }],
    class: &["alignment-jitter"],
    resembles: "finite-rupture: also blurs, but every single event",
    next_measurement: "none needed: each event's onset is estimated",
    identifiable: Identifiable::No("every event has an onset of its own in the fit: jitter is gone"),
    source: "R. W. Stark et al., Rev. Sci. Instrum. 76 (2005), on averaging",
};

impl Cause for AlignmentJitter {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        effects.jitter_s = effects.jitter_s.hypot(values[0]);
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.1 * scene.interval_s]]
    }
}

//! One more roll-off of the electronics.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, LinearSection};

/// One more real pole.
pub struct ExtraPole;

const ABOUT: About = About {
    id: "extra-pole",
    physics: "an amplifier or cable adds a roll-off that the detector's nominal poles don't have",
    part: Part::Detector,
    needs: &[Need::Release],
    parameters: &[Parameter {
        name: "time_constant_s",
        unit: "s",
        meaning: "time constant of the pole",
        low: 0.0,
        high: 2e-6,
    }],
    class: &["extra-pole", "constant-delay"],
    resembles: "finite-rupture below 0.4 us; a free detector order absorbs it",
    next_measurement: "a modulated laser on the resting lever: the detector's response without any lever",
    identifiable: Identifiable::No(
        "the detector's poles are free in the baseline and absorb it: it takes calibrated poles",
    ),
    source: "A. V. Oppenheim, A. S. Willsky, Signals and Systems, chapter 6",
};

impl Cause for ExtraPole {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        if values[0] > 0.0 {
            effects.electronics.push(LinearSection { pole: 1.0 / values[0], low: 1.0, high: 0.0 });
        }
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.5 * scene.interval_s]]
    }
}

//! A contact that takes its time to let go.

use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// The load falls on a straight line instead of at once.
pub struct FiniteRupture;

const ABOUT: About = About {
    id: "finite-rupture",
    physics: "the neck tears over a while: the force falls on a ramp, not at once",
    part: Part::Force,
    needs: &[Need::Release],
    parameters: &[Parameter {
        name: "rupture_time_s",
        unit: "s",
        meaning: "time from the first loss of force to the last",
        low: 0.0,
        high: 2e-5,
    }],
    class: &["finite-rupture"],
    resembles: "extra-pole: also rounds the edge; below 0.4 us they are one signal. Delay and gains absorb 99 % of it",
    next_measurement: "the same tip on a stiff dry sample: the ramp goes, a pole of the electronics stays",
    identifiable: Identifiable::Shape,
    source: "J. N. Israelachvili, Intermolecular and Surface Forces, 3rd ed., 2011, chapter 17",
};

impl Cause for FiniteRupture {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let duration = values[0];
        if duration > 0.0 {
            effects.remaining_load.push(Arc::new(move |t| (1.0 - t / duration).max(0.0)));
        }
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [1.0, 2.0, 4.0, 8.0].iter().map(|samples| vec![samples * scene.interval_s]).collect()
    }
}

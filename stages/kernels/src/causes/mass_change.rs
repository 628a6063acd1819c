//! Something that stuck to the tip.

use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// All modes step at a place in the archive.
pub struct MassChange;

const ABOUT: About = About {
    id: "mass-change",
    physics: "the tip picks something up, or loses it: all frequencies step between two records",
    part: Part::Archive,
    needs: &[Need::Release, Need::Records],
    parameters: &[
        Parameter {
            name: "relative_change",
            unit: "1",
            meaning: "relative step of the frequencies",
            low: -0.1,
            high: 0.1,
        },
        Parameter {
            name: "place",
            unit: "1",
            meaning: "where in the archive, 0 first record, 1 last",
            low: 0.0,
            high: 1.0,
        },
    ],
    class: &["mass-change"],
    resembles: "frequency-drift: gradual",
    next_measurement: "thermal spectrum before and after",
    identifiable: Identifiable::Shape,
    source: "J. P. Cleveland et al., Rev. Sci. Instrum. 64 (1993) 403",
};

/// Most places that are tried.
const MOST: usize = 24;

impl Cause for MassChange {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (change, place) = (values[0], values[1]);
        effects.frequency.push(Arc::new(move |at| if at.place >= place { change } else { 0.0 }));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let own = 0.1 / scene.quality_factor.first().copied().unwrap_or(100.0).max(1.0);
        let mut between: Vec<f64> = scene.places.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        if between.is_empty() {
            between = vec![0.2, 0.35, 0.5, 0.65, 0.8];
        }
        let every = between.len().div_ceil(MOST);
        between.into_iter().step_by(every).map(|place| vec![0.01 * own, place]).collect()
    }

    fn sets_in(&self) -> Option<usize> {
        Some(1)
    }
}

//! The piezo's drive in the deflection channel.

use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// `v += kappa z`.
pub struct PiezoCrosstalk;

const ABOUT: About = About {
    id: "piezo-crosstalk",
    physics: "the piezo's voltage, or its tilt, leaks into the deflection channel",
    part: Part::Record,
    needs: &[Need::Release],
    parameters: &[Parameter {
        name: "kappa_v_per_m",
        unit: "V/m",
        meaning: "volts per metre of piezo travel",
        low: -1e6,
        high: 1e6,
    }],
    class: &["piezo-crosstalk"],
    resembles: "interference-fringe: bent in the position, a straight line is not",
    next_measurement: "a ramp far from the surface: the slope stays; then with the piezo's cable moved",
    identifiable: Identifiable::Record,
    source: "H.-J. Butt et al., Surf. Sci. Rep. 59 (2005) 1",
};

impl Cause for PiezoCrosstalk {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let kappa = values[0];
        effects.added.push(Arc::new(move |at| kappa * at.piezo_m));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![1e7 * scene.noise_v]]
    }
}
